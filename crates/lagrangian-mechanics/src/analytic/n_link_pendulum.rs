//! A chain of point masses on massless rods.

use std::f64::consts::TAU;

use super::*;

/// L = Σᵢ mᵢ (½ |vᵢ|² − g hᵢ), vᵢ = Σ_{j≤i} lⱼ θ̇ⱼ (cos θⱼ, sin θⱼ), hᵢ = −Σ_{j≤i} lⱼ cos θⱼ.
///
/// Absolute angles, 0 hanging down; with two links it is the double pendulum.
#[derive(Debug, Clone, PartialEq)]
pub struct NLinkPendulum {
    /// Mass at the end of each link, from the pivot outwards, kg.
    pub masses: Vec<f64>,
    /// Length of each link, m; one for each mass.
    pub lengths: Vec<f64>,
    /// Gravity g, m/s².
    pub gravity: f64,
}

impl System for NLinkPendulum {
    const NAME: &'static str = "n-link-pendulum";
    const ABOUT: &'static str = "a chain of equal point masses on massless rods, absolute angles";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::count("links", 3.0),
        Parameter::positive("mass", "kg", 1.0),
        Parameter::positive("length", "m", 1.0),
        Parameter::finite("gravity", "m/s²", 9.8),
    ];

    fn new(values: &[f64]) -> Self {
        let links = values[0] as usize;
        Self {
            masses: vec![values[1]; links],
            lengths: vec![values[2]; links],
            gravity: values[3],
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(self.masses.len())
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let mut l = D::from(0.0);
        let (mut vx, mut vy, mut depth) = (l, l, l);
        for (i, (mass, length)) in self.masses.iter().zip(&self.lengths).enumerate() {
            let (sin, cos) = q[i].sin_cos();
            vx += qd[i] * cos * *length;
            vy += qd[i] * sin * *length;
            depth += cos * *length;
            l += ((vx * vx + vy * vy) * 0.5 + depth * self.gravity) * *mass;
        }
        l
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let n = self.masses.len();
        State::new(uniform(rng, n, 0.0, TAU), uniform(rng, n, -10.0, 10.0))
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        let n = self.masses.len();
        State::new(uniform(rng, n, 0.0, TAU), uniform(rng, n, 0.0, 0.1))
    }
}
