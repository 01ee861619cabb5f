//! What the motion says of the forces: a model that is linear in its parameters, fitted at many delays at once.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | Y | regressor of one joint at the samples: accelerations, friction, gravity, Coriolis terms | m × P |
//! | δₖ | a delay of k steps of the grid | K |
//! | τ(t − δₖ) | the force so much earlier | m × K |
//!
//! Motion and forces pass the same local polynomials on one even grid, so that a shift by a step is exact and all
//! shifts see the same band of frequencies. A stretch of a recording leaves behind `YᵀY`, `Yᵀτ` and `τᵀτ` alone; leaving
//! one stretch out after the other then costs no second look at the samples (theory.md, equations 61 and 62).

use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

use super::{CheckOptions, time};
use crate::Coordinates;
use crate::trajectory::Recording;
use crate::trajectory::derivatives::acceleration_window;
use crate::trajectory::local_polynomial::{Filter, Series, around, median_step, segments};

/// Stretches that are left out one after the other.
const STRETCHES: usize = 24;
/// Longest stretch, steps of the grid.
const LONGEST: usize = 2500;
/// Samples of a stretch that are used.
const SAMPLES: usize = 600;
/// Delays are looked for up to this time …
const FARTHEST: f64 = 0.06;
/// … and among at least, and at most, so many steps either way.
const STEPS: (usize, usize) = (12, 60);
/// The window in parts of the one that knows accelerations best: noise makes a delay uncertain but not wrong, while a
/// long window hides the fast motion that tells it.
const SHORTER: f64 = 0.6;
/// The second window in parts of the first.
const WIDER: f64 = 1.4;
/// Added to the diagonal of the system in units of it.
const RIDGE: f64 = 1e-9;
/// The speeds over which dry friction may change its sign, in parts of the root mean square of the velocity.
const FRICTION: [f64; 2] = [0.05, 0.3];

/// One recording on its way into the regression.
struct Source<'a> {
    recording: &'a Recording,
    tau: &'a [f64],
    segments: Vec<Range<usize>>,
    /// Window of the polynomials, samples.
    window: usize,
}

/// How well accelerations can be known from the positions, by coordinate.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Certainty {
    /// Standard error of q̈ over its root mean square.
    pub(super) error: f64,
    /// A window for a filter, s: half as long again as the one in which q̈ is known best, but at most a quarter of the
    /// period of the motion.
    pub(super) filter: f64,
}

/// What was found for one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// The motion answers the force so much later, s.
    pub(super) delay: f64,
    /// Standard error of that, s.
    pub(super) error: f64,
    /// Whether the delay stands at an end of what was looked at.
    pub(super) at_end: bool,
    /// Part of the variance of the force that the motion explains at this delay, and at none.
    pub(super) explained: (f64, f64),
    /// Mean inertia ∂τᵢ/∂q̈ᵢ and its standard error, kg m² or kg.
    pub(super) inertia: (f64, f64),
    /// How much larger the inertia comes out in the wider window, as a part of it: noise and vibrations of the
    /// positions that the force does not know make it too small, the more so the shorter the window.
    pub(super) growth: f64,
    /// Root mean square of inertia × acceleration over that of the force.
    pub(super) share: f64,
}

/// All joints of some recordings.
pub(super) struct Findings {
    /// Step of the grid, s.
    pub(super) step: f64,
    /// For each coordinate, where it has forces that vary.
    pub(super) joints: Vec<Option<Found>>,
    /// For each coordinate.
    pub(super) certainty: Vec<Certainty>,
}

