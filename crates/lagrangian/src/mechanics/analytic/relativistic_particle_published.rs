//! The "relativistic particle" of the literature on learned Lagrangians.

use num_dual::DualNum;
use rand::Rng;

use super::relativistic_particle::{coordinates, one_minus_square, sample_state};
use super::{Parameter, System};
use crate::{Coordinates, State};

/// L = (1 − q̇²)^{−1/2} − 1 + g q; q̈ = g (1 − q̇²)^{5/2} / (1 + 2 q̇²) (Cranmer et al. 2020).
///
/// Its kinetic term is the energy of a relativistic particle, not its Lagrangian, so it moves unlike one; it
/// is offered because published figures are for it. Defined for |q̇| < 1 only.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativisticParticlePublished {
    /// Field g, 1/s.
    pub field: f64,
}

impl System for RelativisticParticlePublished {
    const NAME: &'static str = "relativistic-particle-published";
    const ABOUT: &'static str = "the relativistic particle as published with Lagrangian networks";
    const PARAMETERS: &'static [Parameter] = &[Parameter::finite("field", "1/s", 10.0)];

    fn new(values: &[f64]) -> Self {
        Self { field: values[0] }
    }

    fn coordinates(&self) -> Coordinates {
        coordinates()
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        one_minus_square(qd[0]).sqrt().recip() - 1.0 + q[0] * self.field
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        sample_state(rng)
    }
}
