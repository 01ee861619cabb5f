//! Two point masses on two massless rods.

use std::f64::consts::TAU;

use super::*;

system! {
    /// L = ½ (m₁ + m₂) l₁² θ̇₁² + ½ m₂ l₂² θ̇₂² + m₂ l₁ l₂ θ̇₁ θ̇₂ cos(θ₁ − θ₂)
    ///   + (m₁ + m₂) g l₁ cos θ₁ + m₂ g l₂ cos θ₂.
    ///
    /// Both angles are absolute, 0 hanging down. Chaotic at most energies.
    pub struct DoublePendulum = "double-pendulum", "two point masses on two massless rods, absolute angles; chaotic" {
        /// Mass m₁ of the inner pendulum, kg.
        mass1: positive("kg", 1.0),
        /// Mass m₂ of the outer pendulum, kg.
        mass2: positive("kg", 1.0),
        /// Length l₁ of the inner rod, m.
        length1: positive("m", 1.0),
        /// Length l₂ of the outer rod, m.
        length2: positive("m", 1.0),
        /// Gravity g, m/s².
        gravity: finite("m/s²", 9.8),
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (m1, m2, g) = (self.mass1, self.mass2, self.gravity);
        let (l1, l2) = (self.length1, self.length2);
        let inner = qd[0] * qd[0] * (0.5 * (m1 + m2) * l1 * l1);
        let outer = qd[1] * qd[1] * (0.5 * m2 * l2 * l2);
        let coupling = qd[0] * qd[1] * (q[0] - q[1]).cos() * (m2 * l1 * l2);
        let height = q[0].cos() * ((m1 + m2) * g * l1) + q[1].cos() * (m2 * g * l2);
        inner + outer + coupling + height
    }

    /// q ~ U[0, 2π)², q̇ ~ U[−10, 10]² (Cranmer et al. 2020, their notebook).
    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, 0.0, TAU), uniform(rng, 2, -10.0, 10.0))
    }

    /// q ~ U[0, 2π)², q̇ ~ U[0, 0.1]² (Cranmer et al. 2020, their energy test).
    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, 0.0, TAU), uniform(rng, 2, 0.0, 0.1))
    }
}
