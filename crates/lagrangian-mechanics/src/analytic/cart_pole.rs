//! A pendulum on a cart.

use std::f64::consts::TAU;

use super::*;

system! {
    /// L = ½ (M + m) ẋ² + m l ẋ θ̇ cos θ + ½ m l² θ̇² + m g l cos θ, with θ = 0 hanging down.
    ///
    /// The cart alone is driven: τ = (u, 0).
    pub struct CartPole = "cart-pole", "a pendulum on a driven cart, angle from hanging down" {
        /// Mass M of the cart, kg.
        cart: positive("kg", 1.0),
        /// Mass m at the end of the pole, kg.
        mass: positive("kg", 0.2),
        /// Length l of the pole, m.
        length: positive("m", 0.5),
        /// Gravity g, m/s².
        gravity: finite("m/s²", 9.8),
    }

    fn coordinates(&self) -> Coordinates {
        let x = Coordinate::new("x", "m", Topology::Line);
        Coordinates(vec![x, Coordinate::new("theta", "rad", Topology::Circle)])
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
