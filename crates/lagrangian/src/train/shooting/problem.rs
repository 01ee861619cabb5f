//! The recordings as segments, and their residuals.

use std::ops::Range;

use faer::Mat;
use lagrangian_motion::parallel::prelude::*;

use super::disturbance::Disturbance;
use super::normal::{Normal, Reduced, eliminate};
use super::path::{At, Course, Path, Wanted};
use crate::train::learner::Learner;
use crate::train::rollout::Recorded;
use lagrangian_motion::solve::dot;
use lagrangian_motion::statistics::root_mean_square;

/// Segments that are followed at once.
pub(super) const BLOCK: usize = 4;

/// Steps of the starts of new segments.
const IMPROVEMENTS: usize = 4;

/// The largest number of samples, and of products of a step, rows × P² of P parameters, while there are two rows for each parameter: of
/// longer recordings segments are left out, evenly.
const MOST: usize = 10_000;
const PRODUCTS: f64 = 1e10;

/// The lengths of a step that are tried, each half of the last.
const TRIES: usize = 4;

/// A step that is foreseen to lower χ² by less than this part is not taken.
const SETTLED: f64 = 1e-9;

/// χ² and what a step lowers it by, where a rollout fails.
const LOST: [f64; 2] = [f64::INFINITY, 0.0];

/// The length of the rollouts that tell how many steps of the integrator are needed, their largest number between two samples, and the
/// error, in units of the noise, that is too small to need more: it grows along a segment of ten times that length.
const RESOLVED: usize = 15;
const SUBSTEPS: usize = 8;
const SLIGHT: f64 = 0.02;

/// An error of the start as large as the noise may grow to this part of the deviation, or else by this factor: beyond that residuals
/// are not linear in the start.
const LINEAR: f64 = 0.3;
const LEAST: f64 = 3.0;

/// What errors of forces that are taken for real leave of what exceeds the noise of positions.
const EXPLAINED: f64 = 0.5;
/// The samples by which what a filter leaves is compared with itself.
const LAGS: usize = 8;
/// … and what sampling may make of its correlation.
const BY_SAMPLING: f64 = 0.01;
/// How often the error of a force is halved, and the factors by which the likeliest is then narrowed.
const HALVES: i32 = 12;
const NARROWED: [f64; 6] = [0.75, 0.85, 0.9, 0.95, 0.97, 0.98];

/// A stretch of a recording that one rollout follows.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    /// The first sample.
    pub(super) begin: usize,
    pub(super) samples: usize,
    /// The state at the first sample, `[2n]`.
    pub(super) start: Vec<f64>,
}

