//! Newton's method for ∂S/∂q = 0 over the inner nodes of a path.

use super::discrete::{DiscreteAction, Path};
use super::search::Failure;

/// Maximum number of iterations.
const MOST: usize = 60;
/// Minimum damping factor of a step.
const SHORTEST: f64 = 1e-6;
/// Relative size of an undamped step at which the path has converged: quadratic convergence makes the next one
/// smaller than rounding.
const CONVERGED: f64 = 1e-9;

/// Moves the inner nodes to a stationary point of S.
///
/// The length λ of a step d = −H⁻¹ ∂S is chosen by the natural monotonicity test: the simplified correction
/// −H⁻¹ ∂S(q + λ d) must be shorter than (1 − λ/4) d (Deuflhard, *Newton Methods for Nonlinear Problems*, 2004,
/// section 3.3). Unlike |∂S|, this measure is independent of the scaling of the equations.
///
/// # Errors
/// [`Failure::Undefined`], or [`Failure::NotConverged`] where no step makes the next correction smaller.
pub(super) fn newton(action: &mut DiscreteAction<'_>, path: &mut Path) -> Result<(), Failure> {
    let mut trial = path.clone();
    let mut length: f64 = 1.0;
    let mut step = action.gradient(path);
    if !step.iter().all(|x| x.is_finite()) {
        return Err(Failure::Undefined);
    }
    for _ in 0..MOST {
        let (hessian, _) = action.hessian(path);
        let factored = hessian.factor();
        factored.solve(&mut step);
        let size = norm(&step);
        if !size.is_finite() {
            return Err(Failure::NotConverged);
        }
        let small = size <= CONVERGED * norm(path.inner()).max(f64::MIN_POSITIVE);
        length = if small { 1.0 } else { (2.0 * length).min(1.0) };
        step = loop {
            advance(path, &step, length, &mut trial);
            let gradient = action.gradient(&trial);
            let mut correction = gradient.clone();
            factored.solve(&mut correction);
            let correction = norm(&correction);
            if correction <= (1.0 - 0.25 * length) * size || small && correction.is_finite() {
                break gradient;
            }
            length *= 0.5;
            if small || length < SHORTEST {
                return Err(Failure::NotConverged);
            }
        };
        std::mem::swap(path, &mut trial);
        if small {
            return Ok(());
        }
    }
    Err(Failure::NotConverged)
}

/// `to` = `path` − λ `step` at the inner nodes.
fn advance(path: &Path, step: &[f64], length: f64, to: &mut Path) {
    let n = path.dof;
    let last = path.q.len() - n;
    to.q.copy_from_slice(&path.q);
    let inner = to.q[n..last].iter_mut().zip(step);
    inner.for_each(|(q, d)| *q -= length * d);
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
