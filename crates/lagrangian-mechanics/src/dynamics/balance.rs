//! The balance of forces on a system with dry friction: M q̈ + s ∘ sgn(q̇) ∋ f − b ∘ q̇ − D q̇.

use super::{Evaluation, Evaluator};
use crate::forces::Load;

/// The balance M q̈ + s ∘ sgn(q̇) ∋ f − b ∘ q̇ − D q̇ of a state, with dry friction as a set of forces, sgn(0) = [−1, 1]
/// (theory.md, equation 130a).
///
/// The smooth friction of [`crate::Dissipation`] replaces sgn(q̇) by tanh(q̇ / vₛ).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// The mass matrix M, row-major `[n, n]`.
    pub mass_matrix: Vec<f64>,
    /// The forces without friction f = B u − o − c, N or N·m, `[n]`.
    pub force: Vec<f64>,
    /// Viscous friction b, N·s/m or N·m·s/rad, `[n]`.
    pub viscous: Vec<f64>,
    /// Dampers D between coordinates, row-major `[n, n]`, with zeros on the diagonal.
    pub between: Vec<f64>,
    /// The largest dry friction s at the velocities of the state, N or N·m, `[n]`; 0 for a coordinate without dry friction.
    pub dry: Vec<f64>,
}

impl Balance {
    /// Zeros, for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            mass_matrix: vec![0.0; n * n],
            force: zeros(),
            viscous: zeros(),
            between: vec![0.0; n * n],
            dry: zeros(),
        }
    }

    /// Whether all values are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let all = [&self.mass_matrix, &self.force, &self.viscous, &self.dry];
        all.into_iter().flatten().all(|x| x.is_finite())
    }

    /// Fills in the balance by an evaluator's model at one state under the inputs `tau`, all `[n]`.
    pub(super) fn fill<E: Evaluator + ?Sized>(
        &mut self,
        model: &mut E,
        [q, qd, tau]: [&[f64]; 3],
    ) -> Evaluation {
        let outcome = model.mass_matrix(q, qd, &mut self.mass_matrix);
        // Holds c until the forces are known.
        let bias = &mut self.viscous;
        if !outcome.is_supported() || !model.bias(q, qd, bias).is_supported() {
            return Evaluation::Unsupported;
        }
        let applied = model.applied();
        applied.driving(tau, &mut self.force);
        for (i, &v) in qd.iter().enumerate() {
            let (motor, external) = (self.force[i], -self.viscous[i]);
            self.force[i] += external;
            let gear = applied.dissipation.map(|d| d.gear(i)).unwrap_or_default();
            self.viscous[i] = gear.damping(v);
            // The load of a joint at rest is the force that holds it; the force out of the gear of a moving joint depends on its friction.
            self.dry[i] = match v == 0.0 {
                true => gear.dry(Load { motor, external }, v),
                false => (gear.friction(motor, v, v.signum()) - gear.damping(v) * v) * v.signum(),
            };
        }
        if let Some(between) = applied.dissipation.and_then(|own| own.between.as_ref()) {
            self.between.copy_from_slice(between);
        }
        match self.is_finite() {
            true => outcome,
            false => Evaluation::NotFinite {
                state: 0,
                singular: 0,
            },
        }
    }
}