/// Looks at all recordings with forces and usable time stamps; `None` where there is none, or too little.
pub(super) fn findings(recordings: &[Recording], options: &CheckOptions) -> Option<Findings> {
    let first = recordings.first()?;
    let coordinates = &first.coordinates;
    let whole = |r: &&Recording| r.coordinates == *coordinates && usable(r);
    let sources: Vec<(Source<'_>, Vec<Certainty>)> = recordings
        .iter()
        .filter(whole)
        .filter_map(|r| Source::new(r, options))
        .collect();
    let n = coordinates.dof();
    let mean = |i: usize, of: fn(&Certainty) -> f64| {
        sources.iter().map(|s| of(&s.1[i])).sum::<f64>() / sources.len() as f64
    };
    let certainty = (0..n)
        .map(|i| Certainty {
            error: mean(i, |c| c.error),
            filter: mean(i, |c| c.filter),
        })
        .collect();
    let sources: Vec<Source<'_>> = sources.into_iter().map(|s| s.0).collect();
    let step = sources
        .iter()
        .map(|s| median_step(&s.recording.t))
        .reduce(f64::min)?;
    // A second, wider window shows what the choice of the first has decided.
    let near = joints(&sources, coordinates, step, 1.0)?;
    let wide = joints(&sources, coordinates, step, WIDER);
    let joints = near.into_iter().enumerate().map(|(i, found)| {
        let other = wide.as_ref().and_then(|w| w[i]);
        found.map(|f| f.beside(other))
    });
    Some(Findings {
        step,
        joints: joints.collect(),
        certainty,
    })
}

impl Found {
    /// The same with the difference to another window in its error.
    fn beside(self, other: Option<Self>) -> Self {
        let difference = other.map_or(0.0, |o| o.delay - self.delay);
        let growth = other.map_or(0.0, |o| o.inertia.0 / self.inertia.0 - 1.0);
        Self {
            growth,
            error: self.error.hypot(difference),
            ..self
        }
    }
}

fn usable(recording: &Recording) -> bool {
    let values = recording.len() * recording.dof();
    let signals = recording.signals();
    time::usable(recording)
        && signals
            .iter()
            .all(|(_, s, _)| s.len() == values && s.iter().all(|x| x.is_finite()))
}

impl<'a> Source<'a> {
    fn new(recording: &'a Recording, options: &CheckOptions) -> Option<(Self, Vec<Certainty>)> {
        let tau = recording.tau.as_ref()?;
        let n = recording.dof();
        let all = segments(&recording.t, time::GAP);
        let column = |i| Series {
            t: &recording.t,
            y: &recording.q,
            n,
            coordinate: i,
        };
        let chosen: Vec<_> = (0..n)
            .map(|i| acceleration_window(column(i), &all))
            .collect();
        let step = median_step(&recording.t);
        let window = match options.filter {
            Some(seconds) => (seconds / step).round() as usize | 1,
            None => (SHORTER * chosen.iter().map(|c| c.window).max()? as f64) as usize | 1,
        };
        let source = Self {
            recording,
            tau,
            segments: all,
            window: window.max(7),
        };
        let certainty = (0..n).map(|i| {
            let choice = chosen[i];
            source.certainty(column(i), choice.window, choice.standard_error())
        });
        let certainty = certainty.collect();
        Some((source, certainty))
    }

    /// `best` is the window in which q̈ is known best, with the standard error `error`.
    fn certainty(&self, series: Series<'_>, best: usize, error: f64) -> Certainty {
        let mean = |order| {
            let mut weights = Vec::new();
            let stride = (self.recording.len() / 500).max(1);
            let places = self
                .segments
                .iter()
                .flat_map(|s| s.clone().step_by(stride).map(move |k| (k, s)));
            let squares = places.map(|(k, s)| {
                let window = around(k, self.window, s);
                let t = &series.t[window.clone()];
                Filter::of_order(order).weights(t, series.t[k], &mut weights);
                series.dot(window.start, &weights).powi(2)
            });
            let (sum, count) = squares.fold((0.0, 0.0), |(s, c), x| (s + x, c + 1.0));
            f64::sqrt(sum / count)
        };
        let (speed, acceleration) = (mean(1), mean(2));
        let quarter = 0.5 * std::f64::consts::PI * speed / acceleration;
        let settled = 1.5 * best as f64 * median_step(&self.recording.t);
        Certainty {
            error: error / acceleration,
            filter: quarter.min(settled),
        }
    }
}

/// A stretch on the grid: times, and the segment of the recording that it lies in.
struct Stretch<'a> {
    source: &'a Source<'a>,
    segment: &'a Range<usize>,
    begin: f64,
    steps: usize,
}

/// Cuts all segments, less what filter and delays need at their ends, into stretches.
fn stretches<'a>(
    sources: &'a [Source<'a>],
    step: f64,
    window: f64,
    shifts: usize,
) -> Vec<Stretch<'a>> {
    let usable = |source: &'a Source<'a>| {
        let t = &source.recording.t;
        let own = median_step(t);
        let margin = 0.5 * window * source.window as f64 * own + shifts as f64 * step;
        source.segments.iter().filter_map(move |segment| {
            let (begin, end) = (t[segment.start] + margin, t[segment.end - 1] - margin);
            let steps = ((end - begin) / step).floor();
            (steps >= 20.0).then_some((source, segment, begin, steps as usize))
        })
    };
    let pieces: Vec<_> = sources.iter().flat_map(usable).collect();
    let total: usize = pieces.iter().map(|p| p.3).sum();
    let length = total.div_ceil(STRETCHES).max(20);
    let cut = |(source, segment, begin, steps): (&'a Source<'a>, &'a Range<usize>, f64, usize)| {
        let count = (steps / length).max(1);
        let own = steps / count;
        (0..count).map(move |k| Stretch {
            source,
            segment,
            begin: begin + (k * own) as f64 * step,
            steps: own.min(LONGEST),
        })
    };
    pieces.into_iter().flat_map(cut).collect()
}

