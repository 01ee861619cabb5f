//! Predictions over short times, one after another.

use lagrangian_motion::parallel::prelude::*;
use serde::Serialize;

use super::valid_time::differences;
use super::{bounded, predict_held};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{Hold, Rollout, RolloutOptions};
use lagrangian_motion::statistics::column;
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

/// Predictions over a short time.
pub(super) struct Short {
    /// Length of each prediction, s.
    seconds: f64,
    /// The motion that each truth is a part of.
    pub(super) motions: Vec<usize>,
    pub(super) truths: Vec<Trajectory>,
    /// As [`predictions`].
    pub(super) predictions: Vec<Option<Rollout>>,
}

impl Short {
    /// A prediction every `seconds`, of that length, evenly spread if there are more than `most`.
    pub(super) fn new(
        model: &dyn Model,
        motions: &[Trajectory],
        seconds: f64,
        most: usize,
        options: &RolloutOptions,
    ) -> Result<Self> {
        let of = |k: usize| {
            windows(&motions[k], seconds)
                .into_iter()
                .map(move |w| (k, w))
        };
        let all: Vec<(usize, Trajectory)> = (0..motions.len()).flat_map(of).collect();
        let every = all.len().div_ceil(most).max(1);
        let (motions, truths): (_, Vec<Trajectory>) = all.into_iter().step_by(every).unzip();
        Ok(Self {
            predictions: predictions(model, &truths, Hold::Previous, options)?,
            seconds,
            motions,
            truths,
        })
    }

    /// The predictions that were not stopped.
    fn whole(&self) -> impl Iterator<Item = (&Trajectory, &Rollout)> {
        let pairs = self.truths.iter().zip(&self.predictions);
        let known = pairs.filter_map(|(truth, own)| Some((truth, own.as_ref()?)));
        known.filter(|(_, own)| !own.outcome.is_stopped())
    }

    /// The number of predictions that were stopped.
    pub(super) fn stopped(&self) -> usize {
        self.truths.len() - self.whole().count()
    }

    /// The errors of the predictions.
    pub(super) fn score(&self, coordinates: &Coordinates) -> RestartScore {
        let n = coordinates.dof();
        let [mut all, mut ends] = [const { Vec::new() }; 2];
        let finished = || self.whole().filter(|(_, own)| own.outcome.is_finished());
        for (truth, own) in finished() {
            all.extend(differences(coordinates, &truth.q, &own.trajectory.q));
            ends.extend_from_slice(&all[all.len() - n..]);
        }
        let root_mean = |errors: &[f64]| {
            let count = (errors.len() / n) as f64;
            column(errors, n, |x| {
                (x.map(|e| e * e).sum::<f64>() / count).sqrt()
            })
        };
        let starts = self.whole().count();
        RestartScore {
            seconds: self.seconds,
            starts,
            unfinished: starts - finished().count(),
            q_rms: root_mean(&all),
            q_rms_end: root_mean(&ends),
        }
    }
}

/// The motion from the first state of each of these; `None` for those that the stop came before.
pub(super) fn predictions(
    model: &dyn Model,
    truths: &[Trajectory],
    hold: Hold,
    options: &RolloutOptions,
) -> Result<Vec<Option<Rollout>>> {
    let own = |truth: &Trajectory| {
        let options = bounded(options, truth, truths.len());
        let going = !options.stop.is_asked();
        going
            .then(|| predict_held(model, truth, hold, &options))
            .transpose()
    };
    truths.par_iter().map(own).collect()
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
