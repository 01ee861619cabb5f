//! Small dense symmetric systems M x = b, as they arise once per state in forward dynamics.
//!
//! Cholesky where M ≻ 0; LU with scaled partial pivoting where it is indefinite; a truncated pseudo-inverse
//! (Jacobi's eigenvalue method) only where it is singular. Meant for n up to some dozens: everything is
//! plain loops over memory that is allocated once.

pub mod quadratic;
pub mod ridge;

/// Pivots below this many rounding errors of their row count as zero.
const PIVOT_ROUNDINGS: f64 = 16.0;
/// The pseudo-inverse drops eigenvalues below this part of the largest.
const EIGENVALUE_CUTOFF: f64 = 1e-12;
/// A 2 × 2 matrix whose Schur complement is below this part of its entry is passed to the general algorithm.
const NEARLY_SINGULAR: f64 = 1e-8;
/// Jacobi's method converges quadratically; more sweeps than this are never needed.
const MAX_SWEEPS: usize = 40;

/// The kind of a symmetric matrix, as found while solving its system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Regularity {
    /// Positive definite: solved by Cholesky.
    Definite,
    /// Regular but not positive definite: solved by LU.
    Indefinite,
    /// Singular to working precision: the result is the least-norm, least-squares solution.
    Singular,
    /// Contains NaN or infinity: the result is NaN.
    NotFinite,
}

/// Solves M x = b for symmetric `n × n` matrices; owns its memory, so that solving allocates nothing.
#[derive(Debug, Clone)]
pub struct SymmetricSolver {
    n: usize,
    factor: Vec<f64>,
    vectors: Vec<f64>,
    scale: Vec<f64>,
    rows: Vec<usize>,
    unit: Vec<f64>,
}

