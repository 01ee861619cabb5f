//! Computed torque: feedback linearisation by a model.

use super::gains::{no_inverse, same_dof};
use super::{Controller, Gains, Pd, Reference};
use lagrangian::{Evaluator, Model, Result};

/// τ = M̂(q) (`q̈_d` + `K_p` e + `K_d` ė) + ĉ(q, q̇), theory.md (52): with a perfect model ë + `K_d` ė + `K_p` e = 0.
///
/// The gains are in s⁻² and s⁻¹, equal for heavy and light joints.
pub struct ComputedTorque<'a> {
    pd: Pd<'a>,
    evaluator: Box<dyn Evaluator + 'a>,
    acceleration: Vec<f64>,
}

impl<'a> ComputedTorque<'a> {
    /// A controller with these gains and this model along this reference.
    ///
    /// # Errors
    /// As [`Gains::validate`]; [`lagrangian::Error::Shape`] for a model of other degrees of freedom, [`lagrangian::Error::Argument`]
    /// for one without inverse dynamics.
    pub fn new(model: &'a dyn Model, gains: Gains, reference: &'a Reference) -> Result<Self> {
        let (n, pd) = (reference.dof(), Pd::new(gains, reference)?);
        same_dof(model, n)?;
        let mut evaluator = model.evaluator();
        let start = &reference.samples().q[..n];
        let (rest, mut tau) = (vec![0.0; n], vec![0.0; n]);
        // Warms up the evaluator, so that the first tick allocates nothing.
        let outcome = evaluator.inverse_dynamics(start, &rest, &rest, &mut tau);
        if !outcome.is_supported() {
            return Err(no_inverse());
        }
        Ok(Self {
            pd,
            evaluator,
            acceleration: vec![0.0; n],
        })
    }
}

impl Controller for ComputedTorque<'_> {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self.pd.torque(t, q, qd, &mut self.acceleration);
        let pairs = self.acceleration.iter_mut().zip(&self.pd.desired.qdd);
        pairs.for_each(|(a, d)| *a += d);
        // OK because the constructor has checked that the model has inverse dynamics.
        let _ = self
            .evaluator
            .inverse_dynamics(q, qd, &self.acceleration, tau);
    }
}
