//! Long shooting: weights, and the starts of long segments, of a maximum posterior by Gauss and Newton.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | θ | parameters: weights of the network, then of the forces | P |
//! | x = (q, q̇) | state | d = 2n |
//! | s | state that a segment starts from, free | d |
//! | r | (predicted − recorded) / noise of each sample that is compared | m |
//! | J, S | ∂r/∂θ, ∂r/∂s of a segment | m × P, m × d |
//! | A | precisions of the parameters, one for each group | P, diagonal |
//!
//! Minimised is Σ |r|² + θᵀ A θ. The sensitivities ∂x/∂(θ, s) are carried along with the states, so that nothing of a
//! rollout is kept but the rows of r. With S = Q R, the best starts for a change δ of the parameters are
//! s − R⁻¹ Qᵀ (r + J δ), and what they leave, J − Q Qᵀ J and r − Q Qᵀ r, gives the normal equations of θ alone. A
//! follows from the evidence (MacKay 1992, Neural Computation 4, 448, equation 26): α = γ / |θ|² with γ the number of
//! parameters of a group that the data determine, so that neither held-out data nor an early end are needed.

mod descent;
mod disturbance;
mod evidence;
mod normal;
mod path;
mod problem;
#[cfg(test)]
mod tests;

pub(crate) use descent::{Refined, descend};
pub(crate) use normal::{BestStart, eliminate};
pub(crate) use problem::{Problem, Segment};

use lagrangian_motion::{Error, Result};

/// The settings of a refinement by long rollouts.
#[derive(Debug, Clone, PartialEq)]
pub struct Shooting {
    /// Samples of a segment in each stage.
    pub horizons: Vec<usize>,
    /// The largest number of steps in a stage.
    pub steps: usize,
    /// The largest duration, s: the refinement ends with the step in which it is exceeded.
    pub seconds: f64,
}

impl Default for Shooting {
    fn default() -> Self {
        Self {
            horizons: vec![15, 40, 120, 240],
            steps: 20,
            seconds: f64::INFINITY,
        }
    }
}

impl Shooting {
    /// Checks the settings, and the noise of the `components` of a state that may be compared.
    pub(crate) fn validate(&self, noise: &[f64], dof: usize) -> Result<()> {
        if self.horizons.is_empty() || self.horizons.iter().any(|h| *h < 2) {
            let value = format!("{:?}", self.horizons);
            return Err(Error::argument(
                "horizons",
                value,
                "one or more, each at least 2 samples",
            ));
        }
        if noise.len() != dof && noise.len() != 2 * dof {
            let remedy =
                "give that of each coordinate, and of each velocity where velocities were recorded";
            return Err(Error::shape("noise", noise.len(), dof, remedy));
        }
        match noise.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
            Some(sigma) => Err(Error::argument("noise", sigma, "finite and positive")),
            None => Ok(()),
        }
    }
}