impl SymmetricSolver {
    /// A solver for `n` unknowns.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            n,
            factor: vec![0.0; n * n],
            vectors: vec![0.0; n * n],
            scale: vec![0.0; n],
            rows: (0..n).collect(),
            unit: vec![0.0; n],
        }
    }

    /// Number of unknowns.
    #[must_use]
    pub fn n(&self) -> usize {
        self.n
    }

    /// Writes the solution of M x = b to `x`; `m` is row-major `[n, n]`, `b` and `x` are `[n]`.
    pub fn solve(&mut self, m: &[f64], b: &[f64], x: &mut [f64]) -> Regularity {
        x.copy_from_slice(b);
        if let Some(regularity) = solve_directly(m, x) {
            return regularity;
        }
        if !m.iter().all(|v| v.is_finite()) {
            x.fill(f64::NAN);
            return Regularity::NotFinite;
        }
        if self.cholesky(m) {
            self.substitute_cholesky(x);
            return Regularity::Definite;
        }
        if self.lu(m) {
            self.substitute_lu(b, x);
            return Regularity::Indefinite;
        }
        self.pseudo_inverse(m, b, x);
        Regularity::Singular
    }

    /// Writes M⁻¹ to `inverse` `[n, n]`, one column per row, with the rules of [`SymmetricSolver::solve`].
    pub fn invert(&mut self, m: &[f64], inverse: &mut [f64]) -> Regularity {
        let n = self.n;
        if let Some(regularity) = invert_directly(m, inverse) {
            return regularity;
        }
        inverse.fill(0.0);
        (0..n).for_each(|i| inverse[i * n + i] = 1.0);
        if n > 2 && m.iter().all(|v| v.is_finite()) && self.cholesky(m) {
            let columns = inverse.chunks_exact_mut(n);
            columns.for_each(|column| self.substitute_cholesky(column));
            return Regularity::Definite;
        }
        let mut found = Regularity::Definite;
        let mut unit = std::mem::take(&mut self.unit);
        unit.resize(n, 0.0);
        for (i, column) in inverse.chunks_exact_mut(n).enumerate() {
            unit.fill(0.0);
            unit[i] = 1.0;
            found = self.solve(m, &unit, column);
        }
        self.unit = unit;
        found
    }

    /// Writes the solution of A x = b for any A `[n, n]`; `false` where A is singular or not finite.
    pub fn solve_general(&mut self, a: &[f64], b: &[f64], x: &mut [f64]) -> bool {
        let regular = a.iter().all(|v| v.is_finite()) && self.lu(a);
        if regular {
            self.substitute_lu(b, x);
        }
        regular
    }

    fn tolerance(&self) -> f64 {
        PIVOT_ROUNDINGS * f64::EPSILON * self.n as f64
    }

    /// M = G Gᵀ with G lower triangular; `false` at the first pivot that is not positive.
    fn cholesky(&mut self, m: &[f64]) -> bool {
        let (n, tolerance) = (self.n, self.tolerance());
        let g = &mut self.factor;
        for j in 0..n {
            let pivot = m[j * n + j] - dot(&g[j * n..j * n + j], &g[j * n..j * n + j]);
            if pivot <= tolerance * m[j * n + j].abs() {
                return false;
            }
            let root = pivot.sqrt();
            g[j * n + j] = root;
            for i in j + 1..n {
                let (upper, lower) = g.split_at(i * n);
                let sum = m[i * n + j] - dot(&lower[..j], &upper[j * n..j * n + j]);
                g[i * n + j] = sum / root;
            }
        }
        true
    }

    fn substitute_cholesky(&self, x: &mut [f64]) {
        let (n, g) = (self.n, &self.factor);
        for i in 0..n {
            x[i] = (x[i] - dot(&g[i * n..i * n + i], &x[..i])) / g[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| g[k * n + i] * x[k]).sum();
            x[i] = (x[i] - sum) / g[i * n + i];
        }
    }

    /// P M = L U, rows chosen by their pivot relative to their largest entry; `false` when M is singular.
    fn lu(&mut self, m: &[f64]) -> bool {
        let (n, tolerance) = (self.n, self.tolerance());
        self.factor.copy_from_slice(m);
        let a = &mut self.factor;
        for (i, row) in m.chunks_exact(n).enumerate() {
            self.rows[i] = i;
            self.scale[i] = row.iter().fold(0.0, |largest: f64, v| largest.max(v.abs()));
        }
        for j in 0..n {
            let relative = |i: usize| a[i * n + j].abs() / self.scale[i];
            let Some(best) = (j..n).max_by(|&i, &k| relative(i).total_cmp(&relative(k))) else {
                return false;
            };
            // NaN: a row of zeros.
            if relative(best) <= tolerance || relative(best).is_nan() {
                return false;
            }
            self.rows.swap(j, best);
            self.scale.swap(j, best);
            (0..n).for_each(|k| a.swap(j * n + k, best * n + k));
            for i in j + 1..n {
                let factor = a[i * n + j] / a[j * n + j];
                a[i * n + j] = factor;
                (j + 1..n).for_each(|k| a[i * n + k] -= factor * a[j * n + k]);
            }
        }
        true
    }

    fn substitute_lu(&self, b: &[f64], x: &mut [f64]) {
        let (n, a) = (self.n, &self.factor);
        for i in 0..n {
            x[i] = b[self.rows[i]] - dot(&a[i * n..i * n + i], &x[..i]);
        }
        for i in (0..n).rev() {
            let sum = dot(&a[i * n + i + 1..(i + 1) * n], &x[i + 1..]);
            x[i] = (x[i] - sum) / a[i * n + i];
        }
    }

    /// x = Σ vᵢ (vᵢ·b)/λᵢ over the eigenvalues above the cut-off.
    fn pseudo_inverse(&mut self, m: &[f64], b: &[f64], x: &mut [f64]) {
        let n = self.n;
        self.factor.copy_from_slice(m);
        diagonalise(&mut self.factor, &mut self.vectors, n);
        let eigenvalue = |i: usize| self.factor[i * n + i];
        let largest = (0..n).fold(0.0, |largest: f64, i| largest.max(eigenvalue(i).abs()));
        x.fill(0.0);
        for i in (0..n).filter(|&i| eigenvalue(i).abs() > EIGENVALUE_CUTOFF * largest) {
            let v = &self.vectors[i * n..(i + 1) * n];
            let weight = dot(v, b) / eigenvalue(i);
            x.iter_mut().zip(v).for_each(|(x, v)| *x += weight * v);
        }
    }
}

/// Closed forms for one and two unknowns, in place; `None` where they do not apply.
fn solve_directly(m: &[f64], x: &mut [f64]) -> Option<Regularity> {
    match (m, x) {
        (&[m], [x]) if m.is_finite() && m != 0.0 => {
            *x /= m;
            Some(if m > 0.0 {
                Regularity::Definite
            } else {
                Regularity::Indefinite
            })
        }
        (&[a, b, _, d], [x, y]) => {
            let schur = d - b / a * b;
            // Near singularity the general algorithm decides, and also for NaN, which compares false.
            if !(a > 0.0 && schur > NEARLY_SINGULAR * d && d.is_finite()) {
                return None;
            }
            *y = (*y - b / a * *x) / schur;
            *x = (*x - b * *y) / a;
            Some(Regularity::Definite)
        }
        _ => None,
    }
}

