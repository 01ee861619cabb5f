//! A planet about a fixed star.

use std::f64::consts::TAU;

use rand::RngExt;

use super::*;

system! {
    /// L = ½ m |v|² + m μ/|x| in the plane; bound orbits are ellipses with the period T = 2π √(a³/μ).
    ///
    /// Singular where the planet hits the star.
    pub struct Kepler = "kepler", "a planet about a fixed star, in the plane" {
        /// Mass m of the planet, kg.
        mass: positive("kg", 1.0),
        /// Gravitational parameter μ of the star, m³/s².
        mu: positive("m³/s²", 1.0),
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let kinetic = (qd[0] * qd[0] + qd[1] * qd[1]) * 0.5;
        let potential = (q[0] * q[0] + q[1] * q[1]).sqrt().recip() * self.mu;
        (kinetic + potential) * self.mass
    }

    /// Bound orbits in both directions: the distance is 0.5 to 1.5 m, the speed 0.7 to 1.2 of the circular one,
    /// its direction up to 17° (0.3 rad) off the tangent.
    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let (r, phi) = (rng.random_range(0.5..1.5), rng.random_range(0.0..TAU));
        let turn = if rng.random_bool(0.5) { 0.25 } else { -0.25 };
        let heading = phi + turn * TAU + rng.random_range(-0.3..0.3);
        let speed = rng.random_range(0.7..1.2) * (self.mu / r).sqrt();
        State::new(
            vec![r * phi.cos(), r * phi.sin()],
            vec![speed * heading.cos(), speed * heading.sin()],
        )
    }
}
