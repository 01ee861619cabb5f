//! A mass on a spring.

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinates, State};

/// L = ½ m q̇² − ½ k q²; q(t) = q₀ cos ωt + (q̇₀/ω) sin ωt with ω² = k/m.
#[derive(Debug, Clone, PartialEq)]
pub struct MassSpring {
    /// Mass m, kg.
    pub mass: f64,
    /// Stiffness k, N/m.
    pub stiffness: f64,
}

impl System for MassSpring {
    const NAME: &'static str = "mass-spring";
    const ABOUT: &'static str = "a mass on a linear spring";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::positive("mass", "kg", 1.0), Parameter::positive("stiffness", "N/m", 1.0)];

    fn new(values: &[f64]) -> Self {
        Self { mass: values[0], stiffness: values[1] }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(1)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        (qd[0] * qd[0] * self.mass - q[0] * q[0] * self.stiffness) * 0.5
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 1, -1.0, 1.0), uniform(rng, 1, -1.0, 1.0))
    }
}