/// Closed forms of the inverse for one and two unknowns, where [`solve_directly`] applies.
fn invert_directly(m: &[f64], inverse: &mut [f64]) -> Option<Regularity> {
    match (m, inverse) {
        (&[a], [x]) if a.is_finite() && a != 0.0 => {
            *x = 1.0 / a;
            Some(if a > 0.0 {
                Regularity::Definite
            } else {
                Regularity::Indefinite
            })
        }
        (&[a, b, _, d], [xx, xy, yx, yy]) => {
            let ratio = b / a;
            let schur = d - ratio * b;
            if !(a > 0.0 && schur > NEARLY_SINGULAR * d && d.is_finite()) {
                return None;
            }
            *yy = 1.0 / schur;
            *xy = -ratio * *yy;
            *yx = *xy;
            *xx = 1.0 / a - ratio * *xy;
            Some(Regularity::Definite)
        }
        _ => None,
    }
}

/// Jacobi's method: rotates symmetric `a` to diagonal form; row i of `vectors` is the i-th eigenvector.
pub fn diagonalise(a: &mut [f64], vectors: &mut [f64], n: usize) {
    vectors.fill(0.0);
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for i in 0..n {
            for j in i + 1..n {
                let off = a[i * n + j];
                if off.abs() <= f64::EPSILON * (a[i * n + i] * a[j * n + j]).abs().sqrt() * 0.5
                    || off == 0.0
                {
                    continue;
                }
                rotated = true;
                rotate(a, vectors, n, i, j);
            }
        }
        if !rotated {
            return;
        }
    }
}

/// One Jacobi rotation in the plane (i, j), which makes `a[i, j]` zero.
fn rotate(a: &mut [f64], vectors: &mut [f64], n: usize, i: usize, j: usize) {
    let theta = (a[j * n + j] - a[i * n + i]) / (2.0 * a[i * n + j]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..n {
        let (x, y) = (a[k * n + i], a[k * n + j]);
        a[k * n + i] = c * x - s * y;
        a[k * n + j] = s * x + c * y;
    }
    for rows in [a, vectors] {
        for k in 0..n {
            let (x, y) = (rows[i * n + k], rows[j * n + k]);
            rows[i * n + k] = c * x - s * y;
            rows[j * n + k] = s * x + c * y;
        }
    }
}

/// B^(−1/2) of a symmetric `[n, n]`; `None` where an eigenvalue is not above `cutoff` of the largest.
#[must_use]
pub fn inverse_root(b: &[f64], n: usize, cutoff: f64) -> Option<Vec<f64>> {
    let (mut a, mut vectors) = (b.to_vec(), vec![0.0; n * n]);
    diagonalise(&mut a, &mut vectors, n);
    let values: Vec<f64> = (0..n).map(|i| a[i * n + i]).collect();
    let largest = values.iter().fold(0.0, |l: f64, x| l.max(*x));
    if !values.iter().all(|x| *x > cutoff * largest) {
        return None;
    }
    let entry = |i: usize, j: usize| -> f64 {
        let terms = (0..n).map(|k| vectors[k * n + i] * vectors[k * n + j] / values[k].sqrt());
        terms.sum()
    };
    Some((0..n * n).map(|ij| entry(ij / n, ij % n)).collect())
}

/// The product A B of two `[n, n]` matrices.
#[must_use]
pub fn product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let entry = |i: usize, j: usize| (0..n).map(|k| a[i * n + k] * b[k * n + j]).sum::<f64>();
    (0..n * n).map(|ij| entry(ij / n, ij % n)).collect()
}

