//! What several models make of the same motions, in figures that are compared.

use std::f64::consts::TAU;

use lagrangian::score::{Predictions, THRESHOLD, predict_all, valid_prediction_time};
use lagrangian::{Coordinates, Model, Rollout, RolloutOptions, Signal, Trajectory};
use serde::Serialize;

use super::Run;
use super::paired::{Best, Blocked, Difference, blocks};
use crate::error::Result;

/// A figure of all models.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What is measured: `torque` and `acceleration`, the squared errors over the variance of the signal; `position`, the mean absolute
    /// error of motions that are simulated from goals; `followed`, the time for which a motion is followed from its first state.
    pub signal: &'static str,
    /// The coordinate; none for all together.
    pub coordinate: Option<String>,
    /// The unit; empty for a part of a variance.
    pub unit: String,
    /// The figure of each model; none for a model that does not have it.
    pub values: Vec<Option<f64>>,
    /// The difference of each model from the first, on the same blocks; none for the first.
    pub differences: Vec<Option<Difference>>,
    /// The best model beside the next; none where fewer than two have the figure.
    pub lead: Option<Lead>,
}

/// The model with the best figure, and how far it leads.
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
        let known = each.iter().enumerate();
        let mut known: Vec<_> = known
            .filter_map(|(k, own)| Some((k, own.as_ref()?)))
            .collect();
        let cost = |own: &Blocked| match best {
            Best::Least => own.mean(),
            Best::Most => -own.mean(),
        };
        // What is not finite comes last, whatever its sign.
        let cost = |own: &Blocked| {
            Some(cost(own))
                .filter(|x| x.is_finite())
                .unwrap_or(f64::INFINITY)
        };
        known.sort_by(|(_, a), (_, b)| cost(a).total_cmp(&cost(b)));
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

/// What the models predict, and the figures of that.
pub(super) struct Measured {
    pub(super) rows: Vec<Row>,
    /// The errors of all coordinates together in the blocks, for each model, and what they are errors of.
    pub(super) blocks: Option<(&'static str, Vec<Vec<f64>>)>,
    /// What each model predicts of the first motion.
    pub(super) shown: Vec<Shown>,
}

/// What a model predicts of the first motion.
#[derive(Debug, Default)]
pub(super) struct Shown {
    /// The motion from its first state.
    pub(super) rollout: Option<Trajectory>,
    /// The forces at its samples.
    pub(super) torques: Option<Vec<f64>>,
}

impl Measured {
    /// Of these models on these motions.
    pub(super) fn new(
        runs: &[Run],
        motions: &[Trajectory],
        options: &RolloutOptions,
    ) -> Result<Self> {
        let mut each = Vec::new();
        for run in runs {
            each.push(Predicted::new(&run.model, motions, options)?);
        }
        let coordinates = runs[0].model.coordinates();
        let mut rows = Vec::new();
        let mut shown_blocks = None;
        for (signal, name) in [(Signal::Tau, "torque"), (Signal::Qdd, "acceleration")] {
            let errors: Vec<Option<Errors>> = each
                .iter()
                .map(|own| Errors::new(own.of(signal)?, motions, signal, coordinates.dof()))
                .collect();
            if errors.iter().all(Option::is_none) {
                continue;
            }
            let all: Vec<_> = errors.iter().map(|e| Some(e.as_ref()?.all())).collect();
            if shown_blocks.is_none() && all.iter().all(Option::is_some) {
                let means = all.iter().flatten().map(|blocked| blocked.means.clone());
                shown_blocks = Some((name, means.collect()));
            }
            rows.push(Row::new(name, None, "", &all, Best::Least));
            rows.extend(of_coordinates(name, coordinates, &errors));
        }
        rows.extend(followed(&each, motions, coordinates)?);
        if runs.iter().any(|run| run.model.driven().is_some()) {
            rows.extend(positions(&each, motions, coordinates));
        }
        Ok(Self {
            rows,
            blocks: shown_blocks,
            shown: each.into_iter().map(Predicted::first).collect(),
        })
    }
}

/// A row for each coordinate that moves, where there are several.
fn of_coordinates(
    name: &'static str,
    coordinates: &Coordinates,
    errors: &[Option<Errors>],
) -> Vec<Row> {
    let n = coordinates.dof();
    let moving = |i: &usize| errors.iter().flatten().any(|own| own.moving.contains(i));
    let row = |i: usize| {
        let each: Vec<_> = errors.iter().map(|e| Some(e.as_ref()?.of(i))).collect();
        let coordinate = Some(coordinates.0[i].name.clone());
        Row::new(name, coordinate, "", &each, Best::Least)
    };
    (0..n).filter(|_| n > 1).filter(moving).map(row).collect()
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
            let whole = |(truth, own): (&Trajectory, &Rollout)| own.trajectory.len() == truth.len();
            let pairs = || motions.iter().zip(&own.rollouts);
            (pairs().count() == motions.len() && pairs().all(whole)).then(|| Blocked {
                means: pairs().map(|pair| error(i, pair)).collect(),
                weights: vec![1.0; motions.len()],
            })
        };
        let each: Vec<_> = each.iter().map(of).collect();
        let name = Some(coordinates.0[i].name.clone());
        Row::new("position", name, &coordinates.0[i].unit, &each, Best::Least)
    };
    (0..n)
        .filter(|&i| !coordinates.is_parameter(i))
        .map(row)
        .collect()
}

