//! Bodies that attract each other.

use std::f64::consts::{PI, TAU};

use rand::RngExt;

use super::*;

/// L = Σᵢ ½ mᵢ |vᵢ|² + Σ_{i<j} G mᵢ mⱼ / |xᵢ − xⱼ|; coordinates x₁ y₁ (z₁) x₂ y₂ (z₂) ….
///
/// Singular where two bodies meet.
#[derive(Debug, Clone, PartialEq)]
pub struct NBody {
    /// Mass of each body, kg.
    pub masses: Vec<f64>,
    /// Gravitational constant G, m³/(kg s²).
    pub gravitation: f64,
    /// Number of dimensions: 2 (the plane) or 3 (space).
    pub dimensions: usize,
}

impl System for NBody {
    const NAME: &'static str = "n-body";
    const ABOUT: &'static str = "equal bodies that attract each other, in the plane or in space";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::count("bodies", 3.0),
        Parameter::planar_or_spatial("dimensions"),
        Parameter::positive("mass", "kg", 1.0),
        Parameter::positive("gravitation", "m³/(kg s²)", 1.0),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            masses: vec![values[2]; values[0] as usize],
            gravitation: values[3],
            dimensions: values[1] as usize,
        }
    }

    fn coordinates(&self) -> Coordinates {
        let axes = &["x", "y", "z"][..self.dimensions];
        let names = (1..=self.masses.len()).flat_map(|i| axes.iter().map(move |a| format!("{a}{i}")));
        Coordinates(names.map(|name| Coordinate::new(name, "m", Topology::Line)).collect())
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let d = self.dimensions;
        let mut l = D::from(0.0);
        for (i, mass) in self.masses.iter().enumerate() {
            for v in &qd[i * d..(i + 1) * d] {
                l += *v * *v * (0.5 * mass);
            }
            for (j, other) in self.masses.iter().enumerate().skip(i + 1) {
                let mut square = D::from(0.0);
                for k in 0..d {
                    let apart = q[i * d + k] - q[j * d + k];
                    square += apart * apart;
                }
                l += square.sqrt().recip() * (self.gravitation * mass * other);
            }
        }
        l
    }

    /// The rotating regular polygon of radius 0.9 to 1.2 m, with 5 % of noise on each velocity.
    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let (bodies, d) = (self.masses.len(), self.dimensions);
        let (radius, turn) = (rng.random_range(0.9..1.2), rng.random_range(0.0..TAU));
        let mass = self.masses.iter().sum::<f64>() / bodies as f64;
        let pull: f64 = (1..bodies).map(|k| 0.25 / (PI * k as f64 / bodies as f64).sin()).sum();
        let speed = (self.gravitation * mass * pull / radius).sqrt();
        let mut state = State::new(vec![0.0; bodies * d], vec![0.0; bodies * d]);
        for i in 0..bodies {
            let (sin, cos) = (turn + TAU * i as f64 / bodies as f64).sin_cos();
            state.q[i * d..i * d + 2].copy_from_slice(&[radius * cos, radius * sin]);
            state.qd[i * d..i * d + 2].copy_from_slice(&[-speed * sin, speed * cos]);
        }
        state.qd.iter_mut().for_each(|v| *v += 0.05 * speed * normal(rng));
        state
    }
}
