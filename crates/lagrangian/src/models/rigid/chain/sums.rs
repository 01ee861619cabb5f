//! Least squares from sums over the samples: what every identification here solves.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Products of Y and τ over weighted samples.
pub(crate) struct Sums {
    size: usize,
    /// `YᵀY`, `[size, size]`, its lower triangle.
    square: Vec<f64>,
    /// `Yᵀτ`, `[size]`.
    right: Vec<f64>,
    /// `τᵀτ`.
    torque: f64,
    /// Numbers in the sums.
    pub(crate) count: usize,
}

/// Parameters and their standard errors.
pub(crate) struct Solution {
    pub(crate) values: Vec<f64>,
    pub(crate) errors: Vec<f64>,
}

/// Added to the diagonal of the system in units of it: what the data do not determine becomes 0.
pub(crate) const RIDGE: f64 = 1e-13;

/// Samples that are worked on at a time.
const BLOCK: usize = 1024;

impl Sums {
    /// Over `samples` samples of `weights.len()` rows each: `block` makes the columns of Y and τ of a range of them.
    pub(crate) fn over(
        samples: usize,
        size: usize,
        weights: &[f64],
        block: impl Fn(std::ops::Range<usize>) -> (Vec<Vec<f64>>, Vec<f64>) + Sync,
    ) -> Self {
        let starts: Vec<usize> = (0..samples).step_by(BLOCK).collect();
        let sums = |&start: &usize| {
            let (columns, tau) = block(start..(start + BLOCK).min(samples));
            let mut sums = Self::zero(size);
            sums.add(&columns, &tau, weights);
            sums
        };
        let blocks: Vec<Self> = starts.par_iter().map(sums).collect();
        blocks.into_iter().fold(Self::zero(size), Self::plus)
    }

    pub(crate) fn zero(size: usize) -> Self {
        Self {
            size,
            square: vec![0.0; size * size],
            right: vec![0.0; size],
            torque: 0.0,
            count: 0,
        }
    }

    pub(crate) fn plus(mut self, other: Self) -> Self {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.square, &other.square);
        add(&mut self.right, &other.right);
        self.torque += other.torque;
        self.count += other.count;
        self
    }

    /// Adds rows, given column by column.
    pub(crate) fn add(&mut self, columns: &[Vec<f64>], tau: &[f64], weights: &[f64]) {
        let n = weights.len();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let rows = a.iter().zip(b).enumerate();
            rows.map(|(k, (a, b))| a * b * weights[k % n].powi(2)).sum()
        };
        for (k, column) in columns.iter().enumerate() {
            self.right[k] += product(column, tau);
            for (j, other) in columns[..=k].iter().enumerate() {
                self.square[k * self.size + j] += product(column, other);
            }
        }
        self.torque += product(tau, tau);
        self.count += tau.len();
    }

    fn at(&self, k: usize, j: usize) -> f64 {
        self.square[k.max(j) * self.size + k.min(j)]
    }

    /// Least squares over these columns alone, with the columns scaled to length 1; what they do not determine is 0.
    pub(crate) fn solve(&self, columns: &[usize]) -> Option<Solution> {
        self.solve_near(columns, &vec![0.0; columns.len()], RIDGE)
    }

    /// The same with a ridge towards `near`: minimises |W (Y π − τ)|² + ρ Σₖ |W yₖ|² (πₖ − nearₖ)², so that a change of
    /// a parameter weighs as much as what it does to the torques (theory.md, 47). `None` where the sums are not finite.
    pub(crate) fn solve_near(
        &self,
        columns: &[usize],
        near: &[f64],
        ridge: f64,
    ) -> Option<Solution> {
        let scale: Vec<f64> = columns
            .iter()
            .map(|&k| {
                Some(self.at(k, k).sqrt())
                    .filter(|s| *s > 0.0)
                    .unwrap_or(1.0)
            })
            .collect();
        let size = columns.len();
        let matrix = Mat::from_fn(size, size, |k, j| {
            let ridge = if k == j { ridge } else { 0.0 };
            self.at(columns[k], columns[j]) / (scale[k] * scale[j]) + ridge
        });
        let inverse = matrix
            .llt(Side::Lower)
            .ok()?
            .solve(Mat::<f64>::identity(size, size));
        let open = |j: usize| -> f64 {
            let known = columns.iter().zip(near);
            let known: f64 = known.map(|(&k, x)| self.at(columns[j], k) * x).sum();
            (self.right[columns[j]] - known) / scale[j]
        };
        let open: Vec<f64> = (0..size).map(open).collect();
        let value = |k: usize| -> f64 {
            let row = (0..size).map(|j| inverse[(k, j)] * open[j]);
            near[k] + row.sum::<f64>() / scale[k]
        };
        let values: Vec<f64> = (0..size).map(value).collect();
        let freedom = self.count.saturating_sub(size).max(1) as f64;
        let variance = self.loss(columns, &values) * self.count as f64 / freedom;
        let error = |k: usize| (variance * inverse[(k, k)]).sqrt() / scale[k];
        let errors: Vec<f64> = (0..size).map(error).collect();
        let finite = values.iter().chain(&errors).all(|x| x.is_finite());
        finite.then_some(Solution { values, errors })
    }

    /// Mean of (Y π − τ)², never below 0 by rounding.
    pub(crate) fn loss(&self, columns: &[usize], values: &[f64]) -> f64 {
        let terms = columns.iter().zip(values);
        let sum: f64 = terms
            .clone()
            .map(|(&k, x)| {
                let row: f64 = terms.clone().map(|(&j, y)| self.at(k, j) * y).sum();
                x * (row - 2.0 * self.right[k])
            })
            .sum();
        ((sum + self.torque) / self.count.max(1) as f64).max(0.0)
    }
}
