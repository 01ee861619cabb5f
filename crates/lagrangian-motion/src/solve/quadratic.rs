//! Sums of least-squares problems, the normal equations.

use super::{SymmetricSolver, dot};

/// Sums over the rows of a least-squares problem Y x ≈ y, or their means (theory.md, 45).
#[derive(Debug, Clone, PartialEq)]
pub struct Quadratic {
    /// `YᵀY`, `[K, K]`, row-major, both triangles.
    pub gram: Vec<f64>,
    /// Yᵀy, `[K]`.
    pub right: Vec<f64>,
    /// yᵀy.
    pub square: f64,
    /// The number of rows.
    pub rows: usize,
}

impl Quadratic {
    /// Empty sums for `size` unknowns.
    #[must_use]
    pub fn zero(size: usize) -> Self {
        Self {
            gram: vec![0.0; size * size],
            right: vec![0.0; size],
            square: 0.0,
            rows: 0,
        }
    }

    /// The number of unknowns, K.
    #[must_use]
    pub fn size(&self) -> usize {
        self.right.len()
    }

    /// Row k of `YᵀY`, `[K]`.
    #[must_use]
    pub fn row(&self, k: usize) -> &[f64] {
        &self.gram[k * self.size()..][..self.size()]
    }

    /// Adds a row of Y and y.
    pub fn add_row(&mut self, row: &[f64], y: f64) {
        let squares = self.gram.chunks_exact_mut(row.len().max(1));
        for ((x, right), squares) in row.iter().zip(&mut self.right).zip(squares) {
            *right += x * y;
            let pairs = squares.iter_mut().zip(row);
            pairs.for_each(|(sum, other)| *sum += x * other);
        }
        self.square += y * y;
        self.rows += 1;
    }

    /// Adds `factor` times the sums over other rows.
    pub fn add(&mut self, other: &Self, factor: f64) {
        let add = |to: &mut [f64], from: &[f64]| {
            let pairs = to.iter_mut().zip(from);
            pairs.for_each(|(to, from)| *to += factor * from);
        };
        add(&mut self.gram, &other.gram);
        add(&mut self.right, &other.right);
        self.square += factor * other.square;
        self.rows += other.rows;
    }

    /// ‖Y x − y‖² of the unknowns with these indices and values, the others being 0.
    pub fn residual(&self, terms: impl Iterator<Item = (usize, f64)> + Clone) -> f64 {
        let of_row = |(k, x): (usize, f64)| {
            let row = self.row(k);
            let sum: f64 = terms.clone().map(|(j, y)| row[j] * y).sum();
            x * (sum - 2.0 * self.right[k])
        };
        terms.clone().map(of_row).sum::<f64>() + self.square
    }

    /// ‖Y x − y‖², never below 0 by rounding.
    #[must_use]
    pub fn loss(&self, x: &[f64]) -> f64 {
        let terms = x.iter().zip(&self.right).enumerate();
        let sum: f64 = terms
            .map(|(k, (x_k, right))| x_k * (dot(self.row(k), x) - 2.0 * right))
            .sum();
        (sum + self.square).max(0.0)
    }

    /// What these sums tell once the unknowns from `first` on have changed by independent amounts of precisions `given` (one over the
    /// variance, in the units of the sums), which are not known: the old values are eliminated.
    #[must_use]
    pub fn loosened(&self, first: usize, given: &[f64]) -> Self {
        let (size, m) = (self.size(), given.len());
        let mut old = vec![0.0; m * m];
        for i in 0..m {
            old[i * m..][..m].copy_from_slice(&self.row(first + i)[first..first + m]);
            old[i * m + i] += given[i];
        }
        // The coefficients of the unknowns as they are now: those that changed, tied to their old values, and the others.
        let coupling = |k: usize| match (first..first + m).contains(&k) {
            true => {
                let own = |i: usize| if first + i == k { -given[i] } else { 0.0 };
                (0..m).map(own).collect()
            }
            false => self.row(k)[first..first + m].to_vec(),
        };
        let couplings: Vec<Vec<f64>> = (0..size).map(coupling).collect();
        let right = &self.right[first..first + m];
        let (mut solver, mut solved) = (SymmetricSolver::new(m), vec![0.0; m]);
        let mut next = self.clone();
        for k in first..first + m {
            for i in 0..size {
                next.gram[k * size + i] = 0.0;
                next.gram[i * size + k] = 0.0;
            }
            next.gram[k * size + k] = given[k - first];
            next.right[k] = 0.0;
        }
        let _ = solver.solve(&old, right, &mut solved);
        next.square -= dot(&solved, right);
        let of_right = solved.clone();
        let rows = next.gram.chunks_exact_mut(size.max(1));
        for ((row, sum), own) in rows.zip(&mut next.right).zip(&couplings) {
            *sum -= dot(&of_right, own);
            let _ = solver.solve(&old, own, &mut solved);
            let pairs = row.iter_mut().zip(&couplings);
            pairs.for_each(|(sum, other)| *sum -= dot(&solved, other));
        }
        next
    }

    /// The x that minimises ‖Y x − y‖², by the rules of [`SymmetricSolver::solve`].
    #[must_use]
    pub fn solution(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.size()];
        let _ = SymmetricSolver::new(self.size()).solve(&self.gram, &self.right, &mut x);
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_has_the_smallest_sum_of_squares_and_sums_add_up() {
        let rows = [([1.0, 2.0], 3.0), ([0.5, -1.0], 0.2), ([2.0, 0.1], 1.1)];
        let [mut all, mut halves] = [(); 2].map(|()| Quadratic::zero(2));
        for (row, y) in rows {
            all.add_row(&row, y);
            let mut one = Quadratic::zero(2);
            one.add_row(&row, y);
            halves.add(&one, 0.5);
        }
        let x = all.solution();
        let squares = |x: &[f64]| {
            let each = rows.iter().map(|(row, y)| (dot(row, x) - y).powi(2));
            each.sum::<f64>()
        };
        assert!((all.loss(&x) - squares(&x)).abs() < 1e-14);
        assert!((all.residual(x.iter().copied().enumerate()) - squares(&x)).abs() < 1e-14);
        assert!((halves.loss(&x) - 0.5 * squares(&x)).abs() < 1e-14);
        for moved in [[x[0] + 0.1, x[1]], [x[0], x[1] - 0.1]] {
            assert!(squares(&moved) > squares(&x));
        }
        assert_eq!((all.size(), halves.rows), (2, 3));
        // A second unknown that changed by anything leaves the first what it was; one that cannot have changed leaves all as it was.
        let first = all.loosened(1, &[1e-12]);
        assert!((first.right[0] / first.gram[0] - x[0]).abs() < 1e-8);
        assert!((first.loss(&[x[0], 7.0]) - all.loss(&x)).abs() < 1e-8);
        let same = all.loosened(1, &[1e12]);
        for moved in [[x[0], x[1]], [x[0] + 0.1, x[1] - 0.3]] {
            assert!((same.loss(&moved) - all.loss(&moved)).abs() < 1e-3);
        }
    }
}
