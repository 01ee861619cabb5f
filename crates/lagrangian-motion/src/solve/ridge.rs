//! Normal equations whose unknowns differ in units.

use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

/// The Cholesky factor of S⁻¹ A S⁻¹ + ρ 1 for a symmetric A and the scales S of its rows, which give columns of unit length, with a
/// ridge ρ in units of their squares.
pub struct Ridge {
    factor: Llt<f64>,
    scale: Vec<f64>,
}

impl Ridge {
    /// The factor of A, by its entries, with these scales; `None` if it is not positive definite.
    pub fn new(a: impl Fn(usize, usize) -> f64, scale: Vec<f64>, ridge: f64) -> Option<Self> {
        let size = scale.len();
        let matrix = Mat::from_fn(size, size, |k, j| {
            let ridge = if k == j { ridge } else { 0.0 };
            a(k, j) / (scale[k] * scale[j]) + ridge
        });
        let factor = matrix.llt(Side::Lower).ok()?;
        Some(Self { factor, scale })
    }

    /// The solutions x of A x = b for `columns` right sides, by their entries, `[size, columns]`.
    pub fn solve(&self, columns: usize, b: impl Fn(usize, usize) -> f64) -> Mat<f64> {
        let (size, scale) = (self.scale.len(), &self.scale);
        let right = Mat::from_fn(size, columns, |k, c| b(k, c) / scale[k]);
        let solved = self.factor.solve(right);
        Mat::from_fn(size, columns, |k, c| solved[(k, c)] / scale[k])
    }

    /// The solution of A x = b for one right side; `None` if it is not finite.
    pub fn solve_one(&self, b: impl Fn(usize) -> f64) -> Option<Vec<f64>> {
        let x = self.solve(1, |k, _| b(k));
        let x: Vec<f64> = (0..self.scale.len()).map(|k| x[(k, 0)]).collect();
        x.iter().all(|x| x.is_finite()).then_some(x)
    }
}

/// Square roots of the diagonal of A, bounded below by the square root of `least`.
pub fn scales(size: usize, diagonal: impl Fn(usize) -> f64, least: f64) -> Vec<f64> {
    (0..size).map(|k| diagonal(k).max(least).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_of_units_ten_decades_apart_are_found_as_well_as_alike_ones() {
        let units = [1e-5, 1.0, 1e5];
        let plain = [4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 2.0];
        let a = |k: usize, j: usize| plain[k * 3 + j] * units[k] * units[j];
        let truth = [1.0, -2.0, 3.0];
        let b = |k: usize| (0..3).map(|j| a(k, j) * truth[j] / units[j]).sum::<f64>();
        let ridge = Ridge::new(a, scales(3, |k| a(k, k), 0.0), 0.0);
        let found = ridge
            .and_then(|ridge| ridge.solve_one(b))
            .unwrap_or_default();
        assert_eq!(found.len(), 3);
        for ((x, truth), unit) in found.iter().zip(truth).zip(units) {
            assert!((x * unit - truth).abs() < 1e-12, "{found:?}");
        }
        let indefinite = |k: usize, j: usize| if k == j { 1.0 } else { 2.0 };
        assert!(Ridge::new(indefinite, vec![1.0; 2], 0.0).is_none());
    }
}
