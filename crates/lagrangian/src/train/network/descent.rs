//! The loss of a network with its gradient; parameters and moments stay in the layout of the kernels between validations.

use super::lanes::Batches;
use crate::train::adam::Adam;
use crate::train::checkpoint::Checkpoint;
use crate::train::learner::Learner;
use crate::train::loss::Loss;
use crate::train::problem::{Differentiable, GradientSize, StepAt};
use nets::Moments;
use nets::simd::{AdamRule, Real};

/// The parameters of a network, the moments of their gradient, and the evaluation of its loss.
pub(crate) struct NetworkDescent<'a, T: Real> {
    learner: &'a dyn Learner<T>,
    loss: Loss,
    batches: Batches<T>,
    moments: Moments<T>,
    /// Parameters beside those of the network.
    extra: Vec<f64>,
    extra_moments: Adam,
}

impl<'a, T: Real> NetworkDescent<'a, T> {
    /// Memory for batches of at most `batch` samples.
    pub(crate) fn new(learner: &'a dyn Learner<T>, loss: Loss, batch: usize) -> Self {
        let extra = vec![0.0; learner.parameters() - learner.net().parameters];
        Self {
            learner,
            loss,
            batches: Batches::new(learner, batch),
            moments: Moments::new(learner.net()),
            extra_moments: Adam::zeros(extra.len()),
            extra,
        }
    }
}

impl<T: Real> Differentiable for NetworkDescent<'_, T> {
    fn load(&mut self, state: &Checkpoint) {
        let net = self.learner.net();
        let [first, second] = &state.memory[..] else {
            return;
        };
        let (own, all) = (net.parameters, self.learner.parameters());
        let (weights, packed) = (&state.parameters[..own], &mut self.batches.packed);
        self.moments
            .load(net, weights, [&first[..own], &second[..own]], packed);
        self.extra.copy_from_slice(&state.parameters[own..all]);
        self.extra_moments.first.copy_from_slice(&first[own..all]);
        self.extra_moments.second.copy_from_slice(&second[own..all]);
    }

    fn save(&self, state: &mut Checkpoint) {
        let net = self.learner.net();
        let [first, second] = &mut state.memory[..] else {
            return;
        };
        let (own, all) = (net.parameters, self.learner.parameters());
        let (weights, extra) = state.parameters[..all].split_at_mut(own);
        let (first, extra_first) = first[..all].split_at_mut(own);
        let (second, extra_second) = second[..all].split_at_mut(own);
        self.moments.save(net, weights, [first, second]);
        extra.copy_from_slice(&self.extra);
        extra_first.copy_from_slice(&self.extra_moments.first);
        extra_second.copy_from_slice(&self.extra_moments.second);
    }

    fn gradient(&mut self, at: &StepAt<'_>) -> GradientSize {
        let (learner, batch) = (self.learner, at.batch);
        let loss = self
            .batches
            .run(learner, self.loss, &self.extra, batch, true);
        let squares = self.batches.settle(learner.net());
        GradientSize { loss, squares }
    }

    fn descend(&mut self, rule: &AdamRule) {
        let (gradient, extra, packed) = self.batches.settled();
        self.moments
            .step(self.learner.net(), rule, gradient, packed);
        self.extra_moments.apply(*rule, extra, &mut self.extra);
        self.learner.project_extra(&mut self.extra);
    }
}
