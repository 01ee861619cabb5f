//! Valid times of predictions, in Lyapunov times of the true motion.

use lagrangian::rollout::{free, rollout_many};
use lagrangian::score::{THRESHOLD, valid_prediction_time};
use lagrangian::{Model, Result, Rollout, RolloutOptions, State};
use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::median;
use serde::Serialize;

use super::largest_lyapunov_exponent;

/// Time over which errors of the true motion from each start grow e-fold, s, measured over `duration`; `None` for a
/// regular motion.
///
/// # Errors
/// As [`largest_lyapunov_exponent`].
pub fn lyapunov_times(
    truth: &dyn Model,
    starts: &[State],
    duration: f64,
    options: &RolloutOptions,
) -> Result<Vec<Option<f64>>> {
    let time = |start| Ok(largest_lyapunov_exponent(truth, start, duration, options)?.time());
    starts.par_iter().map(time).collect()
}

/// True motions from starts that are displaced by `distance`: the limit of any model's predictions.
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
    let mut moved = starts.to_vec();
    let coordinates = moved.iter_mut().flat_map(|start| &mut start.q);
    coordinates.for_each(|q| *q += distance);
    rollout_many(truth, &moved, times, &free, options)
}

/// Valid times of predictions, separately for chaotic and regular motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValidTimes {
    /// Number of chaotic starts.
    pub chaotic: usize,
    /// Median valid time of chaotic starts, s; at most the duration.
    pub chaotic_seconds: f64,
    /// Median valid time of chaotic starts in Lyapunov times.
    pub chaotic_lyapunov_times: f64,
    /// Number of regular starts.
    pub regular: usize,
    /// Median valid time of regular starts, s; at most the duration.
    pub regular_seconds: f64,
}

/// Valid prediction times of `predictions` against `truth`, start by start, with the [`lyapunov_times`] of the starts.
///
/// # Errors
/// As [`valid_prediction_time`].
pub fn valid_times(
    model: &dyn Model,
    truth: &[Rollout],
    predictions: &[Rollout],
    lyapunov_times: &[Option<f64>],
) -> Result<ValidTimes> {
    let (mut chaotic, mut scaled, mut regular) = (Vec::new(), Vec::new(), Vec::new());
    let coordinates = model.coordinates();
    for ((truth, prediction), time) in truth.iter().zip(predictions).zip(lyapunov_times) {
        let (truth, prediction) = (&truth.trajectory, &prediction.trajectory);
        let valid = valid_prediction_time(truth, prediction, coordinates, THRESHOLD)?.seconds;
        match time {
            Some(time) => {
                chaotic.push(valid);
                scaled.push(valid / time);
            }
            None => regular.push(valid),
        }
    }
    Ok(ValidTimes {
        chaotic: chaotic.len(),
        chaotic_seconds: median(chaotic),
        chaotic_lyapunov_times: median(scaled),
        regular: regular.len(),
        regular_seconds: median(regular),
    })
}
