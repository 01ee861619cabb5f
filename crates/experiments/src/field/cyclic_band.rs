//! Cyclic banded symmetric systems M x = b, as they arise for a field on a ring, in time and memory O(n).
//!
//! `M_jk` is zero unless j and k are at most `half` points apart on the ring. Folding the ring flat (0, n−1, 1, n−2, …)
//! makes neighbours at distance d stand at most 2 d apart, so that M becomes an ordinary band of half-width 2 `half`
//! without corners. Cholesky where M ≻ 0, LU with partial pivoting where it is indefinite; only a singular matrix is
//! taken as dense (its pseudo-inverse, up to [`DENSE_MOST`] unknowns).

use lagrangian::mechanics::{Regularity, SymmetricSolver};

/// Pivots below this many roundings of their row count as zero.
const PIVOT_ROUNDINGS: f64 = 16.0;

/// A singular matrix of more unknowns than this has no answer in reasonable time: it is NaN.
pub(super) const DENSE_MOST: usize = 64;

/// A symmetric matrix of a ring, as the sum of its couplings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CyclicBand {
    n: usize,
    half: usize,
    /// What couples j and j + d (mod n), `[n, half + 1]`; d = 0 is the diagonal.
    entries: Vec<f64>,
}

impl CyclicBand {
    /// Zero, for `n` points coupled up to `half` apart (`half` < n). Where the band meets itself (n ≤ 2 `half`)
    /// couplings of the same two points add up.
    pub(super) fn new(n: usize, half: usize) -> Self {
        Self {
            n,
            half,
            entries: vec![0.0; n * (half + 1)],
        }
    }

    /// Sets all couplings to zero.
    pub(super) fn clear(&mut self) {
        self.entries.fill(0.0);
    }

    /// Adds `x` to the coupling of j and j + d (mod n), both `M_jk` and `M_kj`; d ≤ `half`.
    #[inline]
    pub(super) fn add(&mut self, j: usize, d: usize, x: f64) {
        self.entries[j * (self.half + 1) + d] += x;
    }

    /// All couplings as (j, k, `M_jk`), j to k forward along the ring.
    fn couplings(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let rows = self.entries.chunks_exact(self.half + 1).enumerate();
        rows.flat_map(move |(j, row)| {
            let row = row.iter().enumerate();
            row.map(move |(d, &x)| (j, (j + d) % self.n, x))
        })
    }

    /// The same matrix row-major, `[n, n]`: for small rings, and to test by.
    pub(super) fn dense(&self) -> Vec<f64> {
        let mut dense = vec![0.0; self.n * self.n];
        for (j, k, m) in self.couplings() {
            dense[j * self.n + k] += m;
            if j != k {
                dense[k * self.n + j] += m;
            }
        }
        dense
    }
}

/// Solves M x = b for matrices of one size; owns its memory, so that solving allocates nothing.
#[derive(Debug, Clone)]
pub(super) struct CyclicBandSolver {
    n: usize,
    /// Half-width of the folded band.
    wide: usize,
    /// Where point j of the ring stands.
    place: Vec<usize>,
    /// G of M = G Gᵀ, or L and U of P M = L U; row p from column p − `wide`, `[n, 3 wide + 1]`.
    factor: Vec<f64>,
    /// Rows that were exchanged.
    pivots: Vec<usize>,
    right: Vec<f64>,
    regularity: Regularity,
    /// The matrix itself, where it was singular.
    dense: Vec<f64>,
}

impl CyclicBandSolver {
    /// A solver for matrices of this size.
    pub(super) fn new(n: usize, half: usize) -> Self {
        let wide = (2 * half).min(n.saturating_sub(1));
        let place = |j| {
            if 2 * j < n {
                2 * j
            } else {
                2 * (n - 1 - j) + 1
            }
        };
        Self {
            n,
            wide,
            place: (0..n).map(place).collect(),
            factor: vec![0.0; n * (3 * wide + 1)],
            pivots: vec![0; n],
            right: vec![0.0; n],
            regularity: Regularity::Singular,
            dense: Vec::new(),
        }
    }

    /// Writes the solution of M x = b to `x`, both `[n]`.
    pub(super) fn solve(&mut self, m: &CyclicBand, b: &[f64], x: &mut [f64]) -> Regularity {
        let regularity = self.factor(m);
        self.substitute(b, x);
        regularity
    }

    /// Divides M into factors, for [`CyclicBandSolver::substitute`].
    pub(super) fn factor(&mut self, m: &CyclicBand) -> Regularity {
        self.regularity = if !m.entries.iter().all(|x| x.is_finite()) {
            Regularity::NotFinite
        } else if self.fold(m).cholesky() {
            Regularity::Definite
        } else if self.fold(m).lu() {
            Regularity::Indefinite
        } else {
            self.dense = if self.n <= DENSE_MOST {
                m.dense()
            } else {
                Vec::new()
            };
            Regularity::Singular
        };
        self.regularity
    }

