//! The torque that holds a robot up.

use super::Controller;
use lagrangian::dynamics::{Evaluator, Model};

/// τ = ĝ(q) − D q̇ with ĝ(q) = ĉ(q, 0), theory.md (53): the robot floats where it is put, damped by D.
pub struct GravityCompensation<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    damping: f64,
    rest: Vec<f64>,
}

impl<'a> GravityCompensation<'a> {
    /// Through this model; `damping` D, N·m·s/rad.
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
        if !self
            .evaluator
            .inverse_dynamics(q, &self.rest, &self.rest, tau)
        {
            tau.fill(0.0);
        }
        tau.iter_mut()
            .zip(qd)
            .for_each(|(tau, v)| *tau -= self.damping * v);
    }
}
