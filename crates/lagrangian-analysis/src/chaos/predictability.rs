//! Valid times of predictions, in Lyapunov times of the true motion.

use lagrangian::rollout::{free, rollout_many};
use lagrangian::score::{THRESHOLD, valid_prediction_time};
use lagrangian::{Model, Result, Rollout, RolloutOptions, State};
use rayon::prelude::*;
use serde::Serialize;

use super::largest_lyapunov_exponent;

/// The time over which errors of the true motion from each start grow e-fold, s, measured over `duration`; none where the
/// motion is regular.
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

/// The true motions from starts that are moved by `distance`: the limit of what any model can predict.
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

/// Valid times of predictions, chaotic and regular motions apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValidTimes {
    /// The number of chaotic starts.
    pub chaotic: usize,
    /// The median valid time of chaotic starts, s; at most the duration.
    pub chaotic_seconds: f64,
    /// The median valid time of chaotic starts in Lyapunov times.
    pub chaotic_lyapunov_times: f64,
    /// The number of regular starts.
    pub regular: usize,
    /// The median valid time of regular starts, s; at most the duration.
    pub regular_seconds: f64,
}

/// Valid prediction times of `predictions` against `truth`, start by start, beside the [`lyapunov_times`] of the starts.
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

fn median(mut sorted: Vec<f64>) -> f64 {
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}
