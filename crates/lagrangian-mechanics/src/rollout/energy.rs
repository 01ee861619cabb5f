//! Energy conservation of rollouts.
//!
//! The protocol of the double pendulum is that of Cranmer et al. 2020 (arXiv 2003.04630): rollouts of 100 s from rest, the
//! true energy at the end against the true energy at the start.

use serde::Serialize;

use super::Rollout;
use crate::dynamics::Model;
use lagrangian_motion::Trajectory;
use lagrangian_motion::statistics::median;

/// Errors of the true energy in free rollouts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnergyTest {
    /// |E(end) − E(start)| in percent of the reference energy, one value for each finished rollout.
    pub percent: Vec<f64>,
    /// Mean of the values.
    pub mean: f64,
    /// Median of the values.
    pub median: f64,
    /// Largest value.
    pub worst: f64,
    /// Number of rollouts that did not reach the end; they are excluded from the values.
    pub unfinished: usize,
}

/// Energy test of `rollouts` by the energy of `truth`; `reference` is the energy that counts as 100 %, J.
pub fn energy_test(truth: &dyn Model, rollouts: &[Rollout], reference: f64) -> EnergyTest {
    let finished = rollouts.iter().filter(|r| r.outcome.is_finished());
    let percent: Vec<f64> = finished
        .filter_map(|rollout| {
            energy_error(truth, &rollout.trajectory, reference)
                .last()
                .copied()
        })
        .map(f64::abs)
        .collect();
    EnergyTest {
        mean: percent.iter().sum::<f64>() / percent.len() as f64,
        median: median(percent.clone()),
        worst: percent
            .iter()
            .copied()
            .max_by(f64::total_cmp)
            .unwrap_or(f64::NAN),
        unfinished: rollouts.len() - percent.len(),
        percent,
    }
}

/// (E(t) − E(0)) / `reference` along a trajectory, in percent, with the energy of `truth`; empty where it has no energy.
#[must_use]
pub fn energy_error(truth: &dyn Model, trajectory: &Trajectory, reference: f64) -> Vec<f64> {
    let mut energy = vec![0.0; trajectory.len()];
    let mut evaluator = truth.evaluator();
    let outcome = evaluator.energy(&trajectory.q, &trajectory.qd, &mut energy);
    if !outcome.is_supported() {
        return Vec::new();
    }
    let start = energy.first().copied().unwrap_or(0.0);
    energy
        .iter()
        .map(|e| 100.0 * (e - start) / reference)
        .collect()
}
