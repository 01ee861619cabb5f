//! Gravity compensation.

use super::Controller;
use lagrangian::{Evaluator, Model};

/// τ = ĝ(q) − D q̇ with ĝ(q) = ĉ(q, 0), theory.md (53): the robot stays where it is placed, damped by D.
pub struct GravityCompensation<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    damping: f64,
    rest: Vec<f64>,
}

impl<'a> GravityCompensation<'a> {
    /// A controller with this model and the damping D, N·m·s/rad (N·s/m).
    #[must_use]
    pub fn new(model: &'a dyn Model, damping: f64) -> Self {
        Self {
            evaluator: model.evaluator(),
            damping,
            rest: vec![0.0; model.coordinates().dof()],
        }
    }
}

impl Controller for GravityCompensation<'_> {
    fn torque(&mut self, _: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        let outcome = self
            .evaluator
            .inverse_dynamics(q, &self.rest, &self.rest, tau);
        if !outcome.is_supported() {
            tau.fill(0.0);
        }
        tau.iter_mut()
            .zip(qd)
            .for_each(|(tau, v)| *tau -= self.damping * v);
    }
}
