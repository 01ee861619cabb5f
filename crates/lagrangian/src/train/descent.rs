//! Descent by Adam with everything kept as the kernels want it; only looks at the run see the parameters as they are
//! saved.

use super::adam::{Adam, AdamConfig};
use super::batch::{Batches, Samples, Value};
use super::checkpoint::Checkpoint;
use super::learner::Learner;
use super::loss::Loss;
use nets::Moments;
use nets::simd::Real;

/// The parameters of a learner, and what Adam remembers of their gradient.
pub(crate) struct Descent<T: Real> {
    batches: Batches<T>,
    moments: Moments<T>,
    /// Parameters beside those of the network.
    extra: Vec<f64>,
    extra_moments: Adam,
}

impl<T: Real> Descent<T> {
    pub(crate) fn new(learner: &dyn Learner<T>, batch: usize) -> Self {
        let extra = vec![0.0; learner.parameters() - learner.net().parameters];
        Self {
            batches: Batches::new(learner, batch),
            moments: Moments::new(learner.net()),
            extra_moments: Adam {
                first: extra.clone(),
                second: extra.clone(),
            },
            extra,
        }
    }

    /// Takes parameters and moments from the state of a run.
    pub(crate) fn load(&mut self, learner: &dyn Learner<T>, state: &Checkpoint) {
        let net = learner.net();
        let halves = |x: &Vec<f64>| {
            let (net, extra) = x.split_at(net.parameters);
            (net.to_vec(), extra.to_vec())
        };
        let (weights, extra) = halves(&state.parameters);
        let (first, extra_first) = halves(&state.memory[0]);
        let (second, extra_second) = halves(&state.memory[1]);
        self.moments
            .load(net, &weights, [&first, &second], &mut self.batches.packed);
        self.extra = extra;
        self.extra_moments = Adam {
            first: extra_first,
            second: extra_second,
        };
    }

    /// Gives them back.
    pub(crate) fn save(&self, learner: &dyn Learner<T>, state: &mut Checkpoint) {
        let net = learner.net();
        let (weights, extra) = state.parameters.split_at_mut(net.parameters);
        let [first, second] = &mut state.memory[..] else {
            return;
        };
        let (first, extra_first) = first.split_at_mut(net.parameters);
        let (second, extra_second) = second.split_at_mut(net.parameters);
        self.moments.save(net, weights, [first, second]);
        extra.copy_from_slice(&self.extra);
        extra_first.copy_from_slice(&self.extra_moments.first);
        extra_second.copy_from_slice(&self.extra_moments.second);
    }

    /// Step `step` at `rate` on these samples; returns the loss before it.
    pub(crate) fn step(
        &mut self,
        learner: &dyn Learner<T>,
        (config, loss): (&AdamConfig, Loss),
        (rate, step): (f64, usize),
        batch: (&Samples, &[usize]),
    ) -> Value {
        let net = learner.net();
        let value = self.batches.run(learner, loss, &self.extra, batch, true);
        let squares = self.batches.settle(net);
        if let Some(rule) = config.rule(rate, step, squares) {
            let (gradient, extra, packed) = self.batches.settled();
            self.moments.step(net, &rule, gradient, packed);
            self.extra_moments.apply(rule, extra, &mut self.extra);
            learner.project_extra(&mut self.extra);
        }
        value
    }
}