/// How long the motions are followed.
fn followed(
    each: &[Predicted],
    motions: &[Trajectory],
    coordinates: &Coordinates,
) -> Result<Vec<Row>> {
    let times = |own: &Predicted| -> Result<Option<Blocked>> {
        if own.rollouts.is_empty() {
            return Ok(None);
        }
        let pairs = motions.iter().zip(&own.rollouts);
        let times = pairs.map(|(truth, rollout)| valid(truth, rollout, coordinates));
        Ok(Some(Blocked {
            means: times.collect::<Result<_>>()?,
            weights: vec![1.0; motions.len()],
        }))
    };
    let times = each.iter().map(times).collect::<Result<Vec<_>>>()?;
    let any = times.iter().any(Option::is_some);
    let row = any.then(|| Row::new("followed", None, "s", &times, Best::Most));
    Ok(row.into_iter().collect())
}

fn valid(truth: &Trajectory, rollout: &Rollout, coordinates: &Coordinates) -> Result<f64> {
    let predicted = &rollout.trajectory;
    if predicted.is_empty() {
        return Ok(0.0);
    }
    Ok(valid_prediction_time(truth, predicted, coordinates, THRESHOLD)?.seconds)
}

impl Row {
    fn new(
        signal: &'static str,
        coordinate: Option<String>,
        unit: &str,
        each: &[Option<Blocked>],
        best: Best,
    ) -> Self {
        let first = each.first().and_then(Option::as_ref);
        let difference = |(k, own): (usize, &Option<Blocked>)| {
            let (first, own) = (first?, own.as_ref()?);
            (k > 0).then(|| Difference::of(first, own, best))
        };
        Self {
            signal,
            coordinate,
            unit: unit.into(),
            values: each.iter().map(|own| Some(own.as_ref()?.mean())).collect(),
            differences: each.iter().enumerate().map(difference).collect(),
            lead: Lead::of(each, best),
        }
    }
}

/// What one model predicts of all motions.
struct Predicted {
    rollouts: Vec<Rollout>,
    accelerations: Option<Vec<Vec<f64>>>,
    torques: Option<Vec<Vec<f64>>>,
}

impl Predicted {
    fn new(model: &dyn Model, motions: &[Trajectory], options: &RolloutOptions) -> Result<Self> {
        let Predictions {
            rollouts,
            accelerations,
        } = predict_all(model, motions, options)?;
        let whole = |(motion, own): (&Trajectory, Option<lagrangian::score::Accelerations>)| {
            let own = own?.qdd;
            (own.len() == motion.q.len()).then_some(own)
        };
        let pairs = motions.iter().zip(accelerations);
        let accelerations: Option<Vec<_>> = pairs.map(whole).collect();
        let torques: Option<Vec<_>> = motions.iter().map(|m| torques(model, m)).collect();
        Ok(Self {
            rollouts,
            accelerations: accelerations.filter(|all| all.len() == motions.len()),
            torques,
        })
    }

    fn of(&self, signal: Signal) -> Option<&[Vec<f64>]> {
        match signal {
            Signal::Tau => self.torques.as_deref(),
            _ => self.accelerations.as_deref(),
        }
    }

    /// What it predicts of the first motion.
    fn first(self) -> Shown {
        let rollout = self.rollouts.into_iter().next();
        Shown {
            rollout: rollout.map(|rollout| rollout.trajectory),
            torques: self.torques.and_then(|all| all.into_iter().next()),
        }
    }
}

/// The forces of a recorded motion; none for a model without inverse dynamics, and without accelerations or forces to compare with.
fn torques(model: &dyn Model, motion: &Trajectory) -> Option<Vec<f64>> {
    let (qdd, _) = (motion.values(Signal::Qdd)?, motion.values(Signal::Tau)?);
    let mut torques = vec![0.0; qdd.len()];
    let outcome = (model.evaluator()).inverse_dynamics(&motion.q, &motion.qd, qdd, &mut torques);
    outcome.is_supported().then_some(torques)
}

/// Squared errors over the variance of the signal, in blocks.
struct Errors {
    /// The means in each block, `[blocks, n]`.
    means: Vec<Vec<f64>>,
    weights: Vec<f64>,
    /// The coordinates whose signal varies.
    moving: Vec<usize>,
}

impl Errors {
    /// None where a motion does not have the signal.
    fn new(
        predicted: &[Vec<f64>],
        motions: &[Trajectory],
        signal: Signal,
        n: usize,
    ) -> Option<Self> {
        let truth: Option<Vec<&[f64]>> = motions.iter().map(|m| m.values(signal)).collect();
        let truth = truth?;
        let variances = variances(&truth, n);
        let (mut means, mut weights) = (Vec::new(), Vec::new());
        for (truth, predicted) in truth.iter().zip(predicted) {
            for block in blocks(truth.len() / n, motions.len()) {
                let mut sums = vec![0.0; n];
                for k in block.start * n..block.end * n {
                    sums[k % n] += (truth[k] - predicted[k]).powi(2);
                }
                let count = block.len() as f64;
                let mean = |(sum, variance): (&f64, &f64)| sum / (count * variance);
                means.push(sums.iter().zip(&variances).map(mean).collect());
                weights.push(count);
            }
        }
        let moving = (0..n).filter(|&i| variances[i] > 0.0).collect();
        Some(Self {
            means,
            weights,
            moving,
        })
    }

    fn of(&self, i: usize) -> Blocked {
        self.reduced(|row| row[i])
    }

    /// The mean over the coordinates whose signal varies.
    fn all(&self) -> Blocked {
        let count = self.moving.len() as f64;
        self.reduced(|row| self.moving.iter().map(|&i| row[i]).sum::<f64>() / count)
    }

    fn reduced(&self, of: impl Fn(&[f64]) -> f64) -> Blocked {
        Blocked {
            means: self.means.iter().map(|row| of(row)).collect(),
            weights: self.weights.clone(),
        }
    }
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
