//! Proportional-derivative control.

use super::{Controller, Desired, Gains, Reference};
use lagrangian::Result;

/// τ = `K_p` (`q_d` − q) + `K_d` (`q̇_d` − q̇), theory.md (50); it needs no model.
#[derive(Debug, Clone)]
pub struct Pd<'a> {
    gains: Gains,
    pub(super) reference: &'a Reference,
    /// Desired motion at the last tick.
    pub(super) desired: Desired,
}

impl<'a> Pd<'a> {
    /// A controller with these gains along this reference.
    ///
    /// # Errors
    /// As [`Gains::validate`].
    pub fn new(gains: Gains, reference: &'a Reference) -> Result<Self> {
        gains.validate(reference.dof())?;
        let desired = Desired::new(reference.dof());
        Ok(Self {
            gains,
            reference,
            desired,
        })
    }
}

impl Controller for Pd<'_> {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self.reference.at(t, &mut self.desired);
        self.gains.correction(&self.desired, q, qd, tau);
    }
}
