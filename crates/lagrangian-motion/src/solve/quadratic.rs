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
    }
}
