//! Predictions of several models for the same motions, as figures that are compared.

use std::f64::consts::TAU;

use lagrangian::score::{Predictions, THRESHOLD, predict_all, valid_prediction_time};
use lagrangian::trajectory::{Coordinate, Signal};
use lagrangian::{Coordinates, Model, Rollout, RolloutOptions, Trajectory};
use serde::Serialize;

use super::LoadedRun;
use super::paired::{Best, Blocked, Difference, blocks};
use crate::error::Result;
use lagrangian_motion::statistics::sort_by_number;

/// A quantity that is measured of each model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// The squared error of torques over the variance of the signal.
    Torque,
    /// The squared error of accelerations over the variance of the signal.
    Acceleration,
    /// The mean absolute error of motions that are simulated from goals.
    Position,
    /// The time for which a motion is followed from its first state.
    Followed,
}

impl Measure {
    fn best(self) -> Best {
        match self {
            Self::Followed => Best::Most,
            _ => Best::Least,
        }
    }
}

/// A figure of all models.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The quantity.
    pub signal: Measure,
    /// The coordinate; `None` for all together.
    pub coordinate: Option<String>,
    /// The unit; empty for a part of a variance.
    pub unit: String,
    /// The figure of each model; `None` for a model without it.
    pub values: Vec<Option<f64>>,
    /// The difference of each model from the first, on the same blocks; `None` for the first.
    pub differences: Vec<Option<Difference>>,
    /// The difference of the best model from the next; `None` where fewer than two have the figure.
    pub lead: Option<Lead>,
    /// The figure of each model in the blocks of the motions.
    #[serde(skip)]
    pub(super) blocks: Vec<Option<Blocked>>,
}

impl Row {
    /// The figure of each model in blocks; `None` where all models lack it.
    fn of(
        signal: Measure,
        coordinate: Option<&Coordinate>,
        each: Vec<Option<Blocked>>,
    ) -> Option<Self> {
        each.iter().flatten().next()?;
        let difference = |(k, own): (usize, &Option<Blocked>)| {
            let (first, own) = (each[0].as_ref()?, own.as_ref()?);
            (k > 0).then(|| Difference::of(first, own, signal.best()))
        };
        Some(Self {
            signal,
            coordinate: coordinate.map(|own| own.name.clone()),
            unit: match (signal, coordinate) {
                (Measure::Followed, _) => "s".into(),
                (Measure::Position, Some(own)) => own.unit.clone(),
                _ => String::new(),
            },
            values: each.iter().map(|own| Some(own.as_ref()?.mean())).collect(),
            differences: each.iter().enumerate().map(difference).collect(),
            lead: Lead::of(&each, signal.best()),
            blocks: each,
        })
    }
}

/// The model with the best figure, and its lead.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lead {
    /// The number of the best model.
    pub best: usize,
    /// The number of the next.
    pub next: usize,
    /// The difference of the best from the next, on the same blocks.
    pub difference: Difference,
}

impl Lead {
    fn of(each: &[Option<Blocked>], best: Best) -> Option<Self> {
        // A mean that is not finite comes last, whatever its sign.
        let cost = |(_, own): &(usize, &Blocked)| match (own.mean(), best) {
            (mean, _) if !mean.is_finite() => f64::INFINITY,
            (mean, Best::Least) => mean,
            (mean, Best::Most) => -mean,
        };
        let known = each.iter().enumerate();
        let mut known: Vec<_> = known
            .filter_map(|(k, own)| Some((k, own.as_ref()?)))
            .collect();
        sort_by_number(&mut known, cost);
        let [(first, leader), (second, next), ..] = known[..] else {
            return None;
        };
        Some(Self {
            best: first,
            next: second,
            difference: Difference::of(next, leader, best),
        })
    }
}

/// The figures of models on these motions, and the predictions from which they are computed.
pub(super) fn measured(
    runs: &[LoadedRun],
    motions: &[Trajectory],
    options: &RolloutOptions,
) -> Result<(Vec<Row>, Vec<Predicted>)> {
    let each = runs
        .iter()
        .map(|run| Predicted::new(&run.model, motions, options));
    let each = each.collect::<Result<Vec<_>>>()?;
    let coordinates = runs[0].model.coordinates();
    let mut rows = errors(Measure::Torque, &each, motions, coordinates);
    rows.extend(errors(Measure::Acceleration, &each, motions, coordinates));
    let times = each.iter().map(|own| followed(own, motions, coordinates));
    rows.extend(Row::of(
        Measure::Followed,
        None,
        times.collect::<Result<_>>()?,
    ));
    if runs.iter().any(|run| run.model.driven().is_some()) {
        rows.extend(positions(&each, motions, coordinates));
    }
    Ok((rows, each))
}

