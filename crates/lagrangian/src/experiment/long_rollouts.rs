//! Measurements that models are compared by: energy kept over long rollouts, and how long predictions stay valid.
//!
//! The protocol of the double pendulum is that of Cranmer et al. 2020 (arXiv 2003.04630): states anywhere, rollouts
//! of 100 s from rest, the true energy at the end against the true energy at the start.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::chaos::{Motion, largest_lyapunov_exponent, valid_prediction_time};
use crate::dataset::Dataset;
use crate::dynamics::Model;
use crate::lagrangian::analytic::AnalyticModel;
use crate::rollout::{Rollout, RolloutOptions, free, rollout_many};
use crate::train::Samples;
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
        let mut samples = Samples {
            n,
            tau: vec![0.0; m * n],
            qdd: vec![0.0; m * n],
            ..Samples::default()
        };
        for _ in 0..m {
            let state = system.sample_state(&mut rng);
            samples.q.extend(state.q);
            samples.qd.extend(state.qd);
        }
        let Samples {
            q, qd, qdd, tau, ..
        } = &mut samples;
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

/// How predictable the true motion from one start is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Predictability {
    /// The time over which errors grow e-fold, s; none where the motion is regular.
    pub lyapunov_time: Option<f64>,
}

/// Lyapunov times of the true motion from each start, measured over `duration`.
///
/// # Errors
/// As [`largest_lyapunov_exponent`].
pub fn predictability(
    truth: &dyn Model,
    starts: &[State],
    duration: f64,
    options: &RolloutOptions,
) -> Result<Vec<Predictability>> {
    let one = |start: &State| {
        let found = largest_lyapunov_exponent(truth, start, duration, options)?;
        Ok(Predictability {
            lyapunov_time: found.time().filter(|_| found.motion == Motion::Chaotic),
        })
    };
    starts.par_iter().map(one).collect()
}

/// How long predictions stay valid, chaotic and regular motions apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValidTimes {
    /// Chaotic starts.
    pub chaotic: usize,
    /// Their median valid time, s; at most the duration.
    pub chaotic_seconds: f64,
    /// Their median valid time in Lyapunov times.
    pub chaotic_lyapunov_times: f64,
    /// Regular starts.
    pub regular: usize,
    /// Their median valid time, s; at most the duration.
    pub regular_seconds: f64,
}

/// The error, in deviations of the motion, beyond which a prediction is no longer valid.
const THRESHOLD: f64 = 0.5;

/// Valid prediction times of `predictions` against `truth`, start by start.
///
/// # Errors
/// As [`valid_prediction_time`].
pub fn valid_times(
    model: &dyn Model,
    truth: &[Rollout],
    predictions: &[Rollout],
    predictability: &[Predictability],
) -> Result<ValidTimes> {
    let (mut chaotic, mut scaled, mut regular) = (Vec::new(), Vec::new(), Vec::new());
    for ((truth, prediction), start) in truth.iter().zip(predictions).zip(predictability) {
        let coordinates = model.coordinates();
        let valid = valid_prediction_time(
            &truth.trajectory,
            &prediction.trajectory,
            coordinates,
            THRESHOLD,
        )?
        .seconds;
        match start.lyapunov_time {
            Some(time) => {
                chaotic.push(valid);
                scaled.push(valid / time);
            }
            None => regular.push(valid),
        }
    }
    for list in [&mut chaotic, &mut scaled, &mut regular] {
        list.sort_by(f64::total_cmp);
    }
    Ok(ValidTimes {
        chaotic: chaotic.len(),
        chaotic_seconds: median(&chaotic),
        chaotic_lyapunov_times: median(&scaled),
        regular: regular.len(),
        regular_seconds: median(&regular),
    })
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
