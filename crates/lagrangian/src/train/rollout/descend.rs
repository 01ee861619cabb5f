//! Steps of a fit under the rollout loss: which segments, how far, and by which optimiser.

use super::config::{RolloutLoss, SEGMENTS, Start};
use super::gauss_newton::GaussNewton;
use super::gradient::{Shooting, Wanted};
use super::segments::{Recorded, Rows};
use super::shoot::Task;
use crate::dataset::Dataset;
use crate::train::adam::{Adam, AdamConfig};
use crate::train::batch::Value;
use crate::train::checkpoint::Checkpoint;
use crate::train::learner::Learner;
use crate::train::natural::NaturalConfig;
use crate::train::order::Order;
use crate::train::{FitConfig, Optimizer};

/// Segments that are judged by at most.
const JUDGED: usize = 128;

/// A run under the rollout loss. The parameters of its checkpoint are those of the model, then the free starts
/// `[samples, 2n]`.
pub(crate) struct Rollouts<'a> {
    config: &'a RolloutLoss,
    train: Recorded<'a>,
    validation: Recorded<'a>,
    weights: Vec<f64>,
    batch: usize,
    seed: u64,
    parameters: usize,
    natural: Option<GaussNewton>,
    shooting: Shooting,
    gradient: Vec<f64>,
    moves: Vec<(usize, f64)>,
    /// The starts of segments of the current horizon, and the order in which they are visited.
    begins: (usize, Vec<usize>, Order),
    judge: Vec<usize>,
}

impl<'a> Rollouts<'a> {
    pub(crate) fn new(
        dataset: &'a Dataset,
        config: &'a FitConfig,
        learner: &dyn Learner<f64>,
    ) -> Self {
        let (rollout, seed) = (&config.rollout, config.seed);
        let train = Recorded::train(dataset, &*config.family);
        let validation = Recorded::validation(dataset, &*config.family);
        let most = segments(rollout, config, rollout.horizon.min(1));
        let natural = matches!(config.optimizer, Optimizer::Natural(_)).then(|| {
            let least = match rollout.growth > 0.0 {
                true => most,
                false => segments(rollout, config, rollout.horizon),
            };
            GaussNewton::new(learner, rollout, least)
        });
        let mut judge = validation.starts(rollout.horizon, 1);
        let every = judge.len().div_ceil(JUDGED).max(1);
        judge = judge.into_iter().step_by(every).collect();
        Self {
            weights: train.weights(rollout.horizon),
            config: rollout,
            train,
            validation,
            batch: config.batch,
            seed,
            parameters: learner.parameters(),
            natural,
            shooting: Shooting::new(learner, rollout, most),
            gradient: vec![0.0; learner.parameters()],
            moves: Vec::new(),
            begins: (0, Vec::new(), Order::new(0, seed)),
            judge,
        }
    }

    /// What stands behind the parameters of the model: the recorded states, where starts are free.
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

    /// The horizon at this share of the budget.
    fn horizon(&self, share: f64) -> usize {
        let share = (share - self.config.warm_start) / (1.0 - self.config.warm_start);
        if self.config.growth <= 0.0 || share >= self.config.growth {
            return self.config.horizon;
        }
        let grown = (self.config.horizon as f64 * share.max(0.0) / self.config.growth).ceil();
        (grown as usize).clamp(1, self.config.horizon)
    }

    /// Numbers of the segments of this step: the samples that they start at.
    fn batch(&mut self, horizon: usize, step: usize, optimizer: &Optimizer) -> Vec<usize> {
        if self.begins.0 != horizon {
            let stride = match self.config.start {
                Start::Recorded => 1,
                Start::Free => horizon,
            };
            let begins = self.train.starts(horizon, stride);
            let order = Order::new(begins.len(), self.seed.wrapping_add(horizon as u64));
            self.begins = (horizon, begins, order);
        }
        let wanted = count(self.config, self.batch, optimizer, horizon);
        let (_, begins, order) = &mut self.begins;
        let wanted = wanted.min(begins.len());
        let numbers = order.batch(step, wanted);
        numbers.iter().map(|k| begins[*k]).collect()
    }

