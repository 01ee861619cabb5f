//! The second variation of the action, which classifies a stationary path as a minimum or not, and its conjugate points.

use super::discrete::{DiscreteAction, Path};
use super::tridiagonal::{BlockTridiagonal, Factored};
use lagrangian::mechanics::{diagonalise, inverse_root, product};
use lagrangian_motion::statistics::sort_numbers;

/// Number of bisections of an interval that contains an eigenvalue.
const BISECTIONS: usize = 60;

/// Second variation of the action at a stationary path.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SecondVariation {
    /// Morse index: the dimension of the space of variations that lower the action.
    pub morse_index: usize,
    /// Conjugate times, s, at which neighbouring motions from the same start meet the path again, with multiplicity.
    /// The Morse index is their number before the end (Morse 1934).
    pub conjugate_times: Vec<f64>,
    /// Whether M is positive definite along the path (Legendre's condition); otherwise a path cannot be a minimum.
    pub convex: bool,
    /// Least eigenvalue λ of −d/dt(∂²L δq̇…) on variations that vanish at the ends, H v = λ h v; its sign changes
    /// when the end passes the first conjugate point.
    pub least_eigenvalue: f64,
    /// Eigenvector v of the least eigenvalue at all nodes, with the largest entry 1, `[N + 1, n]`.
    #[serde(skip)]
    pub mode: Vec<f64>,
}

impl DiscreteAction<'_> {
    /// Second variation at a path of at least two segments.
    pub fn second_variation(&mut self, path: &Path) -> SecondVariation {
        let (hessian, masses) = self.hessian(path);
        let n = path.dof;
        let convex = masses
            .chunks_exact(n * n)
            .all(|m| inverse_root(m, n, 0.0).is_some());
        let factored = hessian.factor();
        let least = least_eigenvalue(&hessian);
        SecondVariation {
            morse_index: factored.inertia(),
            conjugate_times: crossings(&hessian, &factored, path.step()),
            convex,
            least_eigenvalue: least / path.step(),
            mode: mode(&hessian, least),
        }
    }
}

/// Conjugate times, s. Dₖ = −Uₖ Jₖ₊₁ Jₖ⁻¹ for the Jacobi fields J that vanish at the start: an eigenvalue μ < 0 of (Dₖ, −Uₖ)
/// is the ratio of a field at two neighbouring nodes, with a zero 1/(1 − μ) of the way from one to the other (theory.md, 77).
fn crossings(hessian: &BlockTridiagonal, factored: &Factored<'_>, step: f64) -> Vec<f64> {
    let mut times = Vec::new();
    for (k, pivot) in factored.pivots.iter().enumerate() {
        let ratios = match pivot.negative() {
            0 => continue,
            _ => ratios(&pivot.block, hessian.upper(k), hessian.n),
        };
        let known = ratios.into_iter().filter(|mu| *mu < 0.0);
        let node = (k + 1) as f64 * step;
        let mut here: Vec<f64> = known.map(|mu| node + step / (1.0 - mu)).collect();
        here.resize(pivot.negative(), node);
        sort_numbers(&mut here);
        times.extend(here);
    }
    times
}

/// Eigenvalues μ of D v = μ B v with B the symmetric part of −U; empty where B is not positive definite.
fn ratios(d: &[f64], upper: &[f64], n: usize) -> Vec<f64> {
    let b = |i: usize, j: usize| -0.5 * (upper[i * n + j] + upper[j * n + i]);
    let symmetric: Vec<f64> = (0..n * n).map(|ij| b(ij / n, ij % n)).collect();
    let Some(root) = inverse_root(&symmetric, n, 0.0) else {
        return Vec::new();
    };
    let mut scaled = product(&product(&root, d, n), &root, n);
    let mut vectors = vec![0.0; n * n];
    diagonalise(&mut scaled, &mut vectors, n);
    (0..n).map(|i| scaled[i * n + i]).collect()
}

/// Least eigenvalue of H by bisection: H − σ has as many negative eigenvalues as H has below σ.
fn least_eigenvalue(hessian: &BlockTridiagonal) -> f64 {
    let bound = hessian.bound();
    if !bound.is_finite() {
        return f64::NAN;
    }
    let (mut low, mut high) = (-bound, bound);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        match hessian.shifted(middle).factor().inertia() {
            0 => low = middle,
            _ => high = middle,
        }
    }
    0.5 * (low + high)
}

/// Eigenvector of the least eigenvalue by inverse iteration, with the fixed ends and its largest entry 1.
fn mode(hessian: &BlockTridiagonal, least: f64) -> Vec<f64> {
    let n = hessian.n;
    let shifted = hessian.shifted(least);
    let factored = shifted.factor();
    let count = hessian.diagonal.len() / n;
    // An initial vector that is unlikely to be orthogonal to a mode.
    let mut v: Vec<f64> = (0..count).map(|i| 1.0 + 0.3 * (i as f64).sin()).collect();
    for _ in 0..4 {
        factored.solve(&mut v);
        let largest = v
            .iter()
            .copied()
            .fold(0.0, |l: f64, x| if x.abs() > l.abs() { x } else { l });
        if !largest.is_finite() || largest == 0.0 {
            return vec![0.0; count + 2 * n];
        }
        v.iter_mut().for_each(|x| *x /= largest);
    }
    let end = vec![0.0; n];
    [end.clone(), v, end].concat()
}