/// Motion and forces of a stretch: q, q̇, q̈ `[m, n]` at its samples, τ `[steps + 2 shifts, n]` on the grid.
struct Signals {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
    stride: usize,
}

impl Stretch<'_> {
    fn signals(&self, n: usize, step: f64, window: f64, shifts: usize) -> Signals {
        let r = self.source.recording;
        let window = (self.source.window as f64 * window) as usize | 1;
        let stride = self.steps.div_ceil(SAMPLES).max(1);
        let mut weights = Vec::new();
        let mut at = |time: f64, y: &[f64], order: usize, out: &mut Vec<f64>| {
            let k = r.t.partition_point(|t| *t < time).min(r.len() - 1);
            let window = around(
                k.clamp(self.segment.start, self.segment.end - 1),
                window,
                self.segment,
            );
            let filter = Filter { order, degree: 4 };
            filter.weights(&r.t[window.clone()], time, &mut weights);
            for coordinate in 0..n {
                let series = Series {
                    t: &r.t,
                    y,
                    n,
                    coordinate,
                };
                out.push(series.dot(window.start, &weights));
            }
        };
        let (mut q, mut qd, mut qdd, mut tau) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for k in (0..self.steps).step_by(stride) {
            let time = self.begin + k as f64 * step;
            at(time, &r.q, 0, &mut q);
            at(time, &r.q, 1, &mut qd);
            at(time, &r.q, 2, &mut qdd);
        }
        for k in 0..self.steps + 2 * shifts {
            let time = self.begin + (k as f64 - shifts as f64) * step;
            at(time, self.source.tau, 0, &mut tau);
        }
        Signals {
            q,
            qd,
            qdd,
            tau,
            stride,
        }
    }
}

/// One estimate for each joint, with a window that is `window` times the chosen one.
fn joints(
    sources: &[Source<'_>],
    coordinates: &Coordinates,
    step: f64,
    window: f64,
) -> Option<Vec<Option<Found>>> {
    let n = coordinates.dof();
    let shifts = ((FARTHEST / step).ceil() as usize).clamp(STEPS.0, STEPS.1);
    let stretches = stretches(sources, step, window, shifts);
    if stretches.len() < 6 {
        return None;
    }
    let signals: Vec<Signals> = stretches
        .par_iter()
        .map(|s| s.signals(n, step, window, shifts))
        .collect();
    let mean_square = |i: usize| {
        let speeds = signals.iter().flat_map(|s| s.qd.iter().skip(i).step_by(n));
        let (sum, count) = speeds.fold((0.0, 0.0), |(s, c), v| (s + v * v, c + 1.0));
        sum / count
    };
    let speeds: Vec<f64> = (0..n)
        .map(|i| f64::sqrt(mean_square(i)).max(f64::MIN_POSITIVE))
        .collect();
    let terms = Terms {
        coordinates,
        speeds: &speeds,
    };
    let joint = |i: usize| {
        let parts: Vec<Part> = signals
            .iter()
            .map(|s| Part::of(s, &terms, i, shifts))
            .collect();
        estimate(&parts, shifts, step)
    };
    Some((0..n).into_par_iter().map(joint).collect())
}

/// The terms of the regressor.
struct Terms<'a> {
    coordinates: &'a Coordinates,
    speeds: &'a [f64],
}

