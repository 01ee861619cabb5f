//! The uncertainty that the fit of a servo leaves.
//!
//! With ψ the derivative of the robust loss and w its weight, H = Σ w `JᵀJ` over all simulations is the Gauss–Newton Hessian, and the
//! covariance of the parameters H⁻¹ B H⁻¹. B is the scatter of the gradient: of N successive residuals N/κ are independent (theory.md,
//! 47a), and the S lengths of simulations use the same motions, so that B = S Σ κ ⟨ψ²⟩/⟨w⟩ H over the lengths. The ridge that
//! ties parameters to their start is part of both.

use faer::Mat;
use lagrangian_motion::parallel::prelude::*;

use super::{LANES, RIDGE, Shooting, Stage};
use crate::models::correlation::correlation;
use crate::models::servo::motion::Recorded;
use crate::models::servo::parameters::{Layout, variables};
use crate::models::servo::quantities::quantities;
use lagrangian_mechanics::forces::Sensitive;
use lagrangian_mechanics::rigid::consistent;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::{dot, product};

/// The standard errors of all [`quantities`] of a machine that was fitted to these motions by simulations of these lengths; 0 for those
/// that were not fitted. A quantity that the motions do not determine, such as a limit that is never reached, is as wide as the ridge.
pub(crate) fn standard_errors(
    layout: Layout,
    motions: &[&Recorded],
    stages: &[Stage],
    parameters: &[f64],
) -> Vec<f64> {
    let machine = layout.machine::<f64>(parameters);
    let nothing = || vec![0.0; quantities(&machine).len()];
    if parameters.len() != layout.len() {
        return nothing();
    }
    let covariance = covariance(layout, motions, stages, parameters);
    let jacobian = jacobian(layout, parameters);
    let error = |row: &[f64]| {
        let columns = covariance.chunks_exact(row.len());
        let spread: Vec<f64> = columns.map(|column| dot(column, row)).collect();
        dot(&spread, row).sqrt()
    };
    let errors: Vec<f64> = jacobian.chunks_exact(parameters.len()).map(error).collect();
    match errors.iter().all(|e| e.is_finite()) {
        true => errors,
        false => nothing(),
    }
}

/// The derivatives of all quantities by the parameters, a row each.
fn jacobian(layout: Layout, parameters: &[f64]) -> Vec<f64> {
    let len = parameters.len();
    let mut rows = Vec::new();
    for first in (0..len).step_by(LANES) {
        let machine = layout.machine(&variables::<LANES>(parameters, first));
        let lanes = LANES.min(len - first);
        for (k, quantity) in quantities::<Sensitive<LANES>>(&machine).iter().enumerate() {
            if first == 0 {
                rows.resize(rows.len() + len, 0.0);
            }
            rows[k * len + first..][..lanes].copy_from_slice(&quantity.value.slope[..lanes]);
        }
    }
    rows
}

/// The covariance of the parameters, `[len, len]`.
fn covariance(
    layout: Layout,
    motions: &[&Recorded],
    stages: &[Stage],
    parameters: &[f64],
) -> Vec<f64> {
    let len = parameters.len();
    let (mut hessian, mut scatter) = (vec![0.0; len * len], vec![0.0; len * len]);
    let (mut count, mut spread) = (0.0, 0.0);
    for stage in stages {
        let (normal, ratio) = Shooting::new(layout, motions, &[*stage]).information(parameters);
        let ratio = stages.len() as f64 * ratio;
        for ((h, b), own) in hessian.iter_mut().zip(&mut scatter).zip(normal.gram) {
            *h += own;
            *b += ratio * own;
        }
        count += normal.rows as f64;
        spread += ratio * normal.rows as f64;
    }
    for k in 0..len {
        hessian[k * (len + 1)] += RIDGE * count;
        scatter[k * (len + 1)] += RIDGE * spread;
    }
    let inverse = consistent::covariance(&Mat::from_fn(len, len, |k, j| hessian[k * len + j]));
    let inverse: Vec<f64> = (0..len * len)
        .map(|kj| inverse[(kj / len, kj % len)])
        .collect();
    product(&product(&inverse, &scatter, len), &inverse, len)
}

impl Shooting<'_> {
    /// The Gauss–Newton Hessian of all residuals of one length, and the ratio of the scatter of its gradient to it.
    fn information(&self, parameters: &[f64]) -> (Quadratic, f64) {
        let (len, n) = (parameters.len(), self.layout.n);
        let each = |segment| self.part(segment, parameters);
        let parts: Vec<(Quadratic, Vec<f64>)> = self.segments.par_iter().map(each).collect();
        let mut all = Quadratic::zero(len);
        let (mut residuals, mut runs) = (Vec::new(), Vec::new());
        for (normal, own) in &parts {
            all.add(normal, 1.0);
            let first = residuals.len() / n;
            residuals.extend(own.iter().map(|x| x / (1.0 + x * x).sqrt()));
            runs.push(first..residuals.len() / n);
        }
        let joint = |j: usize| {
            let own: Vec<f64> = residuals.iter().skip(j).step_by(n).copied().collect();
            correlation(&own, &runs)
        };
        let memory = (0..n).map(joint).fold(1.0, f64::max);
        // ψ = w x with w = 1/√(1 + x²), so that w² = 1 − ψ².
        let squares: f64 = residuals.iter().map(|x| x * x).sum();
        let weights: f64 = residuals
            .iter()
            .map(|x| (1.0 - x * x).max(0.0).sqrt())
            .sum();
        (all, memory * squares / weights.max(f64::MIN_POSITIVE))
    }
}
