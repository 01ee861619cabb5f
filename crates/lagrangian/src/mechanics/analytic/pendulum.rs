//! A point mass on a massless rod.

use std::f64::consts::TAU;

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinates, State};

/// L = ½ m l² θ̇² + m g l cos θ, with θ = 0 hanging down.
#[derive(Debug, Clone, PartialEq)]
pub struct Pendulum {
    /// Mass m, kg.
    pub mass: f64,
    /// Length l, m.
    pub length: f64,
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for Pendulum {
    const NAME: &'static str = "pendulum";
    const ABOUT: &'static str = "a point mass on a massless rod, angle from hanging down";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("mass", "kg", 1.0),
        Parameter::positive("length", "m", 1.0),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        Self { mass: values[0], length: values[1], gravity: values[2] }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(1)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let kinetic = qd[0] * qd[0] * (0.5 * self.mass * self.length * self.length);
        kinetic + q[0].cos() * (self.mass * self.gravity * self.length)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 1, 0.0, TAU), uniform(rng, 1, -10.0, 10.0))
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 1, 0.0, TAU), uniform(rng, 1, 0.0, 0.1))
    }
}
