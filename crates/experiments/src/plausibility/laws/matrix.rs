//! The mass matrix of a model that shows its dynamics alone.

use faer::{Mat, Side};

use super::{Row, dot};
use lagrangian::Evaluator;

/// Step of the differences over torques, N·m.
const TORQUE: f64 = 1e-3;

/// A mass matrix or its inverse, as a model shows it, `[n, n]`.
pub(super) struct Matrix {
    n: usize,
    values: Vec<f64>,
    /// Whether it is M⁻¹.
    pub(super) inverse: bool,
}

impl Matrix {
    pub(super) fn of(evaluator: &mut dyn Evaluator, moves: bool, row: Row) -> Self {
        let n = row.q.len();
        let by_torque = Self::by_torque(evaluator, row, row.qd);
        let by_acceleration = || moves.then(|| Self::by_acceleration(evaluator, row));
        by_torque.or_else(by_acceleration).unwrap_or(Self {
            n,
            values: vec![f64::NAN; n * n],
            inverse: false,
        })
    }

    /// Column i is τ(q, q̇, eᵢ) − τ(q, q̇, 0).
    pub(super) fn by_torque(evaluator: &mut dyn Evaluator, row: Row, qd: &[f64]) -> Option<Self> {
        let n = row.q.len();
        let mut bias = vec![0.0; n];
        let still = vec![0.0; n];
        let outcome = evaluator.inverse_dynamics(row.q, qd, &still, &mut bias);
        if !outcome.is_supported() {
            return None;
        }
        let mut values = vec![0.0; n * n];
        for i in 0..n {
            let (mut unit, mut tau) = (vec![0.0; n], vec![0.0; n]);
            unit[i] = 1.0;
            let _ = evaluator.inverse_dynamics(row.q, qd, &unit, &mut tau);
            (0..n).for_each(|k| values[k * n + i] = tau[k] - bias[k]);
        }
        Some(Self {
            n,
            values,
            inverse: false,
        })
    }

    /// Column i is ∂q̈/∂τᵢ, by central differences.
    pub(super) fn by_acceleration(evaluator: &mut dyn Evaluator, row: Row) -> Self {
        let n = row.q.len();
        let mut values = vec![0.0; n * n];
        for i in 0..n {
            let mut at = |step: f64| {
                let (mut tau, mut qdd) = (row.tau.to_vec(), vec![0.0; n]);
                tau[i] += step;
                let _ = evaluator.forward_dynamics(row.q, row.qd, &tau, &mut qdd);
                qdd
            };
            let (above, below) = (at(TORQUE), at(-TORQUE));
            (0..n).for_each(|k| values[k * n + i] = (above[k] - below[k]) / (2.0 * TORQUE));
        }
        Self {
            n,
            values,
            inverse: true,
        }
    }

    pub(super) fn asymmetry(&self) -> f64 {
        let at = |i: usize, j: usize| self.values[i * self.n + j];
        let pairs = || (0..self.n).flat_map(|i| (0..self.n).map(move |j| (i, j)));
        let apart: f64 = pairs().map(|(i, j)| (at(i, j) - at(j, i)).powi(2)).sum();
        let size: f64 = self.values.iter().map(|x| x * x).sum();
        (apart / size).sqrt()
    }

    /// Of the symmetric part; NaN where there is none.
    pub(super) fn smallest_eigenvalue(&self) -> f64 {
        let at = |i: usize, j: usize| self.values[i * self.n + j];
        let symmetric = Mat::from_fn(self.n, self.n, |i, j| 0.5 * (at(i, j) + at(j, i)));
        let values = symmetric.self_adjoint_eigenvalues(Side::Lower);
        let smallest = values.ok().and_then(|x| x.into_iter().reduce(f64::min));
        smallest.unwrap_or(f64::NAN)
    }

    /// vᵀ M v.
    pub(super) fn quadratic(&self, v: &[f64]) -> f64 {
        self.values
            .chunks_exact(self.n)
            .zip(v)
            .map(|(row, x)| x * dot(row, v))
            .sum()
    }
}
