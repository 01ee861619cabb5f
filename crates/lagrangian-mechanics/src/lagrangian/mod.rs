//! The trait of Lagrangians L(q, q̇) and their derivatives, and Lagrangians that are made of others.

pub mod curvature;
pub mod positions;
pub mod scaled;
pub mod seen;
mod sum;

pub use curvature::Curvature;
pub use scaled::Features;
pub use scaled::Scaling;
pub use seen::SpeedChart;
pub use seen::VelocityTransform;
pub use sum::Sum;

use crate::dynamics::Evaluator;
use crate::expression::{Expressed, Moving};
use lagrangian_motion::Coordinates;

/// Derivatives of a Lagrangian at a batch of `m` states, as far as the Euler–Lagrange equation needs them.
///
/// All row-major; `n` degrees of freedom.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Jet {
    /// L, J, `[m]`.
    pub lagrangian: Vec<f64>,
    /// ∂L/∂q, `[m, n]`.
    pub dl_dq: Vec<f64>,
    /// Momentum p = ∂L/∂q̇, `[m, n]`.
    pub momentum: Vec<f64>,
    /// Mass matrix M = ∂²L/∂q̇∂q̇, symmetric, `[m, n, n]`.
    pub mass_matrix: Vec<f64>,
    /// (∂p/∂q) q̇, the part of ṗ that comes from the change of q, `[m, n]`.
    pub momentum_drift: Vec<f64>,
}

impl Jet {
    /// Degrees of freedom.
    pub fn n(&self) -> usize {
        let states = self.lagrangian.len().max(1);
        self.momentum.len() / states
    }

    /// Sizes all fields for `m` states of `n` degrees of freedom; allocates only when it grows.
    pub fn resize(&mut self, m: usize, n: usize) {
        self.lagrangian.resize(m, 0.0);
        self.dl_dq.resize(m * n, 0.0);
        self.momentum.resize(m * n, 0.0);
        self.mass_matrix.resize(m * n * n, 0.0);
        self.momentum_drift.resize(m * n, 0.0);
    }

    /// Makes the parameters among the coordinates at state `row` immobile: their rows and columns of M become those of
    /// the identity, and no force acts on them (theory.md, equation 107).
    pub fn hold(&mut self, coordinates: &Coordinates, row: usize) {
        let n = coordinates.dof();
        for i in coordinates.parameters() {
            for j in 0..n {
                let one = if i == j { 1.0 } else { 0.0 };
                self.mass_matrix[(row * n + i) * n + j] = one;
                self.mass_matrix[(row * n + j) * n + i] = one;
            }
            self.momentum[row * n + i] = 0.0;
            self.momentum_drift[row * n + i] = 0.0;
            self.dl_dq[row * n + i] = 0.0;
        }
    }

    /// Multiplies all derivatives at state `row` by a factor.
    pub(crate) fn scale(&mut self, row: usize, factor: f64) {
        let n = self.n();
        let parts = [
            &mut self.lagrangian[row..=row],
            &mut self.dl_dq[row * n..][..n],
            &mut self.momentum[row * n..][..n],
            &mut self.mass_matrix[row * n * n..][..n * n],
            &mut self.momentum_drift[row * n..][..n],
        ];
        for part in parts {
            part.iter_mut().for_each(|x| *x *= factor);
        }
    }

    /// Adds the derivatives of another Lagrangian at the same states.
    pub fn add(&mut self, other: &Self) {
        let pairs = [
            (&mut self.lagrangian, &other.lagrangian),
            (&mut self.dl_dq, &other.dl_dq),
            (&mut self.momentum, &other.momentum),
            (&mut self.mass_matrix, &other.mass_matrix),
            (&mut self.momentum_drift, &other.momentum_drift),
        ];
        for (own, other) in pairs {
            own.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        }
    }
}

/// A Lagrangian L(q, q̇): a scalar from which the motion, the energy and the momenta follow.
pub trait Lagrangian: Send + Sync {
    /// Coordinates that it is a function of.
    fn coordinates(&self) -> &Coordinates;

    /// Evaluator of its derivatives with its own scratch memory; one for each thread.
    fn jets(&self) -> Box<dyn Jets + '_>;

    /// Evaluator of its motion without friction that needs no derivatives of L, such as the recursions over the bodies of a robot;
    /// `None` without one. The coordinates must all move.
    fn recursions(&self) -> Option<Box<dyn Evaluator + '_>> {
        None
    }

    /// Terms as expressions of a state, for code generators; `None` for a Lagrangian without expressions.
    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        let _ = at;
        None
    }
}

/// Evaluates the derivatives of one Lagrangian; see [`Lagrangian::jets`].
pub trait Jets: Send {
    /// Writes L and its derivatives at the `m` states (`q`, `qd` are `[m, n]`) to `jet`, which it resizes.
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet);

    /// Writes ∂²L/∂q∂q and ∂p/∂q at the `m` states to `curvature`, which it resizes.
    ///
    /// By default from differences of [`Jets::jet`] over steps of 10⁻³ of q (to some 10⁻⁹ where L changes over q of order one);
    /// some families compute them exactly.
    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        let mut one = Jet::default();
        self.jet(q, qd, &mut one);
        let steps = vec![curvature::STEP; one.n()];
        curvature::differences(self, (q, qd), &steps, curvature);
    }
}

impl<L: Lagrangian + ?Sized> Lagrangian for &L {
    fn coordinates(&self) -> &Coordinates {
        (**self).coordinates()
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        (**self).jets()
    }

    fn recursions(&self) -> Option<Box<dyn Evaluator + '_>> {
        (**self).recursions()
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        (**self).expressed(at)
    }
}

impl<L: Lagrangian + ?Sized> Lagrangian for std::sync::Arc<L> {
    fn coordinates(&self) -> &Coordinates {
        (**self).coordinates()
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        (**self).jets()
    }

    fn recursions(&self) -> Option<Box<dyn Evaluator + '_>> {
        (**self).recursions()
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        (**self).expressed(at)
    }
}