    /// Writes the solution for another right-hand side and the matrix of the last [`CyclicBandSolver::factor`].
    pub(super) fn substitute(&mut self, b: &[f64], x: &mut [f64]) {
        match self.regularity {
            Regularity::NotFinite => return x.fill(f64::NAN),
            Regularity::Singular if self.dense.is_empty() => return x.fill(f64::NAN),
            Regularity::Singular => {
                let _ = SymmetricSolver::new(self.n).solve(&self.dense, b, x);
                return;
            }
            _ => {}
        }
        for (&p, &b) in self.place.iter().zip(b) {
            self.right[p] = b;
        }
        if self.regularity == Regularity::Definite {
            self.substitute_cholesky();
        } else {
            self.substitute_lu();
        }
        for (&p, x) in self.place.iter().zip(x) {
            *x = self.right[p];
        }
    }

    fn row(&self) -> usize {
        3 * self.wide + 1
    }

    fn tolerance(&self) -> f64 {
        PIVOT_ROUNDINGS * f64::EPSILON * (self.wide + 1) as f64
    }

    /// Writes the folded matrix into the memory of the factors.
    fn fold(&mut self, m: &CyclicBand) -> &mut Self {
        let (row, wide) = (self.row(), self.wide);
        self.factor.fill(0.0);
        for (j, k, x) in m.couplings() {
            let (p, q) = (self.place[j], self.place[k]);
            self.factor[p * row + wide + q - p] += x;
            if p != q {
                self.factor[q * row + wide + p - q] += x;
            }
        }
        self
    }

    /// M = G Gᵀ, the lower half of the band; `false` at the first pivot that is not positive.
    fn cholesky(&mut self) -> bool {
        let (row, wide, tolerance) = (self.row(), self.wide, self.tolerance());
        for p in 0..self.n {
            let (above, own) = self.factor.split_at_mut(p * row);
            let first = p.saturating_sub(wide);
            let own = &mut own[..=wide];
            for q in first..p {
                // Σ over the columns r that both rows have.
                let other = &above[q * row..][..=wide];
                let (from, shift) = (first + wide - p, p - q);
                let sum: f64 = (from..wide - shift)
                    .map(|at| own[at] * other[at + shift])
                    .sum();
                own[wide + q - p] = (own[wide + q - p] - sum) / other[wide];
            }
            let squares: f64 = own[..wide].iter().map(|g| g * g).sum();
            let pivot = own[wide] - squares;
            if pivot <= tolerance * own[wide].abs() {
                return false;
            }
            own[wide] = pivot.sqrt();
        }
        true
    }

    fn substitute_cholesky(&mut self) {
        let (row, wide) = (self.row(), self.wide);
        let x = &mut self.right;
        for p in 0..self.n {
            let g = &self.factor[p * row..][..=wide];
            let first = p.saturating_sub(wide);
            let known = g[first + wide - p..wide].iter().zip(&x[first..p]);
            x[p] = (x[p] - known.map(|(g, x)| g * x).sum::<f64>()) / g[wide];
        }
        for p in (0..self.n).rev() {
            let g = &self.factor[p * row..][..=wide];
            x[p] /= g[wide];
            let (first, value) = (p.saturating_sub(wide), x[p]);
            for (x, g) in x[first..p].iter_mut().zip(&g[first + wide - p..wide]) {
                *x -= g * value;
            }
        }
    }

    /// P M = L U with the largest pivot of each column; `false` where there is none.
    fn lu(&mut self) -> bool {
        let (row, wide, n) = (self.row(), self.wide, self.n);
        let tolerance = self.tolerance();
        let a = &mut self.factor;
        let size = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let at = |p: usize, q: usize| p * row + wide + q - p;
        for q in 0..n {
            let last = (q + wide).min(n - 1);
            let largest = |&p: &usize, &r: &usize| a[at(p, q)].abs().total_cmp(&a[at(r, q)].abs());
            let best = (q..=last).max_by(largest).unwrap_or(q);
            if a[at(best, q)].abs() <= tolerance * size {
                return false;
            }
            self.pivots[q] = best;
            let end = (q + 2 * wide).min(n - 1);
            (q..=end).for_each(|r| a.swap(at(q, r), at(best, r)));
            for p in q + 1..=last {
                let factor = a[at(p, q)] / a[at(q, q)];
                a[at(p, q)] = factor;
                (q + 1..=end).for_each(|r| a[at(p, r)] -= factor * a[at(q, r)]);
            }
        }
        true
    }

