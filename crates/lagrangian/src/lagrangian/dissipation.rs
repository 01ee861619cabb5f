//! Forces that take energy out: viscous and smooth Coulomb friction, one pair of coefficients a coordinate.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Friction dᵢ(q̇) = bᵢ q̇ᵢ + cᵢ tanh(q̇ᵢ / vₛ), which opposes the motion: M q̈ + c = τ − d (theory.md, equations 4
/// and 24).
///
/// All coefficients are non-negative, so that the power d·q̇ taken out is never negative.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dissipation {
    /// Viscous coefficients b, N·s/m or N·m·s/rad, `[n]`.
    pub viscous: Vec<f64>,
    /// Coulomb coefficients c, N or N·m, `[n]`.
    pub coulomb: Vec<f64>,
    /// The speed vₛ over which Coulomb friction changes its sign, m/s or rad/s.
    pub smoothing: f64,
}

impl Dissipation {
    /// Viscous friction alone.
    #[must_use]
    pub fn viscous(coefficients: Vec<f64>) -> Self {
        Self {
            coulomb: vec![0.0; coefficients.len()],
            viscous: coefficients,
            smoothing: 1.0,
        }
    }

    /// Checks the coefficients for a system of `n` degrees of freedom.
    ///
    /// # Errors
    /// [`Error::Shape`] where there are not `n` of each; [`Error::Argument`] where one is negative or not
    /// finite, or vₛ is not positive.
    pub fn validate(&self, n: usize) -> Result<()> {
        let kinds = [
            ("viscous friction", &self.viscous),
            ("Coulomb friction", &self.coulomb),
        ];
        for (name, coefficients) in kinds {
            if coefficients.len() != n {
                return Err(Error::Shape {
                    what: name.into(),
                    found: coefficients.len(),
                    expected: n,
                    remedy: "give one coefficient per coordinate".into(),
                });
            }
            if let Some(value) = coefficients.iter().find(|c| !(c.is_finite() && **c >= 0.0)) {
                let must = "finite and not negative: friction takes energy out";
                return Err(Error::Argument {
                    name,
                    value: value.to_string(),
                    must,
                });
            }
        }
        if !(self.smoothing.is_finite() && self.smoothing > 0.0) {
            return Err(Error::Argument {
                name: "smoothing",
                value: self.smoothing.to_string(),
                must: "a positive speed: take one below the slowest motion of interest",
            });
        }
        Ok(())
    }

    /// Writes d at `m` states; `qd` and `force` are `[m, n]`.
    pub fn force(&self, qd: &[f64], force: &mut [f64]) {
        let n = self.viscous.len().max(1);
        for (qd, force) in qd.chunks_exact(n).zip(force.chunks_exact_mut(n)) {
            for (i, (v, d)) in qd.iter().zip(force).enumerate() {
                *d = self.viscous[i] * v;
                if self.coulomb[i] > 0.0 {
                    *d += self.coulomb[i] * (v / self.smoothing).tanh();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn friction_never_puts_energy_in_and_saturates() {
        let d = Dissipation {
            viscous: vec![0.1, 0.0],
            coulomb: vec![0.0, 2.0],
            smoothing: 0.01,
        };
        d.validate(2).unwrap();
        let mut force = [0.0; 6];
        let qd = [3.0, -1.0, -3.0, 1.0, 0.0, 0.0];
        d.force(&qd, &mut force);
        let expected = [0.3, -2.0, -0.3, 2.0, 0.0, 0.0];
        assert!(
            force
                .iter()
                .zip(expected)
                .all(|(f, e)| (f - e).abs() < 1e-12),
            "{force:?}"
        );
        assert!(force.iter().zip(qd).all(|(f, v)| f * v >= 0.0));
    }

    #[test]
    fn coefficients_that_would_put_energy_in_are_refused() {
        assert!(Dissipation::viscous(vec![-0.1]).validate(1).is_err());
        assert!(Dissipation::viscous(vec![f64::NAN]).validate(1).is_err());
        assert!(Dissipation::viscous(vec![0.1]).validate(2).is_err());
        let still = Dissipation {
            smoothing: 0.0,
            ..Dissipation::viscous(vec![0.1])
        };
        assert!(still.validate(1).is_err());
    }
}
