//! The rollout loss, after a fit of accelerations for a first share of the budget where that is wanted.
//!
//! `flow` gives the rates as they are, `learner` the residuals of that first fit, whose memory the rollouts take over: in a
//! checkpoint it stands before that of free starts.

use super::Engine;
use crate::train::adam::{Adam, AdamConfig};
use crate::train::batch::{Batches, Samples, Value};
use crate::train::checkpoint::Checkpoint;
use crate::train::learner::Learner;
use crate::train::loss::Loss;
use crate::train::natural::{Natural, NaturalConfig};
use crate::train::rollout::Rollouts;
use crate::train::schedule::cosine;

/// Which network is trained, how it is rolled out, and for which share of the budget it is not yet.
pub(in crate::train) struct Parts<'a> {
    pub(in crate::train) flow: &'a dyn Learner<f64>,
    pub(in crate::train) learner: &'a dyn Learner<f64>,
    pub(in crate::train) rollouts: Rollouts<'a>,
    pub(in crate::train) warm_start: f64,
}

impl Parts<'_> {
    /// The share of the budget of the part that this one is in.
    fn share(&self, share: f64) -> f64 {
        match share < self.warm_start {
            true => share / self.warm_start,
            false => (share - self.warm_start) / (1.0 - self.warm_start),
        }
    }
}

/// The natural gradient; each part has a schedule of its own.
pub(in crate::train) struct NaturalRollouts<'a> {
    parts: Parts<'a>,
    config: &'a NaturalConfig,
    /// Until the rollouts begin.
    first: Option<Natural>,
}

impl<'a> NaturalRollouts<'a> {
    pub(in crate::train) fn new(parts: Parts<'a>, config: &'a NaturalConfig, batch: usize) -> Self {
        let warm = parts.warm_start > 0.0;
        Self {
            first: warm.then(|| Natural::new(parts.learner, batch)),
            parts,
            config,
        }
    }
}

impl Engine for NaturalRollouts<'_> {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        if share >= self.parts.warm_start {
            self.save(state);
            self.first = None;
        }
        let (parts, config) = (&mut self.parts, self.config);
        let part = parts.share(share);
        let rate = config.rate * cosine(part);
        let damping = config.scheduled(part, state.setbacks);
        let value = match &mut self.first {
            Some(first) => first.step(
                parts.learner,
                config,
                Loss::ACCELERATION,
                (rate, damping),
                batch,
                &mut state.parameters[..parts.learner.parameters()],
            ),
            None => {
                let at = (share, rate, damping);
                parts.rollouts.natural_step(parts.flow, config, state, at)
            }
        };
        (value, rate)
    }

    fn save(&self, state: &mut Checkpoint) {
        if let Some(first) = &self.first {
            state.memory[0][..first.phi.len()].copy_from_slice(&first.phi);
        }
    }

    fn load(&mut self, state: &Checkpoint) {
        if let Some(Natural { phi, .. }) = &mut self.first {
            let weights = phi.len();
            phi.copy_from_slice(&state.memory[0][..weights]);
        }
    }
}

/// Adam, with one schedule for both parts.
pub(in crate::train) struct AdamRollouts<'a> {
    parts: Parts<'a>,
    config: &'a AdamConfig,
    first: Option<First>,
}

/// What Adam keeps until the rollouts begin.
struct First {
    batches: Batches<f64>,
    gradient: Vec<f64>,
    moments: Adam,
}

impl<'a> AdamRollouts<'a> {
    pub(in crate::train) fn new(parts: Parts<'a>, config: &'a AdamConfig, batch: usize) -> Self {
        let zeros = || vec![0.0; parts.learner.parameters()];
        let first = || First {
            batches: Batches::new(parts.learner, batch),
            gradient: zeros(),
            moments: Adam {
                first: zeros(),
                second: zeros(),
            },
        };
        Self {
            first: (parts.warm_start > 0.0).then(first),
            parts,
            config,
        }
    }
}

impl Engine for AdamRollouts<'_> {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        if share >= self.parts.warm_start {
            self.save(state);
            self.first = None;
        }
        let (parts, config) = (&mut self.parts, self.config);
        let rate = config.rate * cosine(share);
        let value = match &mut self.first {
            Some(first) => first.step(parts.learner, (config, rate), state, batch),
            None => parts
                .rollouts
                .adam_step(parts.flow, config, state, (share, rate)),
        };
        (value, rate)
    }

    fn save(&self, state: &mut Checkpoint) {
        let (Some(First { moments, .. }), [first, second]) = (&self.first, &mut state.memory[..])
        else {
            return;
        };
        first[..moments.first.len()].copy_from_slice(&moments.first);
        second[..moments.second.len()].copy_from_slice(&moments.second);
    }

    fn load(&mut self, state: &Checkpoint) {
        let (Some(First { moments, .. }), [first, second]) = (&mut self.first, &state.memory[..])
        else {
            return;
        };
        let weights = moments.first.len();
        moments.first.copy_from_slice(&first[..weights]);
        moments.second.copy_from_slice(&second[..weights]);
    }
}

impl First {
    /// One step against the gradient of the accelerations' loss.
    fn step(
        &mut self,
        learner: &dyn Learner<f64>,
        (config, rate): (&AdamConfig, f64),
        state: &mut Checkpoint,
        batch: (&Samples, &[usize]),
    ) -> Value {
        let parameters = &mut state.parameters[..self.gradient.len()];
        let gradient = Some(&mut self.gradient[..]);
        let value = self
            .batches
            .evaluate(learner, Loss::ACCELERATION, parameters, batch, gradient);
        self.moments
            .step(config, rate, state.step, &self.gradient, parameters);
        learner.project(parameters);
        value
    }
}
