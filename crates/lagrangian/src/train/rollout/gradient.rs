//! The gradient of a rollout loss by the weights, by back-propagation through the steps.

use lagrangian_motion::parallel::prelude::*;

use super::config::{RolloutLoss, SEGMENTS};
use super::flow::Flow;
use super::shoot::{Back, Block, Task};
use super::step::evaluations;
use crate::train::learner::Learner;
use crate::train::problem::LossValue;
use lagrangian_motion::solve::SymmetricSolver;
use nets::{Gradient, Packed};

/// The number of parts of a batch; more threads do not help.
const LANES: usize = 4;

/// The part of the step towards the best start of a segment that is taken.
const STRIDE: f64 = 0.5;

/// Damping of that step, in units of the weights.
const DAMPING: f64 = 0.1;

struct Lane {
    block: Block,
    gradient: Gradient<f64>,
    extra: Vec<f64>,
    weights: Vec<f64>,
    moves: Vec<(usize, f64)>,
    value: LossValue,
}

/// Values and gradients over batches of segments.
pub(super) struct Shooting {
    lanes: Vec<Lane>,
    packed: Packed<f64>,
}

/// The memory to which the derivatives of the loss are written.
pub(super) struct Derivatives<'a> {
    /// The gradient by the parameters, overwritten.
    pub(super) gradient: &'a mut [f64],
    /// The changes of free starts, with their places in `Task::starts`.
    pub(super) moves: &'a mut Vec<(usize, f64)>,
}

impl Shooting {
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss, segments: usize) -> Self {
        let lane = |_| Lane {
            block: Block::new(learner, config, false),
            gradient: Gradient::new(learner.net()),
            extra: vec![0.0; learner.extra() * learner.dof()],
            weights: Vec::new(),
            moves: Vec::new(),
            value: LossValue::default(),
        };
        let lanes = LANES.min(segments.div_ceil(SEGMENTS)).max(1);
        Self {
            lanes: (0..lanes).map(lane).collect(),
            packed: Packed::new(learner.net()),
        }
    }

    /// The loss on the segments that start at `begins`, and its derivatives.
    pub(super) fn evaluate(
        &mut self,
        learner: &dyn Learner<f64>,
        parameters: &[f64],
        (task, begins): (&Task<'_>, &[usize]),
        derivatives: Option<Derivatives<'_>>,
    ) -> LossValue {
        let net = learner.net();
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        let (packed, lanes) = (&self.packed, self.lanes.len());
        let factor = derivatives
            .is_some()
            .then(|| 1.0 / (begins.len() * task.rows.count()).max(1) as f64);
        self.lanes.par_iter_mut().enumerate().for_each(|(l, lane)| {
            lane.value = LossValue::default();
            lane.gradient.clear();
            lane.extra.fill(0.0);
            lane.moves.clear();
            let flow = Flow {
                learner,
                packed,
                extra,
                sizes: lane.block.sizes,
            };
            for begins in begins.chunks(SEGMENTS).skip(l).step_by(lanes) {
                lane.block.shoot(&flow, task, begins);
                lane.value = lane.value + lane.block.value();
                if let Some(factor) = factor {
                    lane.descend(&flow, task, factor);
                }
            }
        });
        if let Some(Derivatives { gradient, moves }) = derivatives {
            gradient.fill(0.0);
            moves.clear();
            if let Some((first, rest)) = self.lanes.split_first_mut() {
                rest.iter()
                    .for_each(|lane| first.gradient.add(&lane.gradient));
                first.gradient.add_to(net, gradient);
            }
            for lane in &self.lanes {
                let pairs = gradient[net.parameters..].iter_mut().zip(&lane.extra);
                pairs.for_each(|(g, x)| *g += x);
                moves.extend(&lane.moves);
            }
        }
        self.lanes
            .iter()
            .fold(LossValue::default(), |sum, lane| sum + lane.value)
    }
}

impl Lane {
    fn descend(&mut self, flow: &Flow<'_>, task: &Task<'_>, factor: f64) {
        if !task.starts.is_empty() {
            self.block.back(task, Back::Each);
            self.move_starts(task);
        }
        let residuals = self.block.residual.iter();
        self.weights.clear();
        self.weights.extend(residuals.map(|r| 2.0 * factor * r));
        self.block.back(task, Back::Sum(&self.weights));
        self.pull_back(flow, task);
    }

    /// Moves each start towards the one that fits the weights best, by a damped Gauss–Newton step.
    fn move_starts(&mut self, task: &Task<'_>) {
        let (rows, d) = (task.rows.count(), task.weights.len());
        let mut solver = SymmetricSolver::new(d);
        let (mut square, mut right, mut step) = (vec![0.0; d * d], vec![0.0; d], vec![0.0; d]);
        let block = &self.block;
        for s in (0..block.count).filter(|s| !block.is_silent(*s)) {
            square.fill(0.0);
            right.fill(0.0);
            for row in 0..rows {
                let slopes = &block.sensitivities.to_start[(s * rows + row) * d..][..d];
                for i in 0..d {
                    let slope = slopes[i] / task.weights[i];
                    right[i] -= slope * block.residual[s * rows + row];
                    for j in 0..d {
                        square[i * d + j] += slope * slopes[j] / task.weights[j];
                    }
                }
            }
            (0..d).for_each(|i| square[i * d + i] += DAMPING);
            let _ = solver.solve(&square, &right, &mut step);
            for (c, step) in step.iter().enumerate() {
                let place = block.begins[s] * d + c;
                self.moves.push((place, STRIDE * step / task.weights[c]));
            }
        }
    }

    /// Carries the sensitivities to the rates at every evaluation to the weights; passes are computed anew.
    fn pull_back(&mut self, flow: &Flow<'_>, task: &Task<'_>) {
        let sizes = self.block.sizes;
        let d = sizes.state();
        let total = task.config.evaluations(task.rows.horizon);
        let each = evaluations(task.config.integrator);
        let mut rate = vec![0.0; sizes.samples * d];
        for e in 0..total {
            self.block.hold(task, e / each);
            let block = &mut self.block;
            let work = &mut block.works[0];
            let x = &block.points[e].x;
            flow.rate(work, x, &block.tau, &mut rate, &mut block.failed);
            let direct = &block.sensitivities.direct;
            let of = |s: usize| &direct[(s * total + e) * d..][..d];
            flow.weigh(work, of, &block.failed);
            let lambda = &work.adjoint.lambda;
            work.linear
                .pull_forces(flow.learner, lambda, &mut self.extra);
            flow.learner
                .pull_back(flow.packed, work, &mut self.gradient);
        }
    }
}
