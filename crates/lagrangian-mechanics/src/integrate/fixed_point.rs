//! The fixed-point iteration that solves implicit steps, and its criterion of convergence.

use super::{Failure, Stepped};

/// Maximum number of iterations.
pub(super) const MAX_ITERATIONS: usize = 100;
/// Relative change of the unknown below which an equation is solved.
const SOLVED: f64 = 4.0 * f64::EPSILON;
/// Relative change that is accepted where rounding prevents a smaller one.
const NEARLY_SOLVED: f64 = 1e-11;

/// Decides when an iteration has ended: at the precision of its numbers, or where its changes stop shrinking.
pub(super) struct Convergence {
    previous: f64,
}

impl Convergence {
    pub(super) fn new() -> Self {
        Self {
            previous: f64::INFINITY,
        }
    }

    /// Whether an unknown of this size is solved after a change by `change`.
    pub(super) fn is_reached(&mut self, change: f64, size: f64) -> bool {
        let previous = std::mem::replace(&mut self.previous, change);
        change <= SOLVED * size || (change >= previous && change <= NEARLY_SOLVED * size)
    }
}

/// Solves x = g(x) from the guess in `x` by repeating x ← g(x); `g` writes g(x) to its second argument, for which
/// `next` is scratch memory. Converges where ‖∂g/∂x‖ < 1.
///
/// # Errors
/// [`Failure::NotConverged`], [`Failure::NotFinite`].
pub(super) fn solve(
    x: &mut [f64],
    next: &mut [f64],
    mut g: impl FnMut(&[f64], &mut [f64]),
) -> Stepped {
    let mut convergence = Convergence::new();
    for _ in 0..MAX_ITERATIONS {
        g(x, next);
        let (mut change, mut size) = (0.0_f64, f64::MIN_POSITIVE);
        for (old, new) in x.iter_mut().zip(next.iter()) {
            if !new.is_finite() {
                return Err(Failure::NotFinite);
            }
            change = change.max((new - *old).abs());
            size = size.max(new.abs());
            *old = *new;
        }
        if convergence.is_reached(change, size) {
            return Ok(());
        }
    }
    Err(Failure::NotConverged)
}
