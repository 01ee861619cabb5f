//! A point mass on a massless rod.

use std::f64::consts::TAU;

use super::*;

system! {
    /// L = ½ m l² θ̇² + m g l cos θ, with θ = 0 hanging down.
    pub struct Pendulum = "pendulum", "a point mass on a massless rod, angle from hanging down" {
        /// Mass m, kg.
        mass: positive("kg", 1.0),
        /// Length l, m.
        length: positive("m", 1.0),
        /// Gravity g, m/s².
        gravity: finite("m/s²", 9.8),
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