/// Σ aᵢ bᵢ.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn residual(m: &[f64], x: &[f64], b: &[f64]) -> f64 {
        let rows = m.chunks_exact(x.len()).zip(b);
        rows.map(|(row, b)| (dot(row, x) - b).abs())
            .fold(0.0, f64::max)
    }

    /// A random symmetric matrix with eigenvalues near `eigenvalues` (exactly, by a Householder reflection).
    fn with_spectrum(eigenvalues: &[f64], seed: u64) -> Vec<f64> {
        let n = eigenvalues.len();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let u: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let norm = dot(&u, &u);
        let h = |i: usize, k: usize| f64::from(u8::from(i == k)) - 2.0 * u[i] * u[k] / norm;
        let entry = |i, j| (0..n).map(|k| h(i, k) * eigenvalues[k] * h(j, k)).sum();
        (0..n * n).map(|ij| entry(ij / n, ij % n)).collect()
    }

    #[test]
    fn every_regular_matrix_is_solved_to_rounding_and_named_rightly() {
        for n in 1..=12 {
            let b: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let mut x = vec![0.0; n];
            let mut solver = SymmetricSolver::new(n);
            let definite: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let m = with_spectrum(&definite, n as u64);
            assert_eq!(solver.solve(&m, &b, &mut x), Regularity::Definite);
            assert!(residual(&m, &x, &b) < 1e-12);
            let mut indefinite = definite;
            indefinite[0] = -1.0;
            let m = with_spectrum(&indefinite, n as u64);
            assert_eq!(solver.solve(&m, &b, &mut x), Regularity::Indefinite);
            assert!(residual(&m, &x, &b) < 1e-11);
        }
    }

    #[test]
    fn an_inverse_has_the_columns_that_solving_gives() {
        for n in 1..=6 {
            let mut eigenvalues: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            for sign in [1.0, -1.0] {
                eigenvalues[0] = sign;
                let m = with_spectrum(&eigenvalues, n as u64);
                let mut solver = SymmetricSolver::new(n);
                let mut inverse = vec![0.0; n * n];
                let found = solver.invert(&m, &mut inverse);
                for (i, column) in inverse.chunks_exact(n).enumerate() {
                    let mut unit = vec![0.0; n];
                    unit[i] = 1.0;
                    let mut x = vec![0.0; n];
                    assert_eq!(solver.solve(&m, &unit, &mut x), found);
                    assert!(x.iter().zip(column).all(|(x, y)| (x - y).abs() < 1e-12));
                }
            }
        }
    }

    #[test]
    fn a_singular_matrix_gives_the_least_norm_answer_and_says_so() {
        let mut x = [0.0; 2];
        let mut solver = SymmetricSolver::new(2);
        let regularity = solver.solve(&[1.0, 1.0, 1.0, 1.0], &[2.0, 2.0], &mut x);
        assert_eq!(regularity, Regularity::Singular);
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 1.0).abs() < 1e-14);
        assert_eq!(
            solver.solve(&[0.0; 4], &[1.0, 1.0], &mut x),
            Regularity::Singular
        );
        assert!(x.iter().all(|x| x.abs() < f64::MIN_POSITIVE));
        for n in 3..8 {
            let mut eigenvalues = vec![2.0; n];
            eigenvalues[1] = 0.0;
            let m = with_spectrum(&eigenvalues, 7);
            let mut x = vec![0.0; n];
            let regularity = SymmetricSolver::new(n).solve(&m, &vec![1.0; n], &mut x);
            assert_eq!(regularity, Regularity::Singular);
            assert!(x.iter().all(|x| x.abs() < 1.0), "{x:?}");
        }
    }

    #[test]
    fn a_matrix_without_diagonal_needs_no_pseudo_inverse() {
        let mut x = [0.0; 2];
        let regularity = SymmetricSolver::new(2).solve(&[0.0, 2.0, 2.0, 0.0], &[2.0, 4.0], &mut x);
        assert_eq!((regularity, x), (Regularity::Indefinite, [2.0, 1.0]));
    }

    #[test]
    fn masses_twenty_decades_apart_are_not_singular() {
        let m = [1e10, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1e-10];
        let mut x = [0.0; 3];
        let regularity = SymmetricSolver::new(3).solve(&m, &[1e10, 1.0, 1e-10], &mut x);
        assert_eq!(regularity, Regularity::Definite);
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-14), "{x:?}");
    }

    #[test]
    fn a_matrix_that_is_not_finite_gives_nan() {
        let mut x = [0.0; 2];
        let m = [f64::NAN, 0.0, 0.0, 1.0];
        assert_eq!(
            SymmetricSolver::new(2).solve(&m, &[1.0; 2], &mut x),
            Regularity::NotFinite
        );
        assert!(x[0].is_nan());
    }
}
