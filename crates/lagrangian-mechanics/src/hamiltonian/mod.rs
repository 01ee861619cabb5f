//! Hamiltonians H(q, p): Hamilton's equations, the Legendre transform in both directions, and networks (theory.md, section 22).

mod canonical;
mod legendre;
mod newton;

pub use canonical::Canonical;
pub use legendre::{HamiltonianOf, LagrangianOf};

use crate::dynamics::Evaluation;
use lagrangian_motion::Coordinates;

/// Derivatives of a Hamiltonian at a batch of `m` states, as far as a Lagrangian needs them.
///
/// All row-major; `n` degrees of freedom.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HamiltonianJet {
    /// H, J, `[m]`.
    pub hamiltonian: Vec<f64>,
    /// ∂H/∂q, `[m, n]`.
    pub dh_dq: Vec<f64>,
    /// q̇ = ∂H/∂p, `[m, n]`.
    pub velocity: Vec<f64>,
    /// ∂²H/∂p∂p, the inverse of the mass matrix, symmetric, `[m, n, n]`.
    pub inverse_mass: Vec<f64>,
    /// (∂²H/∂p∂q) q̇, the part of q̈ that comes from the change of q, `[m, n]`.
    pub velocity_drift: Vec<f64>,
}

impl HamiltonianJet {
    /// Sizes all fields for `m` states of `n` degrees of freedom; allocates only when it grows.
    pub fn resize(&mut self, m: usize, n: usize) {
        self.hamiltonian.resize(m, 0.0);
        self.dh_dq.resize(m * n, 0.0);
        self.velocity.resize(m * n, 0.0);
        self.inverse_mass.resize(m * n * n, 0.0);
        self.velocity_drift.resize(m * n, 0.0);
    }
}

/// A Hamiltonian H(q, p): the energy as a function of coordinates and momenta, from which the motion follows,
///
///   q̇ = ∂H/∂p,   ṗ = −∂H/∂q + τ − d(q̇)   (theory.md, equation 87).
pub trait Hamiltonian: Send + Sync {
    /// Coordinates that it is a function of.
    fn coordinates(&self) -> &Coordinates;

    /// Evaluator of its derivatives with its own scratch memory; one for each thread.
    fn jets(&self) -> Box<dyn HamiltonianJets + '_>;

    /// Whether the second argument is the momentum. Where it is q̇ instead, the function has a flow, but does not define a
    /// Lagrangian.
    fn canonical(&self) -> bool {
        true
    }
}

/// Evaluates the derivatives of one Hamiltonian at batches of `m` states (`q`, `p` are `[m, n]`).
pub trait HamiltonianJets: Send {
    /// Writes ∂H/∂q and ∂H/∂p, `[m, n]`, from which the motion follows.
    fn slopes(&mut self, q: &[f64], p: &[f64], dh_dq: &mut [f64], velocity: &mut [f64]);

    /// Writes H and its derivatives to `jet`, which it resizes.
    fn jet(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet);

    /// Writes H, J, `[m]`; unsupported for a flow without a Hamiltonian.
    fn value(&mut self, q: &[f64], p: &[f64], h: &mut [f64]) -> Evaluation {
        let mut jet = HamiltonianJet::default();
        self.jet(q, p, &mut jet);
        h.copy_from_slice(&jet.hamiltonian);
        Evaluation::of(h, 1, 0)
    }
}

impl<H: Hamiltonian + ?Sized> Hamiltonian for &H {
    fn coordinates(&self) -> &Coordinates {
        (**self).coordinates()
    }

    fn jets(&self) -> Box<dyn HamiltonianJets + '_> {
        (**self).jets()
    }

    fn canonical(&self) -> bool {
        (**self).canonical()
    }
}
