//! A pendulum on a cart.

use std::f64::consts::TAU;

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinate, Coordinates, State, Topology};

/// L = ½ (M + m) ẋ² + m l ẋ θ̇ cos θ + ½ m l² θ̇² + m g l cos θ, with θ = 0 hanging down.
///
/// The cart alone is driven: τ = (u, 0).
#[derive(Debug, Clone, PartialEq)]
pub struct CartPole {
    /// Mass M of the cart, kg.
    pub cart: f64,
    /// Mass m at the end of the pole, kg.
    pub mass: f64,
    /// Length l of the pole, m.
    pub length: f64,
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for CartPole {
    const NAME: &'static str = "cart-pole";
    const ABOUT: &'static str = "a pendulum on a driven cart, angle from hanging down";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("cart", "kg", 1.0),
        Parameter::positive("mass", "kg", 0.2),
        Parameter::positive("length", "m", 0.5),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            cart: values[0],
            mass: values[1],
            length: values[2],
            gravity: values[3],
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates(vec![
            Coordinate {
                name: "x".into(),
                unit: "m".into(),
                topology: Topology::Line,
            },
            Coordinate {
                name: "theta".into(),
                unit: "rad".into(),
                topology: Topology::Circle,
            },
        ])
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (m, l) = (self.mass, self.length);
        let cart = qd[0] * qd[0] * (0.5 * (self.cart + m));
        let coupling = qd[0] * qd[1] * q[1].cos() * (m * l);
        let pole = qd[1] * qd[1] * (0.5 * m * l * l);
        cart + coupling + pole + q[1].cos() * (m * self.gravity * l)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let (x, theta) = (uniform(rng, 1, -1.0, 1.0), uniform(rng, 1, 0.0, TAU));
        let (xd, thetad) = (uniform(rng, 1, -3.0, 3.0), uniform(rng, 1, -10.0, 10.0));
        State::new([x, theta].concat(), [xd, thetad].concat())
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        let (x, theta) = (uniform(rng, 1, -0.5, 0.5), uniform(rng, 1, 0.0, TAU));
        State::new([x, theta].concat(), uniform(rng, 2, -0.1, 0.1))
    }
}
