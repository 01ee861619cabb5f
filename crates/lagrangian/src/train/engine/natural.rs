//! The natural gradient, which keeps φ, and the damping that adapts itself to what a step achieved.

use super::Engine;
use crate::train::batch::{Batches, Samples, Value};
use crate::train::checkpoint::Checkpoint;
use crate::train::damping::DampingRule;
use crate::train::learner::Learner;
use crate::train::loss::Loss;
use crate::train::natural::{Natural, NaturalConfig};
use crate::train::schedule::cosine;

pub(in crate::train) struct NaturalEngine<'a> {
    natural: Natural,
    learner: &'a dyn Learner<f64>,
    config: &'a NaturalConfig,
    loss: Loss,
    /// Of the loss after a step, where the damping follows it.
    after: Option<Batches<f64>>,
}

impl<'a> NaturalEngine<'a> {
    pub(in crate::train) fn new(
        learner: &'a dyn Learner<f64>,
        (config, loss): (&'a NaturalConfig, Loss),
        batch: usize,
    ) -> Self {
        let adaptive = matches!(config.damping_rule, DampingRule::Adaptive { .. });
        Self {
            natural: Natural::new(learner, batch),
            after: adaptive.then(|| Batches::new(learner, batch)),
            learner,
            config,
            loss,
        }
    }

    /// The damping of the next step, by what the last one, taken at this rate and damping, made of its loss.
    fn adapt(
        &mut self,
        state: &mut Checkpoint,
        at: (f64, f64),
        before: Value,
        batch: (&Samples, &[usize]),
    ) {
        let Some(after) = &mut self.after else {
            return;
        };
        let (learner, config) = (self.learner, self.config);
        let after = after.evaluate(learner, self.loss, &state.parameters, batch, None);
        let samples = batch.1.len();
        let gain = self.natural.gain(learner, at, (before, after), samples);
        let damping = state.damping.unwrap_or(config.damping_first);
        state.damping = Some(config.damping_rule.adapted(damping, gain));
    }
}

impl Engine for NaturalEngine<'_> {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        let rate = self.config.rate * cosine(share);
        let damping = self.config.damping(share, state.setbacks, state.damping);
        let at = (rate, damping);
        let value = self.natural.step(
            self.learner,
            self.config,
            self.loss,
            at,
            batch,
            &mut state.parameters,
        );
        self.adapt(state, at, value, batch);
        (value, rate)
    }

    fn save(&self, state: &mut Checkpoint) {
        state.memory[0].copy_from_slice(&self.natural.phi);
    }

    fn load(&mut self, state: &Checkpoint) {
        self.natural.phi.copy_from_slice(&state.memory[0]);
    }
}
