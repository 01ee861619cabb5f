//! Predictions over short times, one after another.

use rayon::prelude::*;
use serde::Serialize;

use super::{bounded, predict};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{Rollout, RolloutOptions};
use lagrangian_motion::{Coordinates, Result, Trajectory};

/// Lengths of the short predictions, s.
pub const RESTARTS: [f64; 2] = [0.5, 1.0];

/// Predictions over short times, from the state that was measured at the start of each.
///
/// For a driven or chaotic machine, a long prediction shows the time until it fails, short ones the error until then.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestartScore {
    /// Time from one start to the next, and length of each prediction, s.
    pub seconds: f64,
    /// The number of predictions.
    pub starts: usize,
    /// The number of predictions that diverged; they are omitted from all errors.
    pub unfinished: usize,
    /// Root mean square error of q over all samples of the predictions, `[n]`, in the unit of q; on the circle for
    /// angles.
    pub q_rms: Vec<f64>,
    /// Root mean square error of q at the ends of the predictions alone, `[n]`.
    pub q_rms_end: Vec<f64>,
}

/// The short predictions, and the number of them that were stopped.
pub(super) fn restarts(
    model: &dyn Model,
    trajectories: &[Trajectory],
    options: &RolloutOptions,
) -> Result<(Vec<RestartScore>, usize)> {
    let scores = RESTARTS.map(|seconds| restart_counted(model, trajectories, seconds, options));
    let scores: Vec<(RestartScore, usize)> = scores.into_iter().collect::<Result<_>>()?;
    let stopped = scores.iter().map(|(_, stopped)| stopped).sum();
    let scores = scores.into_iter().map(|(score, _)| score);
    Ok((scores.filter(|s| s.starts > 0).collect(), stopped))
}

/// A prediction every `seconds`, of that length.
///
/// # Errors
/// As [`score`](crate::score()).
pub fn restart(
    model: &dyn Model,
    trajectories: &[Trajectory],
    seconds: f64,
    options: &RolloutOptions,
) -> Result<RestartScore> {
    restart_counted(model, trajectories, seconds, options).map(|(score, _)| score)
}

/// [`restart`], and the number of its predictions that were stopped, which it omits.
fn restart_counted(
    model: &dyn Model,
    trajectories: &[Trajectory],
    seconds: f64,
    options: &RolloutOptions,
) -> Result<(RestartScore, usize)> {
    let windows: Vec<Trajectory> = trajectories
        .iter()
        .flat_map(|t| windows(t, seconds))
        .collect();
    let count = windows.len();
    let predict = |truth: &Trajectory| match options.stop.is_asked() {
        true => Ok(None),
        false => predict(model, truth, &bounded(options, truth, count)).map(Some),
    };
    let predictions = windows.par_iter().map(predict);
    let predictions: Vec<Option<Rollout>> = predictions.collect::<Result<_>>()?;
    let n = model.coordinates().dof();
    let (mut all, mut ends) = (Squares::new(n), Squares::new(n));
    let (mut unfinished, mut stopped) = (0, 0);
    for (truth, prediction) in windows.iter().zip(&predictions) {
        let Some(prediction) = prediction.as_ref().filter(|p| !p.outcome.is_stopped()) else {
            stopped += 1;
            continue;
        };
        if !prediction.outcome.is_finished() {
            unfinished += 1;
            continue;
        }
        let predicted = &prediction.trajectory.q;
        all.add(model.coordinates(), &truth.q, predicted);
        let last = truth.q.len() - n;
        ends.add(model.coordinates(), &truth.q[last..], &predicted[last..]);
    }
    let score = RestartScore {
        seconds,
        starts: windows.len() - stopped,
        unfinished,
        q_rms: all.root_mean(),
        q_rms_end: ends.root_mean(),
    };
    Ok((score, stopped))
}

/// Pieces of this length, one after another; a shorter rest is omitted, and so is a piece with a gap.
pub(super) fn windows(t: &Trajectory, seconds: f64) -> Vec<Trajectory> {
    let (Some(first), Some(last)) = (t.t.first(), t.t.last()) else {
        return Vec::new();
    };
    let slack = 1e-9 * seconds;
    let part = |time: f64| ((time - first + slack) / seconds).floor();
    let (mut pieces, mut begin, mut k) = (Vec::new(), 0, 0.0);
    while begin < t.len() && k < part(*last) {
        let end = t.t.partition_point(|&s| s <= t.t[begin] + seconds + slack);
        let gap = t.t[begin..end]
            .windows(2)
            .any(|w| w[1] - w[0] > 0.2 * seconds);
        if end - begin > 2 && !gap {
            pieces.push(t.part(begin..end));
        }
        // However long a gap is, the piece after it begins once.
        k = f64::max(k, part(t.t[begin])) + 1.0;
        let next = t.t.partition_point(|&s| s < first + k * seconds - slack);
        begin = next.max(begin + 1);
    }
    pieces
}

/// Sums of squared errors of q, `[n]`.
struct Squares {
    sums: Vec<f64>,
    count: usize,
}

impl Squares {
    fn new(n: usize) -> Self {
        Self {
            sums: vec![0.0; n],
            count: 0,
        }
    }

    fn add(&mut self, coordinates: &Coordinates, truth: &[f64], predicted: &[f64]) {
        let n = self.sums.len();
        for (k, (x, y)) in truth.iter().zip(predicted).enumerate() {
            self.sums[k % n] += coordinates.difference(k % n, *y, *x).powi(2);
        }
        self.count += truth.len() / n;
    }

    fn root_mean(&self) -> Vec<f64> {
        let count = self.count as f64;
        self.sums.iter().map(|sum| (sum / count).sqrt()).collect()
    }
}
