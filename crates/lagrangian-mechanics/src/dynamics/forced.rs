//! The evaluator of a motion that has its own recursions, with friction and inputs.

use super::{Evaluation, Evaluator};
use crate::forces::Applied;

/// Evaluates a motion under forces, and adds friction and inputs.
pub(crate) struct Forced<'a> {
    motion: Box<dyn Evaluator + 'a>,
    applied: Applied<'a>,
    force: Vec<f64>,
}

impl<'a> Forced<'a> {
    /// The evaluator of a motion whose inverse dynamics have no friction.
    pub(crate) fn new(motion: Box<dyn Evaluator + 'a>, applied: Applied<'a>) -> Self {
        Self {
            motion,
            applied,
            force: Vec::new(),
        }
    }
}

impl Evaluator for Forced<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        self.force.resize(tau.len(), 0.0);
        self.applied.exerted(qd, tau, &mut self.force);
        self.motion.forward_dynamics(q, qd, &self.force, qdd)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        let outcome = self.motion.inverse_dynamics(q, qd, qdd, tau);
        self.applied.needed(qd, tau);
        outcome
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        self.motion.mass_matrix(q, qd, mass)
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        self.motion.bias(q, qd, bias)
    }

    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        self.motion.momentum(q, qd, p)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        self.motion.energy(q, qd, energy)
    }

    fn applied(&self) -> Applied<'_> {
        self.applied
    }
}
