//! A robot arm of two uniform rods that moves in a vertical plane.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;

system! {
    /// L = Σᵢ [½ mᵢ |vᵢ|² + ½ Iᵢ ωᵢ² − mᵢ g hᵢ] + payload, with ω₁ = q̇₁, ω₂ = q̇₁ + q̇₂, Iᵢ = mᵢ lᵢ² / 12.
    ///
    /// Joint angles: q₁ from the horizontal, q₂ from the first link. The payload is a point mass at the tip.
    pub struct TwoLinkArm = "two-link-arm", "a robot arm of two uniform rods in a vertical plane, joint angles" {
        /// Mass m₁ of the upper arm, kg.
        mass1: positive("kg", 1.0),
        /// Mass m₂ of the forearm, kg.
        mass2: positive("kg", 0.8),
        /// Length l₁ of the upper arm, m.
        length1: positive("m", 0.4),
        /// Length l₂ of the forearm, m.
        length2: positive("m", 0.4),
        /// Mass at the tip, kg.
        payload: not_negative("kg", 0.0),
        /// Gravity g, m/s².
        gravity: finite("m/s²", 9.8),
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (m1, m2, l1, l2) = (self.mass1, self.mass2, self.length1, self.length2);
        let (w1, w2) = (qd[0], qd[0] + qd[1]);
        let (a1, a2) = (q[0], q[0] + q[1]);
        // ½ m |v|² − m g h of a mass at distance s along link 2 (and all of link 1).
        let at = |mass: f64, s: f64| {
            let squares = w1 * w1 * (l1 * l1) + w2 * w2 * (s * s);
            let speed = squares + w1 * w2 * q[1].cos() * (2.0 * l1 * s);
            speed * (0.5 * mass) - (a1.sin() * l1 + a2.sin() * s) * (mass * self.gravity)
        };
        let upper = w1 * w1 * (m1 * l1 * l1 / 6.0) - a1.sin() * (0.5 * m1 * self.gravity * l1);
        let turning = w2 * w2 * (m2 * l2 * l2 / 24.0);
        upper + turning + at(m2, 0.5 * l2) + at(self.payload, l2)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, -PI, PI), uniform(rng, 2, -5.0, 5.0))
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 2, -FRAC_PI_2, FRAC_PI_2), vec![0.0; 2])
    }
}
