//! Masses and coefficients of forces by simulations of many segments, whose starts are free among the states that keep the constraints.
//!
//! Gauss–Newton with Marquardt's damping; the starts are eliminated as in [`crate::train::shooting`].

use faer::Mat;
use lagrangian_motion::parallel::prelude::*;

use super::system::{Layout, System, directions, inverse};
use crate::dataset::Timeline;
use crate::train::shooting::{BestStart, eliminate};
use lagrangian_mechanics::constrained::Joints;
use lagrangian_motion::Samples;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::median_size;

/// The largest number of steps, and of dampings that are tried in each.
const STEPS: usize = 30;
const TRIES: usize = 9;
/// The number of segments whose equations are held at a time.
const HELD: usize = 128;
/// A descent ends when a step lowers the cost by less than this part.
const ENOUGH: f64 = 1e-4;
/// Steps of starts alone.
const SETTLED: usize = 4;
/// The errors of steps in parts of the noise, and at least in parts of the motion.
const FINE: f64 = 1e-4;
const EXACT: f64 = 1e-10;
/// Halved steps go on while they lower the error to this part.
const HELPS: f64 = 0.5;

/// Recorded motions.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub(super) samples: &'a Samples,
    pub(super) times: &'a Timeline,
    /// Whether velocities are compared as well.
    pub(super) velocities: bool,
}

/// A part of a motion, and the state that it is simulated from.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    begin: usize,
    pub(super) len: usize,
    start: Vec<f64>,
    /// The recorded state, of which the start was a correction at first.
    recorded: Vec<f64>,
    /// The longest step, s.
    step: f64,
}

/// The simulations that are compared with the data.
pub(super) struct Problem<'a> {
    pub(super) layout: &'a Layout,
    pub(super) data: Data<'a>,
    /// The noise of each value that is compared.
    pub(super) noise: Vec<f64>,
}

/// The equations of all segments without their starts.
pub(super) struct Normal {
    pub(super) sums: Quadratic,
    starts: Vec<(BestStart, Vec<Vec<f64>>)>,
}

impl Data<'_> {
    /// The measured value `c` of sample `s`.
    pub(super) fn measured(&self, s: usize, c: usize) -> f64 {
        let n = self.samples.n;
        let (signal, c) = (c / n, c % n);
        let measured = &self.times.measured[signal];
        let own = [&self.samples.q, &self.samples.qd][signal];
        (if measured.is_empty() { own } else { measured })[s * n + c]
    }

    /// The states of all samples, `[m, 2 n]`.
    pub(super) fn states(&self) -> Vec<f64> {
        let row = |s: usize| self.samples.row(s);
        let all = (0..self.samples.len()).flat_map(|s| [row(s).q, row(s).qd].concat());
        all.collect()
    }
}

