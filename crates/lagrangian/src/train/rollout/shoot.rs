//! A block of segments: forward over the horizon, and backwards to every evaluation and to the start.

use super::config::{RolloutLoss, SEGMENTS};
use super::flow::{Flow, Point, Sizes};
use super::segments::{Recorded, Rows};
use super::step::{Span, StepContext, back, evaluations, step};
use crate::train::learner::{Learner, Work};
use crate::train::problem::LossValue;

/// The largest error, in units of a system at rest, of a rollout that has not failed.
const FAR: f64 = 1e3;

/// The part of a batch that all its blocks share.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) recorded: Recorded<'a>,
    pub(super) config: &'a RolloutLoss,
    /// The weights of the components of a state, `[2n]`.
    pub(super) weights: &'a [f64],
    /// Learned states of all samples, `[samples, 2n]`; empty where segments start at the recorded ones.
    pub(super) starts: &'a [f64],
    pub(super) rows: &'a Rows,
}

/// A block of segments.
pub(super) struct Block {
    pub(super) sizes: Sizes,
    /// The memory of each evaluation, or one for all.
    pub(super) works: Vec<Work<f64>>,
    /// The state and the Jacobians of each evaluation.
    pub(super) points: Vec<Point>,
    /// The number of segments; the rest of the block repeats the first.
    pub(super) count: usize,
    /// The sample at which each segment starts.
    pub(super) begins: Vec<usize>,
    /// x at the boundaries of the steps, `[steps + 1][samples, 2n]`.
    pub(super) states: Vec<Vec<f64>>,
    /// h of each step and segment, `[steps][samples]`.
    pub(super) h: Vec<Vec<f64>>,
    /// The τ that is held, `[samples, n]`.
    pub(super) tau: Vec<f64>,
    /// Whether the rollout of each segment has failed.
    pub(super) failed: Vec<bool>,
    /// r, `[samples, rows]`.
    pub(super) residual: Vec<f64>,
    pub(super) sensitivities: Sensitivities,
}

/// The sensitivities of each residual of a block, or of one weighted sum of them.
#[derive(Default)]
pub(super) struct Sensitivities {
    /// The sensitivity to the rates at every evaluation, `[samples, rows, evaluations, 2n]`.
    pub(super) direct: Vec<f64>,
    /// The sensitivity to the start of the segment, `[samples, rows, 2n]`.
    pub(super) to_start: Vec<f64>,
    /// The sensitivity to the state of one segment, `[rows, 2n]`, while it is propagated backwards.
    lambda: Vec<f64>,
}

/// The quantity that is propagated backwards.
#[derive(Clone, Copy)]
pub(super) enum Back<'a> {
    /// Each residual.
    Each,
    /// The sum of the residuals with these weights, `[samples, rows]`.
    Sum(&'a [f64]),
}

