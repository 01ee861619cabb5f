//! Fields whose density is known: the truth that learned ones are measured against.

use num_dual::DualNum;

use lagrangian::Coordinates;
use lagrangian::analytic::{ClosedForm, DualJets};
use lagrangian::mechanics::{Jets, Lagrangian};

/// A chain of unit masses a spacing h = 1 apart (theory.md, 66), with U = ½ ω₀² φ² or, of angles, ω₀² (1 − cos φ):
///
/// ℓ = ½ φ̇₀² + ½ (r/h)² (φ̇₊ − φ̇₀)² − ½ (c/h)² (φ₊ − φ₀)² − U(φ₀) .
///
/// Small waves obey ω² = (ω₀² + c² κ²)/(1 + r² κ²) with κ = (2/h) sin(k h/2). The term of r, the inertia of the change
/// of length (Love 1892), makes the mass matrix of the ring cyclic tridiagonal: then the acceleration of a point depends
/// on all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The wave speed c, m/s.
    pub(crate) speed: f64,
    pub(super) radius: f64,
    pub(super) gap: f64,
    pub(super) coordinates: Coordinates,
}

impl Chain {
    /// The wave equation φ̈ = c² φ″.
    #[must_use]
    pub fn wave(speed: f64) -> Self {
        Self {
            speed,
            radius: 0.0,
            gap: 0.0,
            coordinates: Coordinates::lines(3),
        }
    }

    /// The rod of Rayleigh and Love, φ̈ − r² φ̈″ = c² φ″: short waves are slow, because they must widen the rod.
    pub(crate) fn love_rod(speed: f64, radius: f64) -> Self {
        Self {
            radius,
            ..Self::wave(speed)
        }
    }

    /// The sine-Gordon equation φ̈ = c² φ″ − ω₀² sin φ: pendulums on a twisted band. φ is an angle.
    pub(crate) fn sine_gordon(speed: f64, gap: f64) -> Self {
        Self {
            gap,
            coordinates: Coordinates::angles(3),
            ..Self::wave(speed)
        }
    }

    /// ω(k) of small waves, rad/s; k in rad/m.
    pub(crate) fn frequency(&self, k: f64) -> f64 {
        let kappa = 2.0 * (0.5 * k).sin();
        let stiffness = self.gap.powi(2) + (self.speed * kappa).powi(2);
        (stiffness / (1.0 + (self.radius * kappa).powi(2))).sqrt()
    }
}

impl ClosedForm for Chain {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (stretch, rate) = (q[2] - q[1], qd[2] - qd[1]);
        let kinetic = qd[1] * qd[1] + rate * rate * self.radius.powi(2);
        let held = match self.coordinates.is_circle(1) {
            true => -q[1].cos() + 1.0,
            false => q[1] * q[1] * 0.5,
        };
        (kinetic - stretch * stretch * self.speed.powi(2)) * 0.5 - held * self.gap.powi(2)
    }
}

impl Lagrangian for Chain {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DualJets::new(self, 3))
    }
}
