//! Adam, which keeps parameters and moments as the kernels want them.

use super::Engine;
use crate::train::adam::AdamConfig;
use crate::train::batch::{Samples, Value};
use crate::train::checkpoint::Checkpoint;
use crate::train::descent::Descent;
use crate::train::learner::Learner;
use crate::train::loss::Loss;
use crate::train::schedule::cosine;
use nets::simd::Real;

pub(in crate::train) struct AdamEngine<'a, T: Real> {
    descent: Descent<T>,
    learner: &'a dyn Learner<T>,
    config: &'a AdamConfig,
    loss: Loss,
}

impl<'a, T: Real> AdamEngine<'a, T> {
    pub(in crate::train) fn new(
        learner: &'a dyn Learner<T>,
        (config, loss): (&'a AdamConfig, Loss),
        batch: usize,
    ) -> Self {
        Self {
            descent: Descent::new(learner, batch),
            learner,
            config,
            loss,
        }
    }
}

impl<T: Real> Engine for AdamEngine<'_, T> {
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64) {
        let rate = self.config.rate * cosine(share);
        let (settings, at) = ((self.config, self.loss), (rate, state.step));
        let value = self.descent.step(self.learner, settings, at, batch);
        (value, rate)
    }

    fn save(&self, state: &mut Checkpoint) {
        self.descent.save(self.learner, state);
    }

    fn load(&mut self, state: &Checkpoint) {
        self.descent.load(self.learner, state);
    }
}