    fn substitute_lu(&mut self) {
        let (row, wide, n) = (self.row(), self.wide, self.n);
        let (a, x) = (&self.factor, &mut self.right);
        let at = |p: usize, q: usize| p * row + wide + q - p;
        for q in 0..n {
            x.swap(q, self.pivots[q]);
            for p in q + 1..=(q + wide).min(n - 1) {
                x[p] -= a[at(p, q)] * x[q];
            }
        }
        for p in (0..n).rev() {
            let known: f64 = (p + 1..=(p + 2 * wide).min(n - 1))
                .map(|r| a[at(p, r)] * x[r])
                .sum();
            x[p] = (x[p] - known) / a[at(p, p)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// A random matrix of a ring with `diagonal` added, and a right-hand side.
    fn system(n: usize, half: usize, diagonal: f64) -> (CyclicBand, Vec<f64>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(n as u64);
        let mut m = CyclicBand::new(n, half);
        for j in 0..n {
            for d in 0..=half {
                m.add(j, d, rng.random_range(-1.0..1.0));
            }
            m.add(j, 0, diagonal);
        }
        (m, (0..n).map(|_| rng.random_range(-1.0..1.0)).collect())
    }

    fn residual(m: &CyclicBand, x: &[f64], b: &[f64]) -> f64 {
        let mut out = vec![0.0; b.len()];
        for (j, k, m) in m.couplings() {
            out[j] += m * x[k];
            if j != k {
                out[k] += m * x[j];
            }
        }
        let pairs = out.iter().zip(b);
        pairs.fold(0.0, |worst, (a, b)| (a - b).abs().max(worst))
    }

    #[test]
    fn every_ring_is_solved_as_the_dense_solver_does() {
        for (n, half) in (3..=24).flat_map(|n| [(n, 1), (n, 2)]) {
            for (diagonal, expected) in
                [(8.0, Regularity::Definite), (-8.0, Regularity::Indefinite)]
            {
                let (m, b) = system(n, half, diagonal);
                let (mut x, mut reference) = (vec![0.0; n], vec![0.0; n]);
                let found = CyclicBandSolver::new(n, half).solve(&m, &b, &mut x);
                assert_eq!(found, expected, "{n} points");
                assert!(residual(&m, &x, &b) < 1e-13, "{n} points");
                SymmetricSolver::new(n).solve(&m.dense(), &b, &mut reference);
                let pairs = x.iter().zip(&reference);
                assert!(pairs.fold(0.0, |e: f64, (a, b)| e.max((a - b).abs())) < 1e-12);
            }
        }
    }

    #[test]
    fn an_indefinite_ring_without_a_usable_diagonal_is_solved_by_exchanging_rows() {
        let (n, half) = (2001, 2);
        let (m, b) = system(n, half, 0.0);
        let mut x = vec![0.0; n];
        let found = CyclicBandSolver::new(n, half).solve(&m, &b, &mut x);
        assert_eq!(found, Regularity::Indefinite);
        assert!(residual(&m, &x, &b) < 1e-9);
    }

    #[test]
    fn a_singular_ring_is_named_and_small_ones_get_the_least_norm_answer() {
        // Differences of neighbours do not see a constant.
        let laplacian = |n| {
            let mut m = CyclicBand::new(n, 1);
            (0..n).for_each(|j| {
                m.add(j, 0, 2.0);
                m.add(j, 1, -1.0);
            });
            m
        };
        let n = 12;
        let b: Vec<f64> = (0..n)
            .map(|j| (std::f64::consts::TAU * j as f64 / n as f64).cos())
            .collect();
        let mut x = vec![0.0; n];
        let found = CyclicBandSolver::new(n, 1).solve(&laplacian(n), &b, &mut x);
        assert_eq!(found, Regularity::Singular);
        assert!(residual(&laplacian(n), &x, &b) < 1e-12 && x.iter().sum::<f64>().abs() < 1e-12);
        let n = DENSE_MOST + 1;
        let mut x = vec![0.0; n];
        let found = CyclicBandSolver::new(n, 1).solve(&laplacian(n), &vec![1.0; n], &mut x);
        assert!(found == Regularity::Singular && x[0].is_nan());
    }

    #[test]
    fn a_matrix_that_is_not_finite_gives_nan() {
        let mut m = CyclicBand::new(6, 2);
        m.add(3, 1, f64::NAN);
        let mut x = [0.0; 6];
        let found = CyclicBandSolver::new(6, 2).solve(&m, &[1.0; 6], &mut x);
        assert!(found == Regularity::NotFinite && x[0].is_nan());
    }
}
