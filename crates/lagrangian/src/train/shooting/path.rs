//! A block of segments, forward with the sensitivities of their states to the parameters and to the starts.

use super::problem::Segment;
use crate::train::learner::{Learner, Work};
use crate::train::rollout::Recorded;
use crate::train::rollout::flow::{Flow, Point, Sizes};
use crate::train::rollout::rk4;
use lagrangian_mechanics::integrate::Rk4;
use lagrangian_recordings::low_pass::lagrange;
use nets::{Packed, Terms};

/// Columns of a sensitivity that are carried at a time: those of all components of a state stay in the first-level cache.
const COLUMNS: usize = 256;

/// A model at some parameters, and the recordings that it follows.
pub(super) struct At<'a> {
    learner: &'a dyn Learner<f64>,
    packed: Packed<f64>,
    extra: Vec<f64>,
    terms: Terms,
    recorded: Recorded<'a>,
    course: Course,
}

/// How a rollout goes from one sample to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// Steps of the integrator.
    pub(super) substeps: usize,
    /// Whether τ is that of the sample until the next; else it goes through the samples as cubics do.
    pub(super) held: bool,
}

impl<'a> At<'a> {
    pub(super) fn new(
        learner: &'a dyn Learner<f64>,
        recorded: Recorded<'a>,
        theta: &[f64],
        course: Course,
    ) -> Self {
        let net = learner.net();
        let (weights, extra) = theta.split_at(net.parameters);
        let mut packed = Packed::new(net);
        packed.set(net, weights);
        Self {
            packed,
            extra: extra.to_vec(),
            terms: learner.terms(),
            learner,
            recorded,
            course,
        }
    }

    /// The flow of blocks of these sizes.
    pub(super) fn flow(&self, sizes: Sizes) -> Flow<'_> {
        Flow {
            learner: self.learner,
            packed: &self.packed,
            extra: &self.extra,
            sizes,
        }
    }

    /// Writes τ of a segment after this part of the step from sample `k`.
    fn force(&self, segment: &Segment, k: usize, part: f64, tau: &mut [f64]) {
        let (n, samples, t) = (tau.len(), self.recorded.samples, &self.recorded.times.t);
        let row = |k: usize| &samples.tau[(segment.begin + k) * n..][..n];
        tau.copy_from_slice(row(k));
        if self.course.held || part == 0.0 {
            return;
        }
        let near = k.saturating_sub(1)..(k + 3).min(segment.samples);
        let times = &t[segment.begin + near.start..segment.begin + near.end];
        let [from, to] = [k, k + 1].map(|k| t[segment.begin + k]);
        for (i, tau) in tau.iter_mut().enumerate() {
            let values: Vec<f64> = near.clone().map(|k| row(k)[i]).collect();
            *tau = lagrange(times, &values, from + part * (to - from));
        }
    }
}

/// What a pass over segments leaves: states, and the sensitivities of the first so many components.
#[derive(Clone, Copy)]
pub(super) enum Wanted {
    States,
    /// Those to the starts.
    Starts(usize),
    /// Those to the parameters and to the starts.
    All(usize),
}

/// The states of a block along its segments.
pub(super) struct Path {
    /// x of each sample of each segment, `[samples, d]`.
    pub(super) states: Vec<Vec<f64>>,
    /// ∂x/∂(θ, s) of each sample of each segment, `[samples, wanted components, P + d]`.
    pub(super) slopes: Vec<Vec<f64>>,
    /// Whether the rollout of each segment has failed.
    pub(super) failed: Vec<bool>,
}

impl Path {
    /// Follows segments by the classical method of Runge and Kutta.
    pub(super) fn of(at: &At<'_>, segments: &[Segment], wanted: Wanted) -> Self {
        let mut follower = Follower::new(at, segments, wanted);
        let longest = segments.iter().map(|s| s.samples).max().unwrap_or(0);
        for sample in 0..longest {
            follower.record(sample);
            if sample + 1 < longest {
                follower.pace(sample);
                (0..at.course.substeps).for_each(|step| follower.step(sample, step));
            }
        }
        follower.path
    }
}

