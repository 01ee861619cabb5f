//! Two point masses on two massless rods.

use std::f64::consts::TAU;

use num_dual::DualNum;
use rand::Rng;

use super::{Parameter, System, uniform};
use crate::{Coordinates, State};

/// L = ½ (m₁ + m₂) l₁² θ̇₁² + ½ m₂ l₂² θ̇₂² + m₂ l₁ l₂ θ̇₁ θ̇₂ cos(θ₁ − θ₂)
///   + (m₁ + m₂) g l₁ cos θ₁ + m₂ g l₂ cos θ₂.
///
/// Both angles are absolute, 0 hanging down. Chaotic at most energies.
#[derive(Debug, Clone, PartialEq)]
pub struct DoublePendulum {
    /// Masses m₁ (inner) and m₂, kg.
    pub masses: [f64; 2],
    /// Lengths l₁ (inner) and l₂, m.
    pub lengths: [f64; 2],
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for DoublePendulum {
    const NAME: &'static str = "double-pendulum";
    const ABOUT: &'static str = "two point masses on two massless rods, absolute angles; chaotic";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::positive("mass1", "kg", 1.0),
        Parameter::positive("mass2", "kg", 1.0),
        Parameter::positive("length1", "m", 1.0),
        Parameter::positive("length2", "m", 1.0),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            masses: [values[0], values[1]],
            lengths: [values[2], values[3]],
            gravity: values[4],
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let ([m1, m2], [l1, l2], g) = (self.masses, self.lengths, self.gravity);
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
