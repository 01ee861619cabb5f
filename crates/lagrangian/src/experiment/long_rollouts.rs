//! Measurements that models are compared by: energy kept over long rollouts.
//!
//! The protocol of the double pendulum is that of Cranmer et al. 2020 (arXiv 2003.04630): states anywhere, rollouts
//! of 100 s from rest, the true energy at the end against the true energy at the start.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::dataset::Dataset;
use crate::dynamics::Model;
use crate::lagrangian::analytic::AnalyticModel;
use crate::rollout::{Rollout, RolloutOptions, free, rollout_many};
use crate::train::Samples;
use crate::trajectory::Signals;
use crate::{Result, State, Trajectory};

/// `train` and `validation` random states of a known system with their true accelerations.
///
/// # Errors
/// As [`Dataset::from_samples`].
pub fn random_states(
    system: &dyn AnalyticModel,
    train: usize,
    validation: usize,
    seed: u64,
) -> Result<Dataset> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = |m: usize| {
        let n = system.coordinates().dof();
        let mut samples = Samples::new(
            n,
            Signals {
                tau: vec![0.0; m * n],
                qdd: vec![0.0; m * n],
                ..Signals::default()
            },
        );
        for _ in 0..m {
            let state = system.sample_state(&mut rng);
            samples.q.extend(state.q);
            samples.qd.extend(state.qd);
        }
        let Signals {
            q, qd, qdd, tau, ..
        } = &mut samples.signals;
        system.evaluator().forward_dynamics(q, qd, tau, qdd);
        samples
    };
    let (train, validation) = (samples(train), samples(validation));
    Dataset::from_samples(system.coordinates().clone(), train, validation)
}

/// Starts of the rollouts that models of this system are tested by.
#[must_use]
pub fn random_starts(system: &dyn AnalyticModel, count: usize, seed: u64) -> Vec<State> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| system.sample_start(&mut rng)).collect()
}

/// How well free rollouts keep the true energy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnergyTest {
    /// |E(end) − E(start)| in percent of the reference energy, one figure a finished rollout.
    pub percent: Vec<f64>,
    /// Their mean.
    pub mean: f64,
    /// Their median.
    pub median: f64,
    /// The worst.
    pub worst: f64,
    /// Rollouts that did not reach the end; they are in none of the figures.
    pub unfinished: usize,
}

/// The energy test of `rollouts` by the energy of `truth`; `reference` is the energy that counts as 100 %, J.
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
    let mut sorted = percent.clone();
    sorted.sort_by(f64::total_cmp);
    EnergyTest {
        mean: percent.iter().sum::<f64>() / percent.len() as f64,
        median: median(&sorted),
        worst: sorted.last().copied().unwrap_or(f64::NAN),
        unfinished: rollouts.len() - percent.len(),
        percent,
    }
}

/// (E(t) − E(0)) / `reference` along a trajectory, in percent, with the energy of `truth`; empty where it has none.
#[must_use]
pub fn energy_error(truth: &dyn Model, trajectory: &Trajectory, reference: f64) -> Vec<f64> {
    let mut energy = vec![0.0; trajectory.len()];
    if !truth
        .evaluator()
        .energy(&trajectory.q, &trajectory.qd, &mut energy)
    {
        return Vec::new();
    }
    let start = energy.first().copied().unwrap_or(0.0);
    energy
        .iter()
        .map(|e| 100.0 * (e - start) / reference)
        .collect()
}

/// The true motion from starts that are moved by `distance`: the limit of what any model can predict.
///
/// # Errors
/// As [`rollout_many`].
pub fn restarted(
    truth: &dyn Model,
    starts: &[State],
    distance: f64,
    times: &[f64],
    options: &RolloutOptions,
) -> Result<Vec<Rollout>> {
    let moved: Vec<State> = starts
        .iter()
        .map(|start| {
            State::new(
                start.q.iter().map(|q| q + distance).collect(),
                start.qd.clone(),
            )
        })
        .collect();
    rollout_many(truth, &moved, times, &free, options)
}

fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}