    /// A step of the natural gradient at this rate and damping.
    pub(crate) fn natural_step(
        &mut self,
        learner: &dyn Learner<f64>,
        natural: &NaturalConfig,
        state: &mut Checkpoint,
        (share, rate, damping): (f64, f64, f64),
    ) -> Value {
        let horizon = self.horizon(share);
        let begins = self.batch(horizon, state.step, &Optimizer::Natural(natural.clone()));
        let rows = Rows::new(self.config, horizon, self.train.samples.n);
        let (parameters, starts) = state.parameters.split_at_mut(self.parameters);
        let task = Task {
            recorded: self.train,
            config: self.config,
            weights: &self.weights,
            starts,
            rows: &rows,
        };
        let phi = &mut state.memory[0][..self.parameters];
        let Some(engine) = &mut self.natural else {
            return Value::default();
        };
        let value = engine.step(
            learner,
            natural,
            (rate, damping),
            (&task, &begins),
            (parameters, phi),
            &mut self.moves,
        );
        apply(&self.moves, starts);
        value
    }

    /// A step of Adam at this rate.
    pub(crate) fn adam_step(
        &mut self,
        learner: &dyn Learner<f64>,
        adam: &AdamConfig,
        state: &mut Checkpoint,
        (share, rate): (f64, f64),
    ) -> Value {
        let horizon = self.horizon(share);
        let begins = self.batch(horizon, state.step, &Optimizer::Adam(adam.clone()));
        let rows = Rows::new(self.config, horizon, self.train.samples.n);
        let (parameters, starts) = state.parameters.split_at_mut(self.parameters);
        let task = Task {
            recorded: self.train,
            config: self.config,
            weights: &self.weights,
            starts,
            rows: &rows,
        };
        let wanted = Wanted {
            gradient: &mut self.gradient,
            moves: &mut self.moves,
        };
        let task = (&task, &begins[..]);
        let value = self
            .shooting
            .evaluate(learner, parameters, task, Some(wanted));
        apply(&self.moves, starts);
        let [first, second] = &mut state.memory[..] else {
            return value;
        };
        let mut memory = Adam {
            first: std::mem::take(first),
            second: std::mem::take(second),
        };
        // The free starts lie behind these and have no moments of their own.
        let length = memory.first.len();
        memory.first.truncate(self.parameters);
        memory.second.truncate(self.parameters);
        memory.step(adam, rate, state.step, &self.gradient, parameters);
        learner.project(parameters);
        memory.first.resize(length, 0.0);
        memory.second.resize(length, 0.0);
        [*first, *second] = [memory.first, memory.second];
        value
    }

    /// The loss on held-back segments of the full horizon from their recorded starts; `None` where there are none.
    pub(crate) fn judge(
        &mut self,
        learner: &dyn Learner<f64>,
        parameters: &[f64],
    ) -> Option<Value> {
        if self.judge.is_empty() {
            return None;
        }
        let config = RolloutLoss {
            start: Start::Recorded,
            ..self.config.clone()
        };
        let rows = Rows::new(&config, config.horizon, self.train.samples.n);
        let task = Task {
            recorded: self.validation,
            config: &config,
            weights: &self.weights,
            starts: &[],
            rows: &rows,
        };
        let parameters = &parameters[..self.parameters];
        let judged = (&task, &self.judge[..]);
        Some(self.shooting.evaluate(learner, parameters, judged, None))
    }
}

fn apply(moves: &[(usize, f64)], starts: &mut [f64]) {
    for &(place, change) in moves {
        if let (Some(x), true) = (starts.get_mut(place), change.is_finite()) {
            *x += change;
        }
    }
}

fn segments(rollout: &RolloutLoss, config: &FitConfig, horizon: usize) -> usize {
    count(rollout, config.batch, &config.optimizer, horizon)
}

/// Segments of a batch of `batch` samples: under Adam those with so many samples, under the natural gradient those with
/// twice as many evaluations, whose number it costs the square of.
fn count(config: &RolloutLoss, batch: usize, optimizer: &Optimizer, horizon: usize) -> usize {
    let each = match optimizer {
        Optimizer::Natural(_) => config.evaluations(horizon).div_ceil(2),
        Optimizer::Adam(_) => horizon,
    };
    (batch / each.max(1))
        .next_multiple_of(SEGMENTS)
        .max(SEGMENTS)
}
