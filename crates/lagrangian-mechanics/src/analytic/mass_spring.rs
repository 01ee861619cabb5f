//! A mass on a spring.

use super::*;

system! {
    /// L = ½ m q̇² − ½ k q²; q(t) = q₀ cos ωt + (q̇₀/ω) sin ωt with ω² = k/m.
    pub struct MassSpring = "mass-spring", "a mass on a linear spring" {
        /// Mass m, kg.
        mass: positive("kg", 1.0),
        /// Stiffness k, N/m.
        stiffness: positive("N/m", 1.0),
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
