//! A pendulum at the end of an arm that turns in a horizontal plane.

use std::f64::consts::TAU;

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinate, Coordinates, State, Topology};

/// L = ½ J φ̇² + ½ m [(r φ̇ + l θ̇ cos θ)² + l² φ̇² sin² θ + l² θ̇² sin² θ] + m g l cos θ, θ = 0 hanging down.
///
/// The arm alone is driven: τ = (u, 0) (Furuta, Yamakita, Kobayashi 1992; Åström, Furuta 2000).
#[derive(Debug, Clone, PartialEq)]
pub struct FurutaPendulum {
    /// Inertia J of the arm about its axis, kg m².
    pub inertia: f64,
    /// Length r of the arm, m.
    pub arm: f64,
    /// Mass m at the end of the pendulum, kg.
    pub mass: f64,
    /// Length l of the pendulum, m.
    pub length: f64,
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for FurutaPendulum {
    const NAME: &'static str = "furuta-pendulum";
    const ABOUT: &'static str = "a pendulum on a driven arm that turns in a horizontal plane";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("inertia", "kg m²", 0.01),
        Parameter::positive("arm", "m", 0.2),
        Parameter::positive("mass", "kg", 0.1),
        Parameter::positive("length", "m", 0.25),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            inertia: values[0],
            arm: values[1],
            mass: values[2],
            length: values[3],
            gravity: values[4],
        }
    }

    fn coordinates(&self) -> Coordinates {
        let angle = |name: &str| Coordinate {
            name: name.into(),
            unit: "rad".into(),
            topology: Topology::Circle,
        };
        Coordinates(vec![angle("phi"), angle("theta")])
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (m, l) = (self.mass, self.length);
        let (sin, cos) = q[1].sin_cos();
        let tangential = qd[0] * self.arm + qd[1] * cos * l;
        let radial = qd[0] * sin * l;
        let vertical = qd[1] * sin * l;
        let squares = tangential * tangential + radial * radial + vertical * vertical;
        qd[0] * qd[0] * (0.5 * self.inertia) + squares * (0.5 * m) + cos * (m * self.gravity * l)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, 0.0, TAU), uniform(rng, 2, -10.0, 10.0))
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, 0.0, TAU), uniform(rng, 2, -0.1, 0.1))
    }
}
