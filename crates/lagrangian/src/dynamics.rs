//! The Euler–Lagrange equation, written once: M q̈ + c = τ − d(q, q̇).

use crate::Coordinates;

/// Anything that predicts motion: a Lagrangian with its dissipation, or a plain network.
pub trait Model: Send + Sync {
    /// The coordinates of its state.
    fn coordinates(&self) -> &Coordinates;

    /// Something that evaluates it, with its own scratch memory; one per thread.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;
}

/// Evaluates one model at batches of `m` states; every array is `[m, n]` unless said otherwise.
pub trait Evaluator {
    /// Forward dynamics: writes q̈ for states (q, q̇) under forces τ (SI units). Returns at how many states
    /// the mass matrix was singular, so that a truncated pseudo-inverse was used.
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize;

    /// Inverse dynamics: writes the τ that yields q̈. `false` where the model has none (a plain network).
    fn inverse_dynamics(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) -> bool;

    /// Energy H = p·q̇ − L, J, `[m]`. `false` where the model has none.
    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> bool;
}
