//! Fields on a ring of points: a Lagrangian that is the sum of one local density over all of them.
//!
//! L = Σᵢ ℓ(φᵢ₋₁, φᵢ, φᵢ₊₁, φ̇ᵢ₋₁, φ̇ᵢ, φ̇ᵢ₊₁) (Cranmer et al. 2020, section 4: a graph of local Lagrangians;
//! theory.md, section 20). The density is the same everywhere, so one that was learned on ten points is the law of a
//! thousand. A density is itself a [`Lagrangian`](lagrangian::mechanics::Lagrangian) of three coordinates, the values left, here and
//! right; whatever offers one can be a field: a closed form ([`Chain`]), a network ([`DensityNet`]).
//!
//! ```text
//! density ─► Field (a Model) ─► rollout
//!    ▲
//!   fit ◄── Dataset whose coordinates are the points of a ring
//! ```
//!
//! The mass matrix couples points at most two apart, so that a step costs O(points) in time and memory.
//!
//! ```
//! use experiments::field::{Chain, Field};
//! use lagrangian::{RolloutOptions, rollout};
//! use lagrangian::rollout::{free, times};
//!
//! let string = Field::new(Chain::wave(1.0), 100)?;
//! let pulse: Vec<f64> = (0..100).map(|i| (-((f64::from(i) - 50.0) / 5.0).powi(2)).exp()).collect();
//! let motion = rollout(&string, &pulse, &[0.0; 100], &times(100.0, 50.0)?, &free, &RolloutOptions::default())?;
//! // The two halves of the pulse have gone round the ring and meet again, up to the dispersion of the grid.
//! assert!((motion.trajectory.q[200 + 50] - 1.0).abs() < 0.2);
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod chain;
mod cyclic_band;
mod data;
mod density;
mod fit;
mod inputs;
mod natural;
mod plain;
mod ring;
mod rows;
mod saved;
mod stencil;
#[cfg(test)]
mod tests;
mod waves;

pub use chain::Chain;
pub(crate) use data::{RingStates, ring_states};
pub(crate) use density::Output;
pub use density::{DensityConfig, DensityNet};
pub(crate) use fit::{FieldFitConfig, LearnedField, fit};
pub use inputs::{FieldScaling, Symmetry};
pub use ring::{Field, FieldEvaluator, MassBand};
pub(crate) use stencil::wrapped;
pub(crate) use waves::{
    Pulse, centre_of_pulse, dispersion, kink, kink_position, slope, speed_of_motion,
};