/// What is refined, and on what.
pub(crate) struct Problem<'a> {
    pub(super) learner: &'a dyn Learner<f64>,
    pub(super) recorded: Recorded<'a>,
    /// The noise of the components of a state that are compared, `[n]` or `[2n]`.
    pub(super) noise: &'a [f64],
    /// The end of each run and its own noise, where runs differ.
    runs: Vec<(usize, Vec<f64>)>,
    /// The deviation of each component of a state, `[2n]`.
    deviations: Vec<f64>,
    pub(super) course: Course,
    /// The errors of recorded forces, where they are known.
    disturbance: Option<Disturbance>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        learner: &'a dyn Learner<f64>,
        recorded: Recorded<'a>,
        noise: &'a [f64],
    ) -> Self {
        Self {
            deviations: (0..2 * learner.dof())
                .map(|c| recorded.deviation(c))
                .collect(),
            learner,
            recorded,
            noise,
            runs: Vec::new(),
            course: Course {
                substeps: 1,
                held: true,
            },
            disturbance: None,
        }
    }

    /// The same with a noise of each run, which ends at the sample beside it.
    pub(crate) fn with_noise_of(mut self, runs: Vec<(usize, Vec<f64>)>) -> Self {
        self.runs = runs;
        self
    }

    /// The same with errors of the recorded forces that have these deviations, `[n]`.
    pub(crate) fn disturbed(mut self, theta: &[f64], sizes: &[f64]) -> Self {
        let any = sizes.iter().any(|size| *size > 0.0);
        self.disturbance = any.then(|| Disturbance::of(&self, theta, sizes));
        self
    }

    /// The deviations of the errors of recorded forces, none beyond `most`, with which what these segments leave is most likely, which
    /// this problem then has; `None` where these errors do not explain most of what exceeds the noise of positions.
    pub(crate) fn likeliest(
        &mut self,
        (theta, segments): (&[f64], &[Segment]),
        most: &[f64],
    ) -> Option<Vec<f64>> {
        let (residuals, starts) = self.counts(segments);
        let at = self.at(theta);
        let blocks = segments.par_chunks(BLOCK);
        let rows: Vec<_> = blocks.map(|block| self.rows(&at, block, false)).collect();
        let rows: Vec<_> = rows.into_iter().collect::<Option<Vec<_>>>()?;
        let rows: Vec<_> = rows.into_iter().flatten().collect();
        let mut own = Disturbance::of(self, theta, &vec![0.0; most.len()]);
        let deviance = |own: &Disturbance| -> f64 {
            let each = segments.par_iter().zip(&rows);
            let each = each.map(|(segment, (rows, residual))| {
                let noise = self.noise_of(segment);
                let (mut rows, mut residual) = (rows.clone(), residual.clone());
                own.whiten(segment, noise, &mut rows);
                let logarithm = own.whiten(segment, noise, &mut residual);
                let left = eliminate(rows, residual, 0, self.state()).residual;
                dot(&left, &left) + logarithm
            });
            each.collect::<Vec<f64>>().iter().sum()
        };
        let none = deviance(&own) - (residuals - starts) as f64;
        own.sizes.copy_from_slice(most);
        let erring: Vec<usize> = (0..most.len()).filter(|i| most[*i] > 0.0).collect();
        let mut least = (0.0, f64::INFINITY);
        for _ in 0..erring.len().min(2) {
            for &i in &erring {
                let mut tried = |part: f64| {
                    own.sizes[i] = part * most[i];
                    (part, deviance(&own))
                };
                let halves = (0..HALVES).map(|k| 0.5_f64.powi(k)).chain([0.0]);
                let best = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
                least = halves.map(&mut tried).fold((0.0, f64::INFINITY), best);
                for step in NARROWED {
                    for part in [least.0 * step, (least.0 / step).min(1.0)] {
                        least = best(least, tried(part));
                    }
                }
                own.sizes[i] = least.0 * most[i];
            }
        }
        let left = least.1 - (residuals - starts) as f64;
        let first = self.disturbance.is_none();
        if !left.is_finite() || (first && left > EXPLAINED * none) {
            return None;
        }
        let sizes = own.sizes.clone();
        self.disturbance = Some(own);
        Some(sizes)
    }

    /// The noise of what is compared along a segment.
    fn noise_of(&self, segment: &Segment) -> &[f64] {
        let at = self.runs.partition_point(|(end, _)| *end <= segment.begin);
        self.runs.get(at).map_or(self.noise, |(_, own)| own)
    }

    /// The same with as many steps of the integrator as keep its errors below the noise, and with forces that are held or not, as short
    /// rollouts tell.
    pub(crate) fn resolved(mut self, theta: &[f64]) -> Self {
        let states = self.recorded_states();
        if self.recorded.samples.tau.iter().any(|tau| *tau != 0.0) {
            let [held, smooth] = [true, false].map(|held| {
                self.course.held = held;
                self.cut(theta, RESOLVED, &states).1
            });
            self.course.held = held < smooth;
        }
        let segments = self.segments(theta, RESOLVED, &states);
        let mut now = self.followed(theta, &segments);
        while self.course.substeps < SUBSTEPS {
            self.course.substeps *= 2;
            let finer = self.followed(theta, &segments);
            let error = |(a, b): (&Vec<f64>, &Vec<f64>)| {
                let errors = a.iter().zip(b).map(|(a, b)| a - b);
                let errors: Vec<f64> = errors.filter(|e| e.is_finite()).collect();
                root_mean_square(&mut errors.into_iter())
            };
            let errors = now.iter().zip(&finer).map(error);
            // The fastest motion decides: what is little for all of them together can be most of its misfit.
            if errors.filter(|e| e.is_finite()).fold(0.0, f64::max) < SLIGHT {
                self.course.substeps /= 2;
                break;
            }
            now = finer;
        }
        self
    }

    /// The length d of a state.
    pub(super) fn state(&self) -> usize {
        2 * self.learner.dof()
    }

    pub(super) fn at(&self, theta: &[f64]) -> At<'_> {
        At::new(self.learner, self.recorded, theta, self.course)
    }

    /// The numbers of residuals and of components of starts.
    pub(super) fn counts(&self, segments: &[Segment]) -> (usize, usize) {
        let samples: usize = segments.iter().map(|s| s.samples).sum();
        (samples * self.noise.len(), segments.len() * self.state())
    }

    /// The recorded states, `[samples, d]`.
    pub(super) fn recorded_states(&self) -> Vec<f64> {
        let (d, samples) = (self.state(), self.recorded.samples.len());
        (0..samples * d)
            .map(|at| self.recorded.state(at / d, at % d))
            .collect()
    }

    /// The largest number of samples for so many parameters.
    fn most(&self, parameters: usize) -> usize {
        let p = parameters.max(1);
        let rows = ((PRODUCTS / (p as f64).powi(2)) as usize).max(2 * p);
        (rows / self.noise.len()).clamp(1, MOST)
    }

    /// Segments of about `horizon` samples that start at these states, halved while a state depends too much on the start.
    pub(super) fn segments(&self, theta: &[f64], horizon: usize, states: &[f64]) -> Vec<Segment> {
        let (d, at) = (self.state(), self.at(theta));
        let segment = |begin: usize, end: usize| Segment {
            begin,
            samples: end - begin,
            start: states[begin * d..][..d].to_vec(),
        };
        let runs = self.recorded.times.runs().filter(|run| run.len() > 1);
        let (samples, most) = (self.recorded.samples.len(), self.most(theta.len()));
        let every = samples.div_ceil(most).max(1);
        let mut segments: Vec<Segment> = runs
            .flat_map(|run| {
                let parts = ((run.len() + horizon / 2) / horizon).max(1);
                let cut = move |k: usize| run.start + run.len() * k / parts;
                (0..parts)
                    .map(move |k| segment(cut(k), cut(k + 1)))
                    .collect::<Vec<_>>()
            })
            .step_by(every)
            .collect();
        loop {
            let blocks = segments.par_chunks(BLOCK);
            let chaotic: Vec<bool> = blocks
                .flat_map_iter(|block| self.chaotic(&at, block))
                .collect();
            let halves = |(s, chaotic): (&Segment, &bool)| {
                let (middle, end) = (s.begin + s.samples / 2, s.begin + s.samples);
                match *chaotic && s.samples >= 8 {
                    true => vec![segment(s.begin, middle), segment(middle, end)],
                    false => vec![s.clone()],
                }
            };
            let halved: Vec<Segment> = segments.iter().zip(&chaotic).flat_map(halves).collect();
            if halved.len() == segments.len() {
                return segments;
            }
            segments = halved;
        }
    }

    /// Segments whose starts are near the best for these parameters, and their χ².
    pub(super) fn cut(&self, theta: &[f64], horizon: usize, states: &[f64]) -> (Vec<Segment>, f64) {
        let mut segments = self.segments(theta, horizon, states);
        let values = (0..IMPROVEMENTS).map(|_| self.improve_starts(theta, &mut segments));
        let value = values.last().unwrap_or(f64::INFINITY);
        (segments, value)
    }

    /// Segments of the last horizon whose starts are near the best for these parameters.
    pub(crate) fn longest(&self, theta: &[f64], horizons: &[usize]) -> Vec<Segment> {
        let (mut states, mut segments) = (self.recorded_states(), Vec::new());
        for &horizon in horizons {
            self.write_states(theta, &segments, &mut states);
            (segments, _) = self.cut(theta, horizon, &states);
        }
        segments
    }

    /// The information Jᵀ J about the parameters with the starts of segments free, `[P, P]`, its lower triangle, and Jᵀr; `None`
    /// where a rollout fails.
    pub(crate) fn information(
        &self,
        theta: &[f64],
        segments: &[Segment],
    ) -> Option<(Mat<f64>, Vec<f64>)> {
        let Normal { matrix, right, .. } = Normal::of(self, theta, segments)?;
        Some((matrix, right))
    }

    /// By how many standard errors what segments leave is alike from sample to sample, as what is white is not; 0 where forces do not err,
    /// or a rollout fails. That sampling makes it a little alike counts for less and less of a long recording.
    pub(crate) fn memory(&self, theta: &[f64], segments: &[Segment]) -> f64 {
        if self.disturbance.is_none() {
            return 0.0;
        }
        let (at, seen) = (self.at(theta), self.noise.len());
        let blocks = segments.par_chunks(BLOCK);
        let left: Vec<_> = blocks
            .map(|block| self.reduced(&at, block, false))
            .collect();
        let Some(left) = left.into_iter().collect::<Option<Vec<_>>>() else {
            return 0.0;
        };
        let [mut sum, mut square, mut count, mut size] = [0.0; 4];
        for own in left.iter().flatten() {
            let all = &own.residual;
            for lag in 1..=LAGS {
                let later = all.get(lag * seen..).unwrap_or_default();
                sum += all.iter().zip(later).map(|(a, b)| a * b).sum::<f64>();
                count += later.len() as f64;
            }
            square += dot(all, all);
            size += all.len() as f64;
        }
        let alike = sum / count / (square / size);
        let deviation = f64::sqrt(count).recip().max(BY_SAMPLING);
        if count > 0.0 { alike / deviation } else { 0.0 }
    }

    /// χ² of each recorded motion over its expectation, from the starts of these segments.
    pub(crate) fn misfits(&self, theta: &[f64], segments: &[Segment]) -> Vec<f64> {
        let all = self.by_motion(theta, segments).into_iter();
        all.map(|(_, [value, count])| value / count).collect()
    }

    /// Of each recorded motion its segments, their χ², and its expectation; not of one that has nothing but their starts.
    pub(crate) fn by_motion(
        &self,
        theta: &[f64],
        segments: &[Segment],
    ) -> Vec<(Vec<Segment>, [f64; 2])> {
        let values = self.values(theta, segments);
        let runs = self.recorded.times.runs().filter(|run| run.len() > 1);
        let motion = |run: Range<usize>| {
            let own = segments.iter().zip(&values);
            let own = own.filter(|(s, _)| run.contains(&s.begin));
            let value: f64 = own.clone().map(|(_, value)| value).sum();
            let own: Vec<Segment> = own.map(|(s, _)| s.clone()).collect();
            let (residuals, starts) = self.counts(&own);
            (residuals > starts).then(|| (own, [value, (residuals - starts) as f64]))
        };
        runs.filter_map(motion).collect()
    }

    /// Whether a state of each segment depends on its start by more than the bound.
    fn chaotic(&self, at: &At<'_>, block: &[Segment]) -> Vec<bool> {
        let (d, unit) = (self.state(), &self.deviations);
        let noise = self.noise.iter().zip(unit);
        let noise = noise.map(|(own, unit)| own / unit).fold(0.0, f64::max);
        let bound = (LINEAR / noise).max(LEAST);
        let path = Path::of(at, block, Wanted::Starts(d));
        let each = path.slopes.iter().zip(&path.failed);
        let exceeds = |slopes: &[f64]| {
            slopes.iter().enumerate().any(|(at, x)| {
                let (to, from) = (at / d % d, at % d);
                let grown = (x * unit[from] / unit[to]).abs();
                grown.is_nan() || grown > bound
            })
        };
        each.map(|(slopes, failed)| *failed || exceeds(slopes))
            .collect()
    }

    /// Predicted less recorded along these states of a segment, `[samples, seen]`.
    fn errors(&self, segment: &Segment, states: &[f64]) -> Vec<f64> {
        let of_sample = |(j, x): (usize, &[f64])| {
            let of = |c: usize| {
                let seen = self.recorded.measured(segment.begin + j, c);
                self.recorded.difference(c, x[c], seen)
            };
            (0..self.noise.len()).map(of).collect::<Vec<f64>>()
        };
        let samples = states.chunks_exact(self.state()).enumerate();
        samples.flat_map(of_sample).collect()
    }

    /// The same over the noise.
    fn residuals(&self, segment: &Segment, states: &[f64]) -> Vec<f64> {
        let mut errors = self.errors(segment, states);
        self.whiten(segment, &mut errors);
        errors
    }

    /// Divides rows along a segment by their noise.
    fn whiten(&self, segment: &Segment, rows: &mut [f64]) {
        let noise = self.noise_of(segment);
        if let Some(disturbance) = &self.disturbance {
            disturbance.whiten(segment, noise, rows);
            return;
        }
        let columns = rows.len() / (segment.samples * noise.len());
        let each = rows.chunks_exact_mut(columns).zip(noise.iter().cycle());
        each.for_each(|(row, sigma)| row.iter_mut().for_each(|x| *x /= sigma));
    }

    /// The residuals of each segment; ∞ where its rollout fails.
    fn followed(&self, theta: &[f64], segments: &[Segment]) -> Vec<Vec<f64>> {
        let at = self.at(theta);
        let of_block = |block: &[Segment]| -> Vec<Vec<f64>> {
            let path = Path::of(&at, block, Wanted::States);
            let each = block.iter().zip(&path.states).zip(&path.failed);
            let own = |((segment, states), failed): ((&Segment, &Vec<f64>), &bool)| match failed {
                true => vec![f64::INFINITY],
                false => self.residuals(segment, states),
            };
            each.map(own).collect()
        };
        segments.par_chunks(BLOCK).flat_map_iter(of_block).collect()
    }

    /// χ² of each segment, ∞ where its rollout fails.
    fn values(&self, theta: &[f64], segments: &[Segment]) -> Vec<f64> {
        let all = self.followed(theta, segments).into_iter();
        let values = all.map(|r| dot(&r, &r));
        values
            .map(|x| if x.is_nan() { f64::INFINITY } else { x })
            .collect()
    }

    /// One step of each start alone, shorter where the whole does not help; returns χ².
    pub(super) fn improve_starts(&self, theta: &[f64], segments: &mut [Segment]) -> f64 {
        let at = self.at(theta);
        let of_block = |block: &[Segment]| -> Vec<(Segment, [f64; 2])> {
            match self.reduced(&at, block, false) {
                Some(reduced) => {
                    let each = block.iter().zip(&reduced);
                    let own = |(s, r): (&Segment, &Reduced)| (r.start.of(s, &[]), r.value());
                    each.map(own).collect()
                }
                None => block.iter().map(|s| (s.clone(), LOST)).collect(),
            }
        };
        let blocks = segments.par_chunks(BLOCK);
        let (mut moved, values): (Vec<_>, Vec<_>) = blocks.flat_map_iter(of_block).unzip();
        let (mut values, foreseen): (Vec<_>, Vec<_>) = values
            .into_iter()
            .map(|[value, gain]| (value, gain))
            .unzip();
        let mut open: Vec<usize> = (0..moved.len()).collect();
        open.retain(|&s| foreseen[s] > SETTLED * values[s]);
        for _ in 0..TRIES {
            let tried: Vec<Segment> = open.iter().map(|&s| moved[s].clone()).collect();
            let mut after = self.values(theta, &tried).into_iter();
            open.retain(|&s| {
                let value = after.next().unwrap_or(f64::INFINITY);
                let better = value < values[s];
                if better {
                    (segments[s], values[s]) = (moved[s].clone(), value);
                } else {
                    let pairs = moved[s].start.iter_mut().zip(&segments[s].start);
                    pairs.for_each(|(x, from)| *x = f64::midpoint(*x, *from));
                }
                !better
            });
        }
        values.iter().sum()
    }

    /// Segments without their starts, linearised in the parameters where these are to change.
    pub(super) fn reduced(
        &self,
        at: &At<'_>,
        block: &[Segment],
        parameters: bool,
    ) -> Option<Vec<Reduced>> {
        let count = if parameters {
            self.learner.parameters()
        } else {
            0
        };
        let each = block.iter().zip(self.rows(at, block, parameters)?);
        let reduced = each.map(|(segment, (mut rows, mut residual))| {
            self.whiten(segment, &mut rows);
            self.whiten(segment, &mut residual);
            eliminate(rows, residual, count, self.state())
        });
        Some(reduced.collect())
    }

    /// The slopes of what is compared, `[samples, seen, P + d]` or without those by parameters, and its errors, as they are; `None`
    /// where a rollout fails.
    fn rows(
        &self,
        at: &At<'_>,
        block: &[Segment],
        parameters: bool,
    ) -> Option<Vec<(Vec<f64>, Vec<f64>)>> {
        let seen = self.noise.len();
        let wanted = match parameters {
            true => Wanted::All(seen),
            false => Wanted::Starts(seen),
        };
        let path = Path::of(at, block, wanted);
        if path.failed.contains(&true) {
            return None;
        }
        let each = block.iter().zip(&path.states).zip(path.slopes);
        let own = each.map(|((segment, states), rows)| (rows, self.errors(segment, states)));
        Some(own.collect())
    }

    /// Writes the states along the segments to `states`, `[samples, d]`.
    pub(super) fn write_states(&self, theta: &[f64], segments: &[Segment], states: &mut [f64]) {
        let at = self.at(theta);
        for block in segments.chunks(BLOCK) {
            let path = Path::of(&at, block, Wanted::States);
            for (segment, x) in block.iter().zip(&path.states) {
                states[segment.begin * self.state()..][..x.len()].copy_from_slice(x);
            }
        }
    }
}