impl Terms<'_> {
    /// The row of joint `i` at one state; the first terms are those that q̈ᵢ multiplies, as many as the number
    /// returned.
    fn row(&self, i: usize, q: &[f64], qd: &[f64], qdd: &[f64], out: &mut Vec<f64>) -> usize {
        out.clear();
        let n = q.len();
        let near = |j: usize| n <= 2 || j.abs_diff(i) <= 1;
        let neighbours: Vec<usize> = (0..n).filter(|&j| near(j)).collect();
        let mut shapes = Vec::new();
        for &j in &neighbours {
            shapes.extend(self.shapes(j, q[j]));
            if j + 1 < n && near(j + 1) {
                shapes.extend([(q[j] - q[j + 1]).sin(), (q[j] - q[j + 1]).cos()]);
            }
        }
        out.push(qdd[i]);
        out.extend(shapes.iter().map(|s| s * qdd[i]));
        let own = out.len();
        out.extend((0..n).filter(|&j| j != i).map(|j| qdd[j]));
        for &j in neighbours.iter().filter(|&&j| j != i) {
            out.extend(shapes.iter().map(|s| s * qdd[j]));
        }
        for (k, &a) in neighbours.iter().enumerate() {
            for &b in &neighbours[k..] {
                out.extend(shapes.iter().map(|s| s * qd[a] * qd[b]));
            }
        }
        out.push(1.0);
        for &j in &neighbours {
            out.push(qd[j]);
            out.extend(FRICTION.map(|part| (qd[j] / (part * self.speeds[j])).tanh()));
        }
        for a in 0..n {
            out.extend(self.shapes(a, q[a]));
            let mut sum = q[a];
            for next in &q[a + 1..] {
                sum += next;
                out.extend([sum.sin(), sum.cos()]);
            }
        }
        own
    }

    /// Functions of one coordinate.
    fn shapes(&self, j: usize, q: f64) -> Vec<f64> {
        let mut shapes = vec![q.sin(), q.cos()];
        if !self.coordinates.is_circle(j) {
            shapes.push(q);
        }
        shapes
    }
}

/// What a stretch leaves behind.
struct Part {
    /// Rows.
    count: f64,
    /// Number of terms that q̈ᵢ multiplies.
    own: usize,
    /// `YᵀY`, `[P, P]`, its lower triangle.
    square: Vec<f64>,
    /// `Yᵀτ(t − δ)`, `[P, K]`.
    right: Vec<f64>,
    /// Sums of τ and τ², `[K]`.
    tau: Vec<(f64, f64)>,
    /// Sums of the factors of q̈ᵢ, `[own]`, and of the squares of q̈ᵢ.
    factors: Vec<f64>,
    acceleration: f64,
}

impl Part {
    fn of(s: &Signals, terms: &Terms<'_>, i: usize, shifts: usize) -> Self {
        let n = terms.speeds.len();
        let delays = 2 * shifts + 1;
        let mut row = Vec::new();
        let own = terms.row(i, &s.q[..n], &s.qd[..n], &s.qdd[..n], &mut row);
        let size = row.len();
        let mut part = Self {
            count: 0.0,
            own,
            square: vec![0.0; size * size],
            right: vec![0.0; size * delays],
            tau: vec![(0.0, 0.0); delays],
            factors: vec![0.0; own],
            acceleration: 0.0,
        };
        let mut forces = vec![0.0; delays];
        for m in 0..s.q.len() / n {
            let state = m * n..(m + 1) * n;
            let (q, qd, qdd) = (&s.q[state.clone()], &s.qd[state.clone()], &s.qdd[state]);
            terms.row(i, q, qd, qdd, &mut row);
            for (k, force) in forces.iter_mut().enumerate() {
                // A delay of k − shifts steps: the force so much earlier.
                *force = s.tau[(m * s.stride + 2 * shifts - k) * n + i];
            }
            part.add(&row, &forces);
            let mut ones = Vec::new();
            let unit: Vec<f64> = (0..n).map(|j| if j == i { 1.0 } else { 0.0 }).collect();
            terms.row(i, q, qd, &unit, &mut ones);
            part.factors
                .iter_mut()
                .zip(&ones)
                .for_each(|(f, x)| *f += x);
            part.acceleration += qdd[i] * qdd[i];
        }
        part
    }

    fn add(&mut self, row: &[f64], forces: &[f64]) {
        let (size, delays) = (row.len(), forces.len());
        for (k, x) in row.iter().enumerate() {
            let square = &mut self.square[k * size..k * size + k + 1];
            square.iter_mut().zip(row).for_each(|(s, y)| *s += x * y);
            let right = &mut self.right[k * delays..(k + 1) * delays];
            right.iter_mut().zip(forces).for_each(|(r, f)| *r += x * f);
        }
        for (sums, f) in self.tau.iter_mut().zip(forces) {
            sums.0 += f;
            sums.1 += f * f;
        }
        self.count += 1.0;
    }

