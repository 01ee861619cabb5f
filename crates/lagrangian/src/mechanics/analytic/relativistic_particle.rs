//! A relativistic particle in a uniform field.

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, normal, uniform};
use crate::{Coordinate, Coordinates, State, Topology};

/// L = −√(1 − q̇²) + g q in units of rest mass and c = 1; q̈ = g (1 − q̇²)^{3/2}.
///
/// Hyperbolic motion: from rest at 0, q(t) = (√(1 + g² t²) − 1)/g. Defined for |q̇| < 1 only. This is the
/// physical particle; see [`super::RelativisticParticlePublished`] for the one of the literature.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativisticParticle {
    /// Force per rest mass g, 1/s.
    pub field: f64,
}

impl System for RelativisticParticle {
    const NAME: &'static str = "relativistic-particle";
    const ABOUT: &'static str = "a relativistic particle in a uniform field, c = 1 (the physical one)";
    const PARAMETERS: &'static [Parameter] = &[Parameter::finite("field", "1/s", 10.0)];

    fn new(values: &[f64]) -> Self {
        Self { field: values[0] }
    }

    fn coordinates(&self) -> Coordinates {
        coordinates()
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        q[0] * self.field - one_minus_square(qd[0]).sqrt()
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        sample_state(rng)
    }
}

/// 1 − v², as (1 − v)(1 + v): no digits are lost near the speed of light.
pub(super) fn one_minus_square<D: DualNum<Primitive = f64> + Copy>(v: D) -> D {
    (D::from(1.0) - v) * (D::from(1.0) + v)
}

/// One coordinate in light-seconds.
pub(super) fn coordinates() -> Coordinates {
    let position = Coordinate { name: "q1".into(), unit: "ls".into(), topology: Topology::Line };
    Coordinates(vec![position])
}

/// q ~ U[−10, 10], q̇ = 0.99999 tanh(2 N(0, 1)) (Cranmer et al. 2020, their notebook).
pub(super) fn sample_state(rng: &mut dyn Rng) -> State {
    State::new(uniform(rng, 1, -10.0, 10.0), vec![0.99999 * (2.0 * normal(rng)).tanh()])
}
