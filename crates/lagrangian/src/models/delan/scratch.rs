//! The memory of a mass matrix as a network between the passes of a block.

use super::{Block, Factors};
use nets::simd::Real;

/// The memory between the passes of a block, of deep Lagrangian networks and of Hamiltonian ones of the same form.
pub(crate) struct Scratch<T: Real> {
    /// The block of a network that is trained by torques or accelerations.
    pub(crate) block: Option<Box<Block<T>>>,
    /// The factors of other mass matrices of this form.
    pub(crate) factors: Factors,
    /// The seeds of their reverse passes along directions.
    pub(crate) seeds: Vec<f64>,
}

impl<T: Real> Default for Scratch<T> {
    fn default() -> Self {
        Self {
            block: None,
            factors: Factors::default(),
            seeds: Vec::new(),
        }
    }
}
