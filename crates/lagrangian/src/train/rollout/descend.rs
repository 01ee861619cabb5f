//! The rollout loss as problems for a run: the segments of each step, and their residuals or gradient.

use super::config::{RolloutLoss, SEGMENTS, Start};
use super::gauss_newton::{GaussNewton, RolloutProblem, Segments};
use super::gradient::{Derivatives, Shooting};
use super::segments::{Recorded, Rows};
use super::shoot::Task;
use crate::dataset::{Dataset, Momenta};
use crate::train::adam::Adam;
use crate::train::checkpoint::Checkpoint;
use crate::train::engine::Problems;
use crate::train::learner::Learner;
use crate::train::order::Order;
use crate::train::problem::{Differentiable, GradientSize, LeastSquares, LossValue, StepAt};
use crate::train::{Optimizer, TrainingTask};
use nets::simd::AdamRule;

/// The largest number of segments of a validation.
const VALIDATED: usize = 128;

/// The segments of each step, and their horizon.
pub(crate) struct SegmentOrder<'a> {
    config: &'a RolloutLoss,
    optimizer: &'a Optimizer,
    train: Recorded<'a>,
    weights: Vec<f64>,
    /// The number of samples of a batch.
    batch: usize,
    seed: u64,
    /// The horizon of the segments below.
    horizon: usize,
    /// The samples at which segments of this horizon start, and the order in which they are visited.
    begins: Vec<usize>,
    order: Order,
}

impl<'a> SegmentOrder<'a> {
    pub(crate) fn new(
        dataset: &'a Dataset,
        momenta: Option<&'a Momenta>,
        config: &'a TrainingTask,
    ) -> Self {
        let train = Recorded::train(dataset, momenta);
        Self {
            weights: train.weights(config.rollout.horizon),
            config: &config.rollout,
            optimizer: &config.optimizer,
            train,
            batch: config.batch,
            seed: config.seed,
            horizon: 0,
            begins: Vec::new(),
            order: Order::new(0, config.seed),
        }
    }

    /// The parameters after those of the model: the recorded states, where starts are free.
    pub(crate) fn free_starts(&self) -> Vec<f64> {
        match self.config.start {
            Start::Recorded => Vec::new(),
            Start::Free => {
                let d = self.weights.len();
                let states = (0..self.train.samples.len() * d).map(|at| (at / d, at % d));
                states.map(|(i, c)| self.train.state(i, c)).collect()
            }
        }
    }

    /// The segments of a step at this part of the budget of rollouts.
    fn next(&mut self, step: usize, part: f64) -> Segments<'_> {
        let horizon = self.horizon(part);
        let begins = self.begins(horizon, step);
        Segments {
            recorded: self.train,
            config: self.config,
            weights: &self.weights,
            rows: Rows::new(self.config, horizon, self.train.samples.n),
            begins,
        }
    }

    /// The horizon at this part of the budget of rollouts.
    fn horizon(&self, part: f64) -> usize {
        if self.config.growth <= 0.0 || part >= self.config.growth {
            return self.config.horizon;
        }
        let grown = (self.config.horizon as f64 * part.max(0.0) / self.config.growth).ceil();
        (grown as usize).clamp(1, self.config.horizon)
    }

    /// The samples at which the segments of a step start.
    fn begins(&mut self, horizon: usize, step: usize) -> Vec<usize> {
        if self.horizon != horizon {
            let stride = match self.config.start {
                Start::Recorded => 1,
                Start::Free => horizon,
            };
            self.horizon = horizon;
            self.begins = self.train.starts(horizon, stride);
            let seed = self.seed.wrapping_add(horizon as u64);
            self.order = Order::new(self.begins.len(), seed);
        }
        let count = self.count(horizon).min(self.begins.len());
        let indices = self.order.batch(step, count);
        indices.iter().map(|k| self.begins[*k]).collect()
    }

    /// The number of segments of a batch. Under Adam they have as many samples as a batch, under the natural gradient twice as many
    /// evaluations, since its cost grows with the square of their number.
    fn count(&self, horizon: usize) -> usize {
        let each = match self.optimizer {
            Optimizer::Natural(_) => self.config.evaluations(horizon).div_ceil(2),
            Optimizer::Adam(_) => horizon,
        };
        (self.batch / each.max(1))
            .next_multiple_of(SEGMENTS)
            .max(SEGMENTS)
    }

    /// The largest number of segments of a batch.
    fn most(&self) -> usize {
        self.count(self.config.horizon.min(1))
    }
}

/// The problems of a fit under the rollout loss, a batch of segments each.
pub(crate) struct RolloutProblems<'a> {
    order: SegmentOrder<'a>,
    memory: GaussNewton,
    flow: &'a dyn Learner<f64>,
}

impl<'a> RolloutProblems<'a> {
    pub(crate) fn new(order: SegmentOrder<'a>, flow: &'a dyn Learner<f64>) -> Self {
        let segments = match order.config.growth > 0.0 {
            true => order.most(),
            false => order.count(order.config.horizon),
        };
        Self {
            memory: GaussNewton::new(flow, order.config, segments),
            order,
            flow,
        }
    }
}