/// The memory of a pass.
struct Follower<'a> {
    at: &'a At<'a>,
    segments: &'a [Segment],
    flow: Flow<'a>,
    work: Work<f64>,
    /// The stages of a step.
    points: Vec<Point>,
    /// x, `[segments, d]`, the step h of each segment, and its τ.
    x: Vec<f64>,
    h: Vec<f64>,
    tau: Vec<f64>,
    carried: Carried,
    path: Path,
}

/// The sensitivities that are carried along.
struct Carried {
    /// The components of which they are kept; 0 for none.
    seen: usize,
    /// The parameters to which they are carried: all or none.
    parameters: usize,
    /// ∂x/∂(θ, s), its last rate, and its change in a step, `[segments, d, P + d]`.
    now: Vec<f64>,
    rate: Vec<f64>,
    change: Vec<f64>,
    /// ∂S/∂θ of one sample, `[k, P]`.
    rows: Vec<f64>,
    scratch: Vec<f64>,
    /// The sensitivities at a stage, some columns of them.
    moved: Vec<f64>,
}

impl Carried {
    fn new(sizes: Sizes, seen: usize, parameters: usize) -> Self {
        let (d, columns) = (sizes.state(), parameters + sizes.state());
        let wide = if seen > 0 {
            sizes.samples * d * columns
        } else {
            0
        };
        let mut now = vec![0.0; wide];
        for (row, slopes) in now.chunks_exact_mut(columns).enumerate() {
            slopes[parameters + row % d] = 1.0;
        }
        Self {
            seen,
            parameters,
            now,
            rate: vec![0.0; wide],
            change: vec![0.0; wide],
            rows: vec![0.0; sizes.outputs * parameters],
            scratch: Vec::new(),
            moved: vec![0.0; d * COLUMNS],
        }
    }
}

impl<'a> Follower<'a> {
    fn new(at: &'a At<'a>, segments: &'a [Segment], wanted: Wanted) -> Self {
        let (learner, count) = (at.learner, segments.len());
        let sizes = Sizes::of(learner, count);
        let d = sizes.state();
        let (seen, parameters) = match wanted {
            Wanted::States => (0, 0),
            Wanted::Starts(seen) => (seen, 0),
            Wanted::All(seen) => (seen, learner.parameters()),
        };
        let each = |size: usize| move |s: &Segment| Vec::with_capacity(s.samples * size);
        Self {
            flow: at.flow(sizes),
            work: Work::new(learner, count),
            points: vec![Point::new(&sizes, false); Rk4::STAGES.len()],
            x: segments
                .iter()
                .flat_map(|s| s.start.iter().copied())
                .collect(),
            h: vec![0.0; count],
            tau: vec![0.0; count * sizes.n],
            carried: Carried::new(sizes, seen, parameters),
            path: Path {
                states: segments.iter().map(each(d)).collect(),
                slopes: segments.iter().map(each(seen * (parameters + d))).collect(),
                failed: vec![false; count],
            },
            at,
            segments,
        }
    }

    /// Keeps the states of a sample, and their sensitivities.
    fn record(&mut self, sample: usize) {
        let d = self.flow.sizes.state();
        let columns = self.carried.parameters + d;
        for (s, _) in self
            .segments
            .iter()
            .enumerate()
            .filter(|(_, g)| sample < g.samples)
        {
            self.path.states[s].extend(&self.x[s * d..][..d]);
            let slopes = self.carried.now.get(s * d * columns..).unwrap_or_default();
            self.path.slopes[s].extend(&slopes[..self.carried.seen * columns]);
        }
    }

    /// Sets h from a sample to the next; segments that have ended stay where they are.
    fn pace(&mut self, sample: usize) {
        let t = &self.at.recorded.times.t;
        for (h, segment) in self.h.iter_mut().zip(self.segments) {
            let i = segment.begin + sample;
            *h = match sample + 1 < segment.samples {
                true => (t[i + 1] - t[i]) / self.at.course.substeps as f64,
                false => 0.0,
            };
        }
    }