/// The squared errors of a signal over its variance: of all coordinates that vary together, and of each where there are several.
fn errors(
    measure: Measure,
    each: &[Predicted],
    motions: &[Trajectory],
    coordinates: &Coordinates,
) -> Vec<Row> {
    let signal = match measure {
        Measure::Torque => Signal::Tau,
        _ => Signal::Qdd,
    };
    let truth: Option<Vec<&[f64]>> = motions.iter().map(|m| m.values(signal)).collect();
    let Some(truth) = truth else {
        return Vec::new();
    };
    let n = coordinates.dof();
    let variances = variances(&truth, n);
    let moving: Vec<usize> = (0..n).filter(|&i| variances[i] > 0.0).collect();
    let blocked = |predicted: &Vec<Vec<f64>>, which: &[usize]| {
        let mut all = Blocked::default();
        for (truth, predicted) in truth.iter().zip(predicted) {
            for block in blocks(truth.len() / n, motions.len()) {
                let count = block.len() as f64;
                let error = |&i: &usize| {
                    let squares = block.clone().map(|k| k * n + i);
                    let squares = squares.map(|k| (truth[k] - predicted[k]).powi(2));
                    squares.sum::<f64>() / (count * variances[i])
                };
                let mean = which.iter().map(error).sum::<f64>() / which.len() as f64;
                all.means.push(mean);
                all.weights.push(count);
            }
        }
        all
    };
    let row = |coordinate, which: &[usize]| {
        let of = |own: &Predicted| Some(blocked(own.of(signal)?, which));
        Row::of(measure, coordinate, each.iter().map(of).collect())
    };
    let single = moving.iter().filter(|_| n > 1);
    let single = single.map(|&i| row(Some(&coordinates.0[i]), &[i]));
    [row(None, &moving)]
        .into_iter()
        .chain(single)
        .flatten()
        .collect()
}

/// The mean absolute errors of positions that are simulated from the first state alone.
fn positions(each: &[Predicted], motions: &[Trajectory], coordinates: &Coordinates) -> Vec<Row> {
    let n = coordinates.dof();
    let error = |i: usize, (truth, rollout): (&Trajectory, &Rollout)| {
        let predicted = &rollout.trajectory.q;
        let pairs = truth.q.iter().zip(predicted).skip(i).step_by(n);
        let turn = |x: f64| match coordinates.is_circle(i) {
            true => x - TAU * (x / TAU).round(),
            false => x,
        };
        pairs.map(|(q, own)| turn(own - q).abs()).sum::<f64>() / truth.len() as f64
    };
    let row = |i: usize| {
        let of = |own: &Predicted| {
            let pairs = || motions.iter().zip(&own.rollouts);
            let whole = pairs().filter(|(truth, own)| own.trajectory.len() == truth.len());
            (whole.count() == motions.len())
                .then(|| Blocked::of_motions(pairs().map(|pair| error(i, pair)).collect()))
        };
        let coordinate = Some(&coordinates.0[i]);
        Row::of(Measure::Position, coordinate, each.iter().map(of).collect())
    };
    let moving = (0..n).filter(|&i| !coordinates.is_parameter(i));
    moving.filter_map(row).collect()
}

/// The times for which a model follows the motions; `None` for a model without predictions.
fn followed(
    own: &Predicted,
    motions: &[Trajectory],
    coordinates: &Coordinates,
) -> Result<Option<Blocked>> {
    let time = |(truth, rollout): (&Trajectory, &Rollout)| {
        let predicted = &rollout.trajectory;
        match predicted.is_empty() {
            true => Ok(0.0),
            false => Ok(valid_prediction_time(truth, predicted, coordinates, THRESHOLD)?.seconds),
        }
    };
    let times = motions.iter().zip(&own.rollouts).map(time);
    let times = times.collect::<Result<Vec<_>>>()?;
    Ok((!times.is_empty()).then(|| Blocked::of_motions(times)))
}

/// Predictions of one model for all motions.
pub(super) struct Predicted {
    pub(super) rollouts: Vec<Rollout>,
    accelerations: Option<Vec<Vec<f64>>>,
    pub(super) torques: Option<Vec<Vec<f64>>>,
}

impl Predicted {
    fn new(model: &dyn Model, motions: &[Trajectory], options: &RolloutOptions) -> Result<Self> {
        let Predictions {
            rollouts,
            accelerations,
        } = predict_all(model, motions, options)?;
        let pairs = motions.iter().zip(accelerations);
        let whole =
            pairs.map(|(motion, own)| Some(own?.qdd).filter(|own| own.len() == motion.q.len()));
        let accelerations: Option<Vec<_>> = whole.collect();
        Ok(Self {
            rollouts,
            accelerations: accelerations.filter(|all| all.len() == motions.len()),
            torques: motions.iter().map(|m| torques(model, m)).collect(),
        })
    }

    fn of(&self, signal: Signal) -> Option<&Vec<Vec<f64>>> {
        match signal {
            Signal::Tau => self.torques.as_ref(),
            _ => self.accelerations.as_ref(),
        }
    }
}

/// The forces of a recorded motion; `None` for a model without inverse dynamics, and without accelerations or forces to compare with.
fn torques(model: &dyn Model, motion: &Trajectory) -> Option<Vec<f64>> {
    let (qdd, _) = (motion.values(Signal::Qdd)?, motion.values(Signal::Tau)?);
    let mut torques = vec![0.0; qdd.len()];
    let outcome = (model.evaluator()).inverse_dynamics(&motion.q, &motion.qd, qdd, &mut torques);
    outcome.is_supported().then_some(torques)
}

/// The variance of each coordinate over all motions, `[n]`.
fn variances(signals: &[&[f64]], n: usize) -> Vec<f64> {
    let count = signals.iter().map(|x| x.len()).sum::<usize>() / n;
    let of = |i: usize| {
        let column = || signals.iter().flat_map(|x| x.iter().skip(i).step_by(n));
        let mean = column().sum::<f64>() / count as f64;
        column().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64
    };
    (0..n).map(of).collect()
}
