//! The terms of M q̈ + c = τ − d from the derivatives of L, at the `m` states of a [`Jet`].

use super::Evaluation;
use crate::lagrangian::{Jet, Lagrangian};
use lagrangian_motion::solve::{Regularity, SymmetricSolver, dot};

/// Writes the bias c = (∂p/∂q) q̇ − ∂L/∂q, `[m, n]`.
pub fn bias(jet: &Jet, bias: &mut [f64]) {
    let terms = jet.momentum_drift.iter().zip(&jet.dl_dq);
    for (c, (drift, force)) in bias.iter_mut().zip(terms) {
        *c = drift - force;
    }
}

/// Inverse dynamics: writes τ = M q̈ + c, without dissipation; `qdd` and `tau` are `[m, n]`.
pub fn inverse(jet: &Jet, n: usize, qdd: &[f64], tau: &mut [f64]) {
    let n = n.max(1);
    bias(jet, tau);
    let states = qdd.chunks_exact(n).zip(tau.chunks_exact_mut(n));
    for (mass, (qdd, tau)) in jet.mass_matrix.chunks_exact(n * n).zip(states) {
        for (row, tau) in mass.chunks_exact(n).zip(tau) {
            *tau += dot(row, qdd);
        }
    }
}

/// Forward dynamics: writes q̈ = M⁻¹ (f − c) for the forces f = τ − d in `force`, which is overwritten with f − c.
pub fn forward(
    jet: &Jet,
    solver: &mut SymmetricSolver,
    force: &mut [f64],
    qdd: &mut [f64],
) -> Evaluation {
    let n = solver.n().max(1);
    let terms = jet.momentum_drift.iter().zip(&jet.dl_dq);
    for (f, (drift, dl_dq)) in force.iter_mut().zip(terms) {
        *f += dl_dq - drift;
    }
    let states = force.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
    let mut singular = 0;
    for (mass, (force, qdd)) in jet.mass_matrix.chunks_exact(n * n).zip(states) {
        singular += usize::from(solver.solve(mass, force, qdd) == Regularity::Singular);
    }
    Evaluation::of(qdd, n, singular)
}

/// Writes the energy H = p·q̇ − L, J, `[m]`; `qd` is `[m, n]`.
pub fn energy(jet: &Jet, n: usize, qd: &[f64], energy: &mut [f64]) {
    let n = n.max(1);
    let states = jet.momentum.chunks_exact(n).zip(qd.chunks_exact(n));
    for ((h, l), (p, qd)) in energy.iter_mut().zip(&jet.lagrangian).zip(states) {
        *h = dot(p, qd) - l;
    }
}

/// Momenta p = ∂L/∂q̇ of the states (q, q̇), `[m, n]`.
#[must_use]
pub fn momenta(lagrangian: &dyn Lagrangian, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut jet = Jet::default();
    lagrangian.jets().jet(q, qd, &mut jet);
    jet.momentum
}