impl Problems for RolloutProblems<'_> {
    fn parameters(&self) -> usize {
        self.flow.parameters()
    }

    fn at<'p>(&'p mut self, at: &StepAt<'p>) -> Box<dyn LeastSquares + 'p> {
        Box::new(RolloutProblem {
            memory: &mut self.memory,
            learner: self.flow,
            segments: self.order.next(at.step, at.part),
            terms: self.flow.terms(),
        })
    }

    fn unit(&self, _loss: LossValue) -> f64 {
        1.0
    }
}

/// The rollout loss for a descent. Free starts have no moments: they move when a gradient is evaluated.
pub(crate) struct RolloutDescent<'a> {
    order: SegmentOrder<'a>,
    shooting: Shooting,
    flow: &'a dyn Learner<f64>,
    parameters: Vec<f64>,
    starts: Vec<f64>,
    gradient: Vec<f64>,
    moments: Adam,
}

impl<'a> RolloutDescent<'a> {
    pub(crate) fn new(order: SegmentOrder<'a>, flow: &'a dyn Learner<f64>) -> Self {
        let count = flow.parameters();
        Self {
            shooting: Shooting::new(flow, order.config, order.most()),
            order,
            flow,
            parameters: vec![0.0; count],
            starts: Vec::new(),
            gradient: vec![0.0; count],
            moments: Adam::zeros(count),
        }
    }
}

impl Differentiable for RolloutDescent<'_> {
    fn load(&mut self, state: &Checkpoint) {
        let (parameters, starts) = state.parameters.split_at(self.parameters.len());
        self.parameters.copy_from_slice(parameters);
        self.starts = starts.to_vec();
        if let [first, second] = &state.memory[..] {
            let count = parameters.len();
            self.moments.first.copy_from_slice(&first[..count]);
            self.moments.second.copy_from_slice(&second[..count]);
        }
    }

    fn save(&self, state: &mut Checkpoint) {
        let (parameters, starts) = state.parameters.split_at_mut(self.parameters.len());
        parameters.copy_from_slice(&self.parameters);
        starts.copy_from_slice(&self.starts);
        if let [first, second] = &mut state.memory[..] {
            let count = parameters.len();
            first[..count].copy_from_slice(&self.moments.first);
            second[..count].copy_from_slice(&self.moments.second);
        }
    }

    fn gradient(&mut self, at: &StepAt<'_>) -> GradientSize {
        let warm = self.order.config.warm_start;
        let segments = self.order.next(at.step, (at.part - warm) / (1.0 - warm));
        let mut moves = Vec::new();
        let derivatives = Derivatives {
            gradient: &mut self.gradient,
            moves: &mut moves,
        };
        let task = (&segments.task(&self.starts), &segments.begins[..]);
        let (flow, parameters) = (self.flow, &self.parameters);
        let loss = self
            .shooting
            .evaluate(flow, parameters, task, Some(derivatives));
        for (place, change) in moves {
            if let (Some(x), true) = (self.starts.get_mut(place), change.is_finite()) {
                *x += change;
            }
        }
        let squares = self.gradient.iter().map(|g| g * g).sum::<f64>();
        GradientSize { loss, squares }
    }

    fn descend(&mut self, rule: &AdamRule) {
        self.moments
            .apply(*rule, &self.gradient, &mut self.parameters);
        self.flow.project(&mut self.parameters);
    }
}

/// The loss on held-back segments of the full horizon from their recorded starts.
pub(crate) struct RolloutValidation<'a> {
    config: RolloutLoss,
    recorded: Recorded<'a>,
    weights: Vec<f64>,
    begins: Vec<usize>,
    shooting: Shooting,
    flow: &'a dyn Learner<f64>,
}

impl<'a> RolloutValidation<'a> {
    pub(crate) fn new(
        dataset: &'a Dataset,
        momenta: Option<&'a Momenta>,
        config: &'a TrainingTask,
        flow: &'a dyn Learner<f64>,
    ) -> Self {
        let order = SegmentOrder::new(dataset, momenta, config);
        let recorded = Recorded::validation(dataset, momenta);
        let all = recorded.starts(config.rollout.horizon, 1);
        let every = all.len().div_ceil(VALIDATED).max(1);
        Self {
            config: RolloutLoss {
                start: Start::Recorded,
                ..config.rollout.clone()
            },
            begins: all.into_iter().step_by(every).collect(),
            shooting: Shooting::new(flow, &config.rollout, order.most()),
            weights: order.weights,
            recorded,
            flow,
        }
    }

    /// The loss; `None` without such segments.
    pub(crate) fn loss(&mut self, theta: &[f64]) -> Option<LossValue> {
        if self.begins.is_empty() {
            return None;
        }
        let (config, n) = (&self.config, self.recorded.samples.n);
        let rows = Rows::new(config, config.horizon, n);
        let task = Task {
            recorded: self.recorded,
            config,
            weights: &self.weights,
            starts: &[],
            rows: &rows,
        };
        let parameters = &theta[..self.flow.parameters()];
        let segments = (&task, &self.begins[..]);
        Some(
            self.shooting
                .evaluate(self.flow, parameters, segments, None),
        )
    }
}
