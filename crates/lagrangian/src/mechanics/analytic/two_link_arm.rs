//! A robot arm of two uniform rods that moves in a vertical plane.

use std::f64::consts::{FRAC_PI_2, PI};

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinates, State};

/// L = Σᵢ [½ mᵢ |vᵢ|² + ½ Iᵢ ωᵢ² − mᵢ g hᵢ] + payload, with ω₁ = q̇₁, ω₂ = q̇₁ + q̇₂, Iᵢ = mᵢ lᵢ² / 12.
///
/// Joint angles: q₁ from the horizontal, q₂ from the first link. The payload is a point mass at the tip.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLinkArm {
    /// Masses m₁ (upper arm) and m₂, kg.
    pub masses: [f64; 2],
    /// Lengths l₁ and l₂, m.
    pub lengths: [f64; 2],
    /// Mass at the tip, kg.
    pub payload: f64,
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for TwoLinkArm {
    const NAME: &'static str = "two-link-arm";
    const ABOUT: &'static str = "a robot arm of two uniform rods in a vertical plane, joint angles";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("mass1", "kg", 1.0),
        Parameter::positive("mass2", "kg", 0.8),
        Parameter::positive("length1", "m", 0.4),
        Parameter::positive("length2", "m", 0.4),
        Parameter::not_negative("payload", "kg", 0.0),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            masses: [values[0], values[1]],
            lengths: [values[2], values[3]],
            payload: values[4],
            gravity: values[5],
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let ([m1, m2], [l1, l2]) = (self.masses, self.lengths);
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