    /// One of the steps of the integrator from a sample to the next.
    fn step(&mut self, sample: usize, step: usize) {
        let Self {
            at,
            segments,
            flow,
            work,
            points,
            x,
            h,
            tau,
            carried,
            path,
            ..
        } = self;
        let n = flow.sizes.n;
        rk4::advance(x, h, points, |stage, point| {
            let part = (step as f64 + Rk4::STAGES[stage].0) / at.course.substeps as f64;
            for (segment, tau) in segments.iter().zip(tau.chunks_exact_mut(n)) {
                match sample + 1 < segment.samples {
                    true => at.force(segment, sample, part, tau),
                    false => at.force(segment, 0, 0.0, tau),
                }
            }
            if carried.seen > 0 {
                flow.linearised(work, tau, point, &mut path.failed);
                let sizes = flow.sizes;
                for (s, h) in h.iter().enumerate() {
                    carried.carry(at, (sizes, work), point, (stage, s, *h));
                }
            } else {
                let Point { x, rate, .. } = point;
                flow.rate(work, x, tau, rate, &mut path.failed);
            }
        });
        let changed = carried.now.iter_mut().zip(&carried.change);
        changed.for_each(|(now, change)| *now += change);
    }
}

impl Carried {
    /// Writes ∂S/∂θ of segment `s`.
    fn differentiate(&mut self, at: &At<'_>, sizes: Sizes, work: &Work<f64>, s: usize) {
        let (learner, Sizes { n, outputs, .. }) = (at.learner, sizes);
        let (net, forces) = (learner.net(), learner.extra());
        for (i, row) in self.rows.chunks_exact_mut(self.parameters).enumerate() {
            let (terms, pass) = (&at.terms, &work.pass);
            pass.jacobian_row(net, terms, (s, i), &mut self.scratch, row);
            row[net.parameters..].fill(0.0);
            let slopes = &work.linear.extra[(s * outputs + i) * forces..][..forces];
            for (e, slope) in slopes.iter().enumerate() {
                row[net.parameters + e * n + learner.coordinate(i)] = *slope;
            }
        }
    }

    /// The sensitivities of segment `s` at a stage: rate ← F (now + a h rate) + D ∂S/∂θ, change ← change + b h rate.
    fn carry(
        &mut self,
        at: &At<'_>,
        (sizes, work): (Sizes, &Work<f64>),
        point: &Point,
        (stage, s, h): (usize, usize, f64),
    ) {
        if self.parameters > 0 {
            self.differentiate(at, sizes, work, s);
        }
        let Sizes {
            rates, outputs: k, ..
        } = sizes;
        let (d, (a, sixths)) = (sizes.state(), Rk4::STAGES[stage]);
        let (ah, bh) = (a * h, sixths / 6.0 * h);
        let columns = self.parameters + d;
        let slopes = &point.slopes[s * d * d..][..d * d];
        let by_output = &point.by_output[s * rates * k..][..rates * k];
        let all = s * d * columns..(s + 1) * d * columns;
        let (now, rate) = (&self.now[all.clone()], &mut self.rate[all.clone()]);
        let change = &mut self.change[all];
        let moved = &mut self.moved;
        for from in (0..columns).step_by(COLUMNS) {
            let width = COLUMNS.min(columns - from);
            for (c, moved) in moved.chunks_exact_mut(COLUMNS).enumerate() {
                let part = c * columns + from..c * columns + from + width;
                let pairs = now[part.clone()].iter().zip(&rate[part]);
                let ah = if stage == 0 { 0.0 } else { ah };
                moved
                    .iter_mut()
                    .zip(pairs)
                    .for_each(|(m, (x, r))| *m = x + ah * r);
            }
            for i in 0..d {
                let part = i * columns + from..i * columns + from + width;
                let out = &mut rate[part.clone()];
                out.fill(0.0);
                for (slope, moved) in slopes[i * d..][..d].iter().zip(moved.chunks_exact(COLUMNS)) {
                    if *slope != 0.0 {
                        out.iter_mut().zip(moved).for_each(|(o, m)| *o += slope * m);
                    }
                }
                let learned = (i + rates)
                    .checked_sub(d)
                    .filter(|_| from < self.parameters);
                for j in learned.map_or(0..0, |_| 0..k) {
                    let weight = by_output[(i + rates - d) * k + j];
                    let row = &self.rows[j * self.parameters..][..self.parameters][from..];
                    out.iter_mut().zip(row).for_each(|(o, r)| *o += weight * r);
                }
                let change = &mut change[part];
                if stage == 0 {
                    change.fill(0.0);
                }
                change.iter_mut().zip(&*out).for_each(|(c, r)| *c += bh * r);
            }
        }
    }
}