impl Problem<'_> {
    /// Cuts the motions into segments of at most this many samples, and omits some evenly where there are more than `most` samples.
    pub(super) fn segments(&self, horizon: usize, most: usize, states: &[f64]) -> Vec<Segment> {
        let n = self.layout.n;
        let unit = inverse(&vec![1.0; n]);
        let mut joints = Joints::new(n, self.layout.constraints.len());
        let mut all = Vec::new();
        for run in self.data.times.runs() {
            let parts = run.len().div_ceil(horizon).max(1);
            for part in 0..parts {
                let begin = run.start + run.len() * part / parts;
                let len = run.start + run.len() * (part + 1) / parts - begin;
                let mut start = states[begin * 2 * n..][..2 * n].to_vec();
                joints.project(&self.layout.constraints, &unit, &mut start);
                if len > 1 && len * self.noise.len() > 2 * n && start.iter().all(|x| x.is_finite())
                {
                    let times = &self.data.times.t[begin..begin + len];
                    let step = median_size(&mut times.windows(2).map(|t| t[1] - t[0]));
                    all.push(Segment {
                        begin,
                        len,
                        recorded: start.clone(),
                        start,
                        step,
                    });
                }
            }
        }
        let samples: usize = all.iter().map(|own| own.len).sum();
        let every = samples.div_ceil(most).max(1);
        all.into_iter().step_by(every).collect()
    }

    /// Simulates a segment from these rows, and passes the rows of each sample to `visit`.
    fn follow(
        &self,
        system: &mut System<'_>,
        segment: &Segment,
        mut rows: Vec<f64>,
        mut visit: impl FnMut(usize, &[f64]),
    ) {
        let (n, samples) = (self.layout.n, self.data.samples);
        for k in 0..segment.len {
            visit(k, &rows);
            if k + 1 < segment.len {
                let s = segment.begin + k;
                let interval = self.data.times.t[s + 1] - self.data.times.t[s];
                let parts = (interval / segment.step - 1e-9).ceil().clamp(1.0, 1e4);
                for _ in 0..parts as usize {
                    system.step(&mut rows, interval / parts, &samples.tau[s * n..][..n]);
                }
            }
        }
    }

    /// The residuals of a segment, in units of the noise.
    pub(super) fn residuals(&self, theta: &[f64], segment: &Segment) -> Vec<f64> {
        let mut system = System::new(self.layout, theta, &[]);
        let mut residuals = Vec::with_capacity(segment.len * self.noise.len());
        self.follow(&mut system, segment, segment.start.clone(), |k, rows| {
            let errors = self.noise.iter().enumerate();
            residuals
                .extend(errors.map(|(c, noise)| {
                    (rows[c] - self.data.measured(segment.begin + k, c)) / noise
                }));
        });
        residuals
    }

    /// The sum of the squares of all residuals; ∞ where a simulation fails.
    pub(super) fn cost(&self, theta: &[f64], segments: &[Segment]) -> f64 {
        let square = |own: &Segment| self.square(theta, own);
        let each: Vec<f64> = segments.par_iter().map(square).collect();
        each.iter().sum()
    }

    /// The sum of the squares of the residuals of a segment; ∞ where its simulation fails.
    pub(super) fn square(&self, theta: &[f64], segment: &Segment) -> f64 {
        let residuals = self.residuals(theta, segment);
        let sum = dot(&residuals, &residuals);
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// The normal equations of all parameters; `None` where a simulation fails.
    pub(super) fn normal(&self, theta: &[f64], segments: &[Segment]) -> Option<Normal> {
        let (n, count) = (self.layout.n, self.layout.len());
        let along: Vec<usize> = (0..count).collect();
        let part = |segment: &Segment| {
            let free = directions(self.layout, &segment.start);
            let columns = count + free.len();
            let mut system = System::new(self.layout, theta, &along);
            let zeros = vec![0.0; count * 2 * n];
            let begin = [&segment.start[..], &zeros, &free.concat()].concat();
            let (mut jacobian, mut residuals) = (Vec::new(), Vec::new());
            self.follow(&mut system, segment, begin, |k, rows| {
                for (c, noise) in self.noise.iter().enumerate() {
                    let measured = self.data.measured(segment.begin + k, c);
                    residuals.push((rows[c] - measured) / noise);
                    let slopes = (1..=columns).map(|row| rows[row * 2 * n + c] / noise);
                    jacobian.extend(slopes);
                }
            });
            if !jacobian.iter().chain(&residuals).all(|x| x.is_finite()) {
                return None;
            }
            let reduced = eliminate(jacobian, residuals, count, free.len());
            let mut sums = Quadratic::zero(count);
            let rows = reduced.rows.chunks_exact(columns);
            for (row, r) in rows.zip(&reduced.residual) {
                sums.add_row(&row[..count], *r);
            }
            Some((sums, (reduced.start, free)))
        };
        let mut normal = Normal {
            sums: Quadratic::zero(count),
            starts: Vec::with_capacity(segments.len()),
        };
        for some in segments.chunks(HELD) {
            let parts: Vec<Option<_>> = some.par_iter().map(part).collect();
            for part in parts {
                let (sums, start) = part?;
                normal.sums.add(&sums, 1.0);
                normal.starts.push(start);
            }
        }
        Some(normal)
    }

    /// Returns the starts that became worse than the recorded states to these, as those of another minimum.
    pub(super) fn restart(&self, theta: &[f64], segments: &mut [Segment]) {
        segments.par_iter_mut().for_each(|own| {
            let fresh = Segment {
                start: own.recorded.clone(),
                ..own.clone()
            };
            let [now, again] = [&*own, &fresh].map(|own| self.square(theta, own));
            if again < now || !now.is_finite() {
                *own = fresh;
            }
        });
    }

    /// Lowers the cost until it changes little, or `go_on` is false; returns it.
    pub(super) fn descend(
        &self,
        theta: &mut Vec<f64>,
        segments: &mut Vec<Segment>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> f64 {
        let mut cost = self.cost(theta, segments);
        let mut damping = 1e-6;
        for _ in 0..STEPS {
            if !go_on() {
                break;
            }
            let Some(normal) = self.normal(theta, segments) else {
                break;
            };
            let before = cost;
            for attempt in 0..TRIES {
                let part = 0.5_f64.powi((attempt as i32 - 3).max(0));
                if let Some((next, moved)) = self.moved((theta, segments), &normal, damping, part) {
                    let found = self.cost(&next, &moved);
                    if found < cost {
                        (*theta, *segments, cost) = (next, moved, found);
                        damping = f64::max(damping / 10.0, 1e-12);
                        break;
                    }
                }
                damping *= 10.0;
            }
            if before - cost <= ENOUGH * before {
                break;
            }
        }
        cost
    }

    /// Parameters and starts after a part of a damped step; `None` for a mass matrix that is not positive definite.
    fn moved(
        &self,
        (theta, segments): (&[f64], &[Segment]),
        normal: &Normal,
        damping: f64,
        part: f64,
    ) -> Option<(Vec<f64>, Vec<Segment>)> {
        let free = self.layout.free();
        let sums = &normal.sums;
        let entry = |i: usize, j: usize| sums.row(free[i])[free[j]];
        let least = (0..free.len()).map(|i| entry(i, i)).fold(1e-300, f64::max) * 1e-20;
        let scale = scales(free.len(), |i| entry(i, i), least);
        let step = Ridge::new(entry, scale, damping)?.solve_one(|i| -sums.right[free[i]])?;
        let mut delta = vec![0.0; theta.len()];
        free.iter()
            .zip(step)
            .for_each(|(k, by)| delta[*k] = part * by);
        let next: Vec<f64> = theta.iter().zip(&delta).map(|(x, by)| x + by).collect();
        self.layout.inverse(&next)?;
        // The best change of a start is that for the whole change of the parameters.
        let whole: Vec<f64> = delta.iter().map(|by| by / part).collect();
        Some((next, self.restarted(segments, normal, &whole, part)))
    }

    /// The segments from a part of the best change of their starts for this change of the parameters.
    fn restarted(
        &self,
        segments: &[Segment],
        normal: &Normal,
        whole: &[f64],
        part: f64,
    ) -> Vec<Segment> {
        let n = self.layout.n;
        let unit = inverse(&vec![1.0; n]);
        let pairs = segments.par_iter().zip(&normal.starts);
        let moved = pairs.map(|(segment, (best, free))| {
            let mut own = segment.clone();
            for (direction, by) in free.iter().zip(best.change(whole)) {
                let each = own.start.iter_mut().zip(direction);
                each.for_each(|(x, d)| *x += part * by * d);
            }
            let mut joints = Joints::new(n, self.layout.constraints.len());
            joints.project(&self.layout.constraints, &unit, &mut own.start);
            own
        });
        moved.collect()
    }

    /// Moves the starts alone, in a few steps, to where the cost of each segment is least.
    pub(super) fn settle(&self, theta: &[f64], segments: &mut [Segment]) {
        for _ in 0..SETTLED {
            let Some(normal) = self.normal(theta, segments) else {
                return;
            };
            let moved = self.restarted(segments, &normal, &vec![0.0; theta.len()], 1.0);
            segments.par_iter_mut().zip(moved).for_each(|(own, moved)| {
                if self.square(theta, &moved) < self.square(theta, own) {
                    *own = moved;
                }
            });
        }
    }

    /// Writes the simulated states of all samples of the segments to `states`, `[m, 2 n]`.
    pub(super) fn write_states(&self, theta: &[f64], segments: &[Segment], states: &mut [f64]) {
        let n = self.layout.n;
        for segment in segments {
            let mut system = System::new(self.layout, theta, &[]);
            self.follow(&mut system, segment, segment.start.clone(), |k, rows| {
                states[(segment.begin + k) * 2 * n..][..2 * n].copy_from_slice(rows);
            });
        }
    }

    /// The noise of each value by the residuals, at least a tiny part of `unit`.
    pub(super) fn noise_of(&self, theta: &[f64], segments: &[Segment], unit: &[f64]) -> Vec<f64> {
        let mut squares = vec![0.0; self.noise.len()];
        let mut count = 0.0;
        for segment in segments {
            let residuals = self.residuals(theta, segment);
            for sample in residuals.chunks_exact(self.noise.len()) {
                count += 1.0;
                let each = squares.iter_mut().zip(sample);
                each.for_each(|(sum, r)| *sum += r * r);
            }
        }
        let share = self.expected(segments) / (count * self.noise.len() as f64);
        let all = squares.iter().zip(&self.noise).zip(unit);
        let own = all.map(|((sum, noise), unit)| {
            let own = noise * (sum / (count * share).max(1.0)).sqrt();
            own.max(1e-9 * unit)
        });
        own.collect()
    }

    /// The expectation of the cost: the number of residuals less that of free starts and parameters.
    pub(super) fn expected(&self, segments: &[Segment]) -> f64 {
        let residuals: usize = segments.iter().map(|own| own.len * self.noise.len()).sum();
        let starts = segments
            .first()
            .map_or(0, |own| directions(self.layout, &own.start).len());
        let free = segments.len() * starts + self.layout.free().len();
        (residuals as f64 - free as f64).max(1.0)
    }

    /// Halves the steps of each segment until they are exact beside the noise, at most so often.
    pub(super) fn resolve(
        &self,
        theta: &[f64],
        segments: &mut [Segment],
        unit: &[f64],
        halvings: usize,
    ) {
        let bound = self.noise.iter().zip(unit);
        let bound = bound.map(|(noise, unit)| (EXACT * unit / noise).max(FINE));
        let bound = bound.fold(FINE, f64::max);
        segments.par_iter_mut().for_each(|own| {
            let (mut last, mut worst) = (self.residuals(theta, own), f64::INFINITY);
            for _ in 0..halvings {
                own.step *= 0.5;
                let finer = self.residuals(theta, own);
                let pairs = last.iter().zip(&finer);
                let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // What finer steps do not mend is no error of the steps.
                if error <= bound || error > HELPS * worst {
                    own.step *= 2.0;
                    break;
                }
                (last, worst) = (finer, error);
            }
        });
    }
}

impl Normal {
    /// The information `JᵀJ` of all parameters, and the slope Jᵀr.
    pub(super) fn information(&self) -> (Mat<f64>, Vec<f64>) {
        let count = self.sums.size();
        let matrix = Mat::from_fn(count, count, |i, j| self.sums.row(i)[j]);
        (matrix, self.sums.right.clone())
    }
}
