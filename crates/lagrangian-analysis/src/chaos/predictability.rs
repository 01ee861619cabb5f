//! How long predictions stay valid, in Lyapunov times of the true motion.

use lagrangian::rollout::{free, rollout_many};
use lagrangian::score::valid_prediction_time;
use lagrangian::{Model, Result, Rollout, RolloutOptions, State};
use rayon::prelude::*;
use serde::Serialize;

use super::{Motion, largest_lyapunov_exponent};

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
    let moved = |start: &State| {
        let q = start.q.iter().map(|q| q + distance).collect();
        State::new(q, start.qd.clone())
    };
    let moved: Vec<State> = starts.iter().map(moved).collect();
    rollout_many(truth, &moved, times, &free, options)
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

fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}
