//! The iteration that solves implicit steps.

use super::Failure;

/// Iterations at most.
const MAX_ITERATIONS: usize = 100;
/// An equation is solved when its unknown changes by less than this share of its size.
const SOLVED: f64 = 4.0 * f64::EPSILON;
/// Where rounding keeps it from that, this is enough.
const NEARLY_SOLVED: f64 = 1e-11;

/// Solves x = g(x) from the guess in `x` by repeating x ← g(x); `g` writes g(x) to its second argument, for which
/// `next` is room. Converges where ‖∂g/∂x‖ < 1.
///
/// # Errors
/// [`Failure::NotConverged`], [`Failure::NotFinite`].
pub(super) fn solve(
    x: &mut [f64],
    next: &mut [f64],
    mut g: impl FnMut(&[f64], &mut [f64]),
) -> Result<(), Failure> {
    let mut previous = f64::INFINITY;
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
        if change <= SOLVED * size || (change >= previous && change <= NEARLY_SOLVED * size) {
            return Ok(());
        }
        previous = change;
    }
    Err(Failure::NotConverged)
}