    /// The same with another one added, or with `sign` −1 taken away.
    fn plus(&mut self, other: &Self, sign: f64) {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += sign * b);
        add(&mut self.square, &other.square);
        add(&mut self.right, &other.right);
        add(&mut self.factors, &other.factors);
        for (a, b) in self.tau.iter_mut().zip(&other.tau) {
            a.0 += sign * b.0;
            a.1 += sign * b.1;
        }
        self.count += sign * other.count;
        self.acceleration += sign * other.acceleration;
    }
}

/// The fit of some stretches together.
struct Solution {
    /// Delay in steps, and whether it stands at an end.
    delay: f64,
    at_end: bool,
    /// Unexplained parts of the variance at the best delay and at none.
    unexplained: (f64, f64),
    inertia: f64,
    share: f64,
}

fn estimate(parts: &[Part], shifts: usize, step: f64) -> Option<Found> {
    let mut all = Part {
        count: 0.0,
        own: parts.first()?.own,
        square: vec![0.0; parts[0].square.len()],
        right: vec![0.0; parts[0].right.len()],
        tau: vec![(0.0, 0.0); 2 * shifts + 1],
        factors: vec![0.0; parts[0].own],
        acceleration: 0.0,
    };
    parts.iter().for_each(|p| all.plus(p, 1.0));
    let whole = solve(&all, shifts)?;
    let without = |part: &Part| {
        all.plus(part, -1.0);
        let solution = solve(&all, shifts);
        all.plus(part, 1.0);
        solution.map(|s| (s.delay, s.inertia))
    };
    let left: Vec<(f64, f64)> = parts.iter().map(without).collect::<Option<_>>()?;
    let scatter = |of: fn(&(f64, f64)) -> f64| {
        let count = left.len() as f64;
        let mean = left.iter().map(of).sum::<f64>() / count;
        ((count - 1.0) / count * left.iter().map(|l| (of(l) - mean).powi(2)).sum::<f64>()).sqrt()
    };
    Some(Found {
        delay: whole.delay * step,
        error: scatter(|l| l.0) * step,
        at_end: whole.at_end,
        explained: (1.0 - whole.unexplained.0, 1.0 - whole.unexplained.1),
        inertia: (whole.inertia, scatter(|l| l.1)),
        growth: 0.0,
        share: whole.share,
    })
}

/// Least squares at every delay, and the vertex of the parabola through the best three.
fn solve(sums: &Part, shifts: usize) -> Option<Solution> {
    let delays = 2 * shifts + 1;
    let size = sums.right.len() / delays;
    let at = |k: usize, j: usize| sums.square[k.max(j) * size + k.min(j)];
    let scale: Vec<f64> = (0..size)
        .map(|k| Some(at(k, k).sqrt()).filter(|s| *s > 0.0).unwrap_or(1.0))
        .collect();
    let matrix = Mat::from_fn(size, size, |k, j| {
        let ridge = if k == j { RIDGE } else { 0.0 };
        at(k, j) / (scale[k] * scale[j]) + ridge
    });
    let right = Mat::from_fn(size, delays, |k, d| sums.right[k * delays + d] / scale[k]);
    let solved = matrix.llt(Side::Lower).ok()?.solve(&right);
    let unexplained: Vec<f64> = (0..delays)
        .map(|d| {
            let (sum, square) = sums.tau[d];
            let fitted: f64 = (0..size).map(|k| solved[(k, d)] * right[(k, d)]).sum();
            let variance = square - sum * sum / sums.count;
            ((square - fitted) / variance).max(f64::MIN_POSITIVE)
        })
        .collect();
    if unexplained.iter().any(|u| !u.is_finite()) {
        return None;
    }
    let best = (0..delays).min_by(|a, b| unexplained[*a].total_cmp(&unexplained[*b]))?;
    let at_end = best == 0 || best + 1 == delays;
    let vertex = if at_end {
        0.0
    } else {
        let [before, here, after] = [best - 1, best, best + 1].map(|d| unexplained[d].ln());
        let curvature = before - 2.0 * here + after;
        if curvature > 0.0 {
            (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    let inertia = (0..sums.own)
        .map(|k| solved[(k, best)] / scale[k] * sums.factors[k] / sums.count)
        .sum::<f64>();
    Some(Solution {
        delay: best as f64 - shifts as f64 + vertex,
        at_end,
        unexplained: (unexplained[best], unexplained[shifts]),
        inertia,
        share: inertia.abs() * (sums.acceleration / sums.tau[best].1).sqrt(),
    })
}
