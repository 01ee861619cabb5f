//! A pendulum at the end of an arm that turns in a horizontal plane.

use std::f64::consts::TAU;

use super::*;

system! {
    /// L = ½ J φ̇² + ½ m [(r φ̇ + l θ̇ cos θ)² + l² φ̇² sin² θ + l² θ̇² sin² θ] + m g l cos θ, θ = 0 hanging down.
    ///
    /// The arm alone is driven: τ = (u, 0) (Furuta, Yamakita, Kobayashi 1992; Åström, Furuta 2000).
    pub struct FurutaPendulum = "furuta-pendulum", "a pendulum on a driven arm that turns in a horizontal plane" {
        /// Inertia J of the arm about its axis, kg m².
        inertia: positive("kg m²", 0.01),
        /// Length r of the arm, m.
        arm: positive("m", 0.2),
        /// Mass m at the end of the pendulum, kg.
        mass: positive("kg", 0.1),
        /// Length l of the pendulum, m.
        length: positive("m", 0.25),
        /// Gravity g, m/s².
        gravity: finite("m/s²", 9.8),
    }

    fn coordinates(&self) -> Coordinates {
        let angle = |name| Coordinate::new(name, "rad", Topology::Circle);
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
