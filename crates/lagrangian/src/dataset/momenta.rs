//! The momenta of motions.

use serde::{Deserialize, Serialize};

/// The source of the momenta.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Momenta {
    /// Recorded momenta p.
    #[default]
    Recorded,
    /// Momenta p = m q̇ with these masses, `[n]`.
    Masses(Vec<f64>),
    /// Velocities in place of momenta: correct only for equal and constant masses, since else no H exists.
    Velocities,
}

impl Momenta {
    /// Whether these are canonical momenta.
    #[must_use]
    pub fn canonical(&self) -> bool {
        *self != Self::Velocities
    }
}
