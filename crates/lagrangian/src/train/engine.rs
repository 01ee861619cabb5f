//! Optimisers at work in a run: each with its schedule and its memory, and one after the other.

use super::adam::AdamConfig;
use super::checkpoint::Checkpoint;
use super::natural::{Change, DampingRule, Natural, NaturalConfig, StepSize};
use super::problem::{Differentiable, LeastSquares, LossValue, StepAt};
use super::schedule::cosine;

/// An optimiser at work.
pub(super) trait Engine {
    /// One step.
    fn step(&mut self, state: &mut Checkpoint, at: StepAt<'_>) -> Stepped;
    /// Writes the memory that it keeps between two validations to `state`.
    fn save(&self, state: &mut Checkpoint);
    /// Reads this memory from `state`, which may have changed.
    fn load(&mut self, state: &Checkpoint);
}

/// The result of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stepped {
    /// The loss of the batch before the step.
    pub(super) loss: LossValue,
    /// The rate of the step.
    pub(super) rate: f64,
}

/// Adam.
pub(super) struct AdamEngine<'a, D> {
    pub(super) problem: D,
    pub(super) config: &'a AdamConfig,
}

impl<D: Differentiable> Engine for AdamEngine<'_, D> {
    fn step(&mut self, state: &mut Checkpoint, at: StepAt<'_>) -> Stepped {
        let rate = self.config.rate * cosine(at.part);
        let loss = self.config.step(&mut self.problem, &at, rate);
        debug_assert_eq!(state.step, at.step);
        Stepped { loss, rate }
    }

    fn save(&self, state: &mut Checkpoint) {
        self.problem.save(state);
    }

    fn load(&mut self, state: &Checkpoint) {
        self.problem.load(state);
    }
}

/// A problem of least squares for each step.
pub(super) trait Problems {
    /// The number of parameters that all of them share.
    fn parameters(&self) -> usize;
    /// The problem of a step.
    fn at<'p>(&'p mut self, at: &StepAt<'p>) -> Box<dyn LeastSquares + 'p>;
    /// The unit of the squares of a loss.
    fn unit(&self, loss: LossValue) -> f64;
}

/// The natural gradient, and the damping that adapts itself to the decrease that a step achieved.
pub(super) struct NaturalEngine<'a, S> {
    natural: Natural,
    problems: S,
    config: &'a NaturalConfig,
}

impl<'a, S: Problems> NaturalEngine<'a, S> {
    pub(super) fn new(problems: S, config: &'a NaturalConfig) -> Self {
        Self {
            natural: Natural::new(problems.parameters()),
            problems,
            config,
        }
    }
}

impl<S: Problems> Engine for NaturalEngine<'_, S> {
    fn step(&mut self, state: &mut Checkpoint, at: StepAt<'_>) -> Stepped {
        let config = self.config;
        let size = StepSize {
            rate: config.rate * cosine(at.part),
            damping: config.damping(at.part, state.setbacks, state.damping),
        };
        let mut problem = self.problems.at(&at);
        let theta = &mut state.parameters;
        let loss = self.natural.step(&mut *problem, config, size, theta);
        if matches!(config.damping_rule, DampingRule::Adaptive { .. }) {
            let after = problem.residuals(theta).loss;
            drop(problem);
            let change = Change {
                before: loss,
                after,
                unit: self.problems.unit(loss),
            };
            let gain = self.natural.gain(size.rate, change);
            let damping = state.damping.unwrap_or(config.damping_first);
            state.damping = Some(config.damping_rule.adapted(damping, gain));
        }
        Stepped {
            loss,
            rate: size.rate,
        }
    }

    fn save(&self, state: &mut Checkpoint) {
        let phi = &self.natural.phi;
        state.memory[0][..phi.len()].copy_from_slice(phi);
    }

    fn load(&mut self, state: &Checkpoint) {
        let count = self.natural.phi.len();
        self.natural.phi.copy_from_slice(&state.memory[0][..count]);
    }
}

/// One engine for a first part of the budget, then another, which takes over its memory.
pub(super) struct Sequential<A, B> {
    pub(super) first: Option<A>,
    pub(super) second: B,
    /// The part of the budget of the first.
    pub(super) until: f64,
    pub(super) schedules: Schedules,
}

/// The schedules of two engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Schedules {
    /// Each engine has a schedule of its own.
    Own,
    /// Both engines share the schedule of the whole run.
    Shared,
}

impl<A, B> Sequential<A, B> {
    /// The part of the budget that the engine at work sees.
    fn part(&self, part: f64) -> f64 {
        match self.schedules {
            Schedules::Shared => part,
            Schedules::Own if part < self.until => part / self.until,
            Schedules::Own => (part - self.until) / (1.0 - self.until),
        }
    }
}

impl<A: Engine, B: Engine> Engine for Sequential<A, B> {
    fn step(&mut self, state: &mut Checkpoint, at: StepAt<'_>) -> Stepped {
        if at.part >= self.until
            && let Some(first) = self.first.take()
        {
            first.save(state);
            self.second.load(state);
        }
        let at = StepAt {
            part: self.part(at.part),
            ..at
        };
        match &mut self.first {
            Some(first) => first.step(state, at),
            None => self.second.step(state, at),
        }
    }

    fn save(&self, state: &mut Checkpoint) {
        match &self.first {
            Some(first) => first.save(state),
            None => self.second.save(state),
        }
    }

    fn load(&mut self, state: &Checkpoint) {
        match &mut self.first {
            Some(first) => first.load(state),
            None => self.second.load(state),
        }
    }
}
