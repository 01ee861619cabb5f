//! Least squares from sums over the samples, the problem of every identification here.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use lagrangian_motion::parallel::prelude::*;

use crate::dataset::Dataset;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_motion::Result;
use lagrangian_motion::solve::quadratic::Quadratic;

/// Smoothing speeds that are tried, in parts of the smallest root mean square of a velocity.
const SMOOTHING: [f64; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/// The columns of Y: those of the bodies, then viscous friction, then Coulomb friction for each smoothing speed.
pub(super) struct Columns {
    /// The number of columns of the bodies.
    pub(super) bodies: usize,
    n: usize,
    friction: bool,
    /// The smoothing speeds that are tried.
    pub(super) speeds: Vec<f64>,
}

impl Columns {
    /// The columns for these data, with friction if `friction`; its smoothing speed is `smoothing`, or one of those that are tried.
    pub(super) fn new(
        dataset: &Dataset,
        bodies: usize,
        smoothing: Option<f64>,
        friction: bool,
    ) -> Self {
        let speeds = dataset.scaling().qd_scale.into_iter();
        let slowest = speeds.fold(f64::INFINITY, f64::min);
        Self {
            bodies,
            n: dataset.coordinates.dof(),
            friction,
            speeds: match (friction, smoothing) {
                (false, _) => vec![slowest],
                (true, Some(speed)) => vec![speed],
                (true, None) => SMOOTHING.map(|part| part * slowest).to_vec(),
            },
        }
    }

    /// The speeds whose Coulomb friction has columns.
    pub(super) fn friction_speeds(&self) -> &[f64] {
        if self.friction { &self.speeds } else { &[] }
    }

    /// The number of all columns.
    pub(super) fn count(&self) -> usize {
        match self.friction_speeds().len() {
            0 => self.bodies,
            speeds => self.bodies + self.n * (1 + speeds),
        }
    }

    /// The columns with the Coulomb friction of a smoothing speed.
    pub(super) fn of(&self, speed: usize) -> Vec<usize> {
        let (bodies, n) = (self.bodies, self.n);
        let coulomb = bodies + n * (1 + speed);
        match self.friction {
            true => (0..bodies + n).chain(coulomb..coulomb + n).collect(),
            false => (0..bodies).collect(),
        }
    }

    /// Bodies with the friction of these values, viscous coefficients before those of Coulomb.
    pub(super) fn moving<L: Lagrangian>(
        &self,
        bodies: L,
        friction: &[f64],
        speed: usize,
    ) -> Result<Mechanical<L>> {
        if !self.friction {
            return Ok(Mechanical::conservative(bodies));
        }
        let (viscous, coulomb) = friction.split_at(self.n);
        let dissipation = Dissipation {
            viscous: viscous.into(),
            coulomb: coulomb.into(),
            smoothing: vec![self.speeds[speed]; self.n],
            ..Dissipation::default()
        };
        Mechanical::dissipative(bodies, dissipation)
    }
}

/// Parameters and their standard errors.
pub(super) struct Solution {
    pub(super) values: Vec<f64>,
    pub(super) errors: Vec<f64>,
}

/// Added to the diagonal of the system in units of it: combinations that the data do not determine become 0.
const RIDGE: f64 = 1e-13;

/// The number of samples that are processed at a time.
const BLOCK: usize = 1024;

/// The sums over `samples` samples of `weights.len()` rows each: `block` computes the columns of Y and τ of a range of them.
pub(super) fn sums_over(
    samples: usize,
    size: usize,
    weights: &[f64],
    block: impl Fn(std::ops::Range<usize>) -> (Vec<Vec<f64>>, Vec<f64>) + Sync,
) -> Quadratic {
    let starts: Vec<usize> = (0..samples).step_by(BLOCK).collect();
    let sums = |&start: &usize| {
        let (columns, tau) = block(start..(start + BLOCK).min(samples));
        of_columns(&columns, &tau, weights)
    };
    let blocks: Vec<Quadratic> = starts.par_iter().map(sums).collect();
    let mut all = Quadratic::zero(size);
    blocks.iter().for_each(|block| all.add(block, 1.0));
    all
}

/// The sums over weighted rows, given column by column.
fn of_columns(columns: &[Vec<f64>], tau: &[f64], weights: &[f64]) -> Quadratic {
    let (n, size) = (weights.len(), columns.len());
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let rows = a.iter().zip(b).enumerate();
        rows.map(|(k, (a, b))| a * b * weights[k % n].powi(2)).sum()
    };
    let mut sums = Quadratic::zero(size);
    for (k, column) in columns.iter().enumerate() {
        sums.right[k] = product(column, tau);
        for (j, other) in columns[..=k].iter().enumerate() {
            let entry = product(column, other);
            (sums.gram[k * size + j], sums.gram[j * size + k]) = (entry, entry);
        }
    }
    sums.square = product(tau, tau);
    sums.rows = tau.len();
    sums
}