impl Block {
    /// A block for the whole horizon; `keep` gives each evaluation a memory of its own.
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss, keep: bool) -> Self {
        let sizes = Sizes::of(learner, SEGMENTS);
        let (m, d) = (sizes.samples, sizes.state());
        let count = config.evaluations(config.horizon);
        let implicit = evaluations(config.integrator) < 4;
        let works = if keep { count } else { 1 };
        let steps = config.horizon * config.substeps;
        Self {
            sizes,
            works: (0..works).map(|_| Work::new(learner, m)).collect(),
            points: (0..count).map(|_| Point::new(&sizes, implicit)).collect(),
            count: 0,
            begins: vec![0; m],
            states: vec![vec![0.0; m * d]; steps + 1],
            h: vec![vec![0.0; m]; steps],
            tau: vec![0.0; m * sizes.n],
            failed: vec![false; m],
            residual: Vec::new(),
            sensitivities: Sensitivities::default(),
        }
    }

    /// Predicts the segments that start at the samples `begins`, and their residuals.
    pub(super) fn shoot(&mut self, flow: &Flow<'_>, task: &Task<'_>, begins: &[usize]) {
        self.count = begins.len();
        for (s, begin) in self.begins.iter_mut().enumerate() {
            *begin = begins[if s < begins.len() { s } else { 0 }];
        }
        self.failed.fill(false);
        let d = self.sizes.state();
        for (at, x) in self.states[0].iter_mut().enumerate() {
            let i = self.begins[at / d];
            *x = match task.starts.is_empty() {
                true => task.recorded.state(i, at % d),
                false => task.starts[i * d + at % d],
            };
        }
        let substeps = task.config.substeps;
        for number in 0..task.rows.horizon * substeps {
            self.hold(task, number);
            self.step(flow, task.config, number);
        }
        self.compare(task);
    }

    /// h and τ of step `number`: τ is held from one sample to the next.
    pub(super) fn hold(&mut self, task: &Task<'_>, number: usize) {
        let (n, substeps, t) = (self.sizes.n, task.config.substeps, &task.recorded.times.t);
        for (s, &begin) in self.begins.iter().enumerate() {
            let i = begin + number / substeps;
            self.h[number][s] = (t[i + 1] - t[i]) / substeps as f64;
            self.tau[s * n..][..n].copy_from_slice(&task.recorded.samples.tau[i * n..][..n]);
        }
    }

    fn step(&mut self, flow: &Flow<'_>, config: &RolloutLoss, number: usize) {
        let each = evaluations(config.integrator);
        let (before, after) = self.states.split_at_mut(number + 1);
        let x = &mut after[0];
        x.copy_from_slice(&before[number]);
        let span = Span {
            h: &self.h[number],
            tau: &self.tau,
            first: number * each,
        };
        let moving = StepContext {
            flow,
            works: &mut self.works,
            points: &mut self.points[number * each..][..each],
            span,
            x: &mut *x,
            failed: &mut self.failed,
        };
        step(config.integrator, moving);
        // A failed rollout stays at its start.
        let d = self.sizes.state();
        for s in (0..self.failed.len()).filter(|s| self.failed[*s]) {
            x[s * d..][..d].copy_from_slice(&before[0][s * d..][..d]);
        }
    }

    fn compare(&mut self, task: &Task<'_>) {
        let (rows, d, recorded) = (task.rows, self.sizes.state(), task.recorded);
        let (count, substeps) = (rows.count(), task.config.substeps);
        self.residual.resize(self.sizes.samples * count, 0.0);
        for (s, residual) in self.residual.chunks_exact_mut(count).enumerate() {
            for j in usize::from(!rows.start)..=rows.horizon {
                let x = &self.states[j * substeps][s * d..][..d];
                for c in 0..rows.seen {
                    let seen = recorded.state(self.begins[s] + j, c);
                    residual[rows.first(j) + c] =
                        task.weights[c] * recorded.difference(c, x[c], seen);
                }
            }
            self.failed[s] |= residual.iter().any(|r| r.is_nan() || r.abs() > FAR);
            if self.failed[s] || s >= self.count {
                residual.fill(0.0);
            }
        }
    }

    /// Whether segment `s` has no weight.
    pub(super) fn is_silent(&self, s: usize) -> bool {
        self.failed[s] || s >= self.count
    }

    /// The loss of the segments that count.
    pub(super) fn value(&self) -> LossValue {
        let rows = self.residual.len() / self.sizes.samples;
        let failed = self.failed[..self.count].iter().filter(|f| **f).count();
        LossValue {
            sum: self.residual.iter().map(|r| r * r).sum(),
            count: (self.count - failed) * rows,
            singular: failed,
        }
    }

    /// Back-propagation through the steps.
    pub(super) fn back(&mut self, task: &Task<'_>, what: Back<'_>) {
        let (rows, d) = (task.rows, self.sizes.state());
        let out = match what {
            Back::Each => rows.count(),
            Back::Sum(_) => 1,
        };
        let total = task.config.evaluations(rows.horizon);
        let samples = self.sizes.samples;
        let Sensitivities {
            direct, to_start, ..
        } = &mut self.sensitivities;
        direct.clear();
        direct.resize(samples * out * total * d, 0.0);
        to_start.clear();
        to_start.resize(samples * out * d, 0.0);
        for s in 0..self.count {
            if !self.failed[s] {
                self.back_of(task, what, s);
            }
        }
    }

    /// Back-propagation for segment `s`.
    fn back_of(&mut self, task: &Task<'_>, what: Back<'_>, s: usize) {
        let (rows, d, config) = (task.rows, self.sizes.state(), task.config);
        let each = evaluations(config.integrator);
        let total = config.evaluations(rows.horizon);
        let out = self.sensitivities.to_start.len() / (self.sizes.samples * d);
        let mut lambda = std::mem::take(&mut self.sensitivities.lambda);
        lambda.clear();
        lambda.resize(out * d, 0.0);
        for number in (0..rows.horizon * config.substeps).rev() {
            if (number + 1).is_multiple_of(config.substeps) {
                seed(task, what, s, (number + 1) / config.substeps, &mut lambda);
            }
            let first = match what {
                Back::Each => rows.first(number / config.substeps + 1),
                Back::Sum(_) => 0,
            };
            let points = &self.points[number * each..][..each];
            for row in first..out {
                let at = ((s * out + row) * total + number * each) * d;
                let direct = &mut self.sensitivities.direct[at..at + each * d];
                let lambda = &mut lambda[row * d..][..d];
                back(
                    config.integrator,
                    points,
                    (s, self.h[number][s]),
                    lambda,
                    direct,
                );
            }
        }
        if rows.start {
            seed(task, what, s, 0, &mut lambda);
        }
        self.sensitivities.to_start[s * out * d..][..out * d].copy_from_slice(&lambda);
        self.sensitivities.lambda = lambda;
    }
}

/// Adds the slopes of the residuals of sample `j` of segment `s` to λ.
fn seed(task: &Task<'_>, what: Back<'_>, s: usize, j: usize, lambda: &mut [f64]) {
    let (rows, d) = (task.rows, task.weights.len());
    let mut add = |row: usize, c: usize, weight: f64| match what {
        Back::Each => lambda[row * d + c] += weight,
        Back::Sum(sum) => lambda[c] += weight * sum[s * rows.count() + row],
    };
    for c in 0..rows.seen {
        add(rows.first(j) + c, c, task.weights[c]);
    }
}