/// The solution over `columns` in which values that must not be negative are 0 where they would be, the worst first. `free`
/// holds the indices of the columns that may differ from 0 at all, and `any_sign` returns for an index whether its value may
/// be negative. `None` where the sums are not finite.
pub(super) fn solve_non_negative(
    sums: &Quadratic,
    columns: &[usize],
    mut free: Vec<usize>,
    any_sign: impl Fn(usize) -> bool,
) -> Option<Solution> {
    let solution = loop {
        let own: Vec<usize> = free.iter().map(|&k| columns[k]).collect();
        let solution = solve(sums, &own)?;
        let negative = free.iter().zip(&solution.values).enumerate();
        let worst = negative
            .filter(|(_, (k, x))| !any_sign(**k) && **x < 0.0)
            .min_by(|a, b| a.1.1.total_cmp(b.1.1));
        match worst {
            Some((at, _)) => free.remove(at),
            None => break solution,
        };
    };
    let place = |of: &[f64]| -> Vec<f64> {
        let value = |k| free.iter().position(|f| *f == k).map_or(0.0, |at| of[at]);
        (0..columns.len()).map(value).collect()
    };
    Some(Solution {
        values: place(&solution.values),
        errors: place(&solution.errors),
    })
}

/// Least squares over these columns alone, scaled to length 1. `None` where the sums are not finite.
fn solve(sums: &Quadratic, columns: &[usize]) -> Option<Solution> {
    let size = columns.len();
    let at = |k: usize, j: usize| sums.row(columns[k])[columns[j]];
    let length = |k| Some(at(k, k).sqrt()).filter(|s| *s > 0.0).unwrap_or(1.0);
    let scale: Vec<f64> = (0..size).map(length).collect();
    let matrix = Mat::from_fn(size, size, |k, j| {
        let ridge = if k == j { RIDGE } else { 0.0 };
        at(k, j) / (scale[k] * scale[j]) + ridge
    });
    let inverse = matrix
        .llt(Side::Lower)
        .ok()?
        .solve(Mat::<f64>::identity(size, size));
    let right: Vec<f64> = (0..size)
        .map(|j| sums.right[columns[j]] / scale[j])
        .collect();
    let value = |k: usize| -> f64 {
        let row = (0..size).map(|j| inverse[(k, j)] * right[j]);
        row.sum::<f64>() / scale[k]
    };
    let values: Vec<f64> = (0..size).map(value).collect();
    let freedom = sums.rows.saturating_sub(size).max(1) as f64;
    let variance = loss(sums, columns, &values) * sums.rows as f64 / freedom;
    let error = |k: usize| (variance * inverse[(k, k)]).sqrt() / scale[k];
    let errors: Vec<f64> = (0..size).map(error).collect();
    let finite = values.iter().chain(&errors).all(|x| x.is_finite());
    finite.then_some(Solution { values, errors })
}

/// Mean of (Y π − τ)², never below 0 by rounding.
pub(super) fn loss(sums: &Quadratic, columns: &[usize], values: &[f64]) -> f64 {
    let terms = columns.iter().copied().zip(values.iter().copied());
    (sums.residual(terms) / sums.rows.max(1) as f64).max(0.0)
}
