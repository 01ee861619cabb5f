//! How good a model is on trajectories that it has not seen.

mod assessment;
mod outside;
mod valid_time;

use std::f64::consts::TAU;
use std::ops::Range;
use std::time::Duration;

use rayon::prelude::*;
use serde::Serialize;

use crate::mechanics::dynamics::Model;
use crate::rollout::{Hold, Outcome, Rollout, RolloutOptions, free, rollout, rollout_recorded};
use crate::train::Samples;
use crate::trajectory::Signal;
use crate::{Coordinates, Error, Result, Signals, Stop, Trajectory};

pub use assessment::{Assessment, Forward, Grade, Reason, Spectrum};
pub use outside::{Outside, outside};
pub use valid_time::{ValidTime, valid_prediction_time};

/// The normalised error at which a prediction is no longer valid.
pub const THRESHOLD: f64 = 0.5;

/// Lengths of the short predictions, s.
pub const RESTARTS: [f64; 2] = [0.5, 1.0];

/// Errors of one signal over all samples, by coordinate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalError {
    /// Mean squared error, `[n]`, in the square of the signal's unit.
    pub mse: Vec<f64>,
    /// The same divided by the variance of the signal, `[n]`: 1 is as good as predicting the mean. Not finite for
    /// a signal that is constant.
    pub nmse: Vec<f64>,
    /// Mean squared error of all coordinates together: the sum of `mse`, as results of `characters` are given.
    pub mse_sum: f64,
    /// Mean of `nmse` over the coordinates.
    pub nmse_mean: f64,
}

impl SignalError {
    /// From mean squared errors and the variances of the true signals, both `[n]`.
    #[must_use]
    pub fn new(mse: Vec<f64>, variance: &[f64]) -> Self {
        let nmse: Vec<f64> = mse.iter().zip(variance).map(|(e, v)| e / v).collect();
        // 0/0: a parameter, which is not predicted. What a model predicts as NaN counts.
        let is_still = |e: f64, v: f64| e <= 0.0 && v <= 0.0;
        let all = nmse.iter().zip(mse.iter().zip(variance));
        let known = all
            .filter(|(_, (e, v))| !is_still(**e, **v))
            .map(|(x, _)| *x);
        let known: Vec<f64> = known.collect();
        Self {
            mse_sum: mse.iter().sum(),
            nmse_mean: known.iter().sum::<f64>() / known.len() as f64,
            mse,
            nmse,
        }
    }
}

/// A prediction of one trajectory from its first state, under its forces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RolloutScore {
    /// How it ended.
    pub outcome: Outcome,
    /// Duration of the truth, s.
    pub duration: f64,
    /// Time until the normalised error exceeded [`THRESHOLD`], s; see [`valid_prediction_time`].
    pub valid_seconds: f64,
    /// Whether it exceeded it at all.
    pub exceeded: bool,
    /// Mean absolute error of q over the predicted samples, `[n]`, in the unit of q; on the circle for angles.
    pub q_mean_absolute: Vec<f64>,
}

/// Predictions over short times, from the state that was measured at the start of each.
///
/// For a driven or chaotic machine, a long prediction shows how soon it fails, short ones how good it is until then.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestartScore {
    /// From one start to the next, and length of each prediction, s.
    pub seconds: f64,
    /// Predictions.
    pub starts: usize,
    /// Those that diverged; they are in none of the errors.
    pub unfinished: usize,
    /// Root mean square error of q over all samples of the predictions, `[n]`, in the unit of q; on the circle for
    /// angles.
    pub q_rms: Vec<f64>,
    /// The same at their ends alone.
    pub q_rms_end: Vec<f64>,
}

/// A model's figures on some trajectories.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Samples in all.
    pub samples: usize,
    /// Of q̈ predicted from (q, q̇, τ); none where no trajectory has q̈, or the model has no forward dynamics.
    pub acceleration: Option<SignalError>,
    /// Of τ predicted from (q, q̇, q̈); none where no trajectory has q̈ and τ, or the model has no inverse dynamics.
    pub torque: Option<SignalError>,
    /// One free prediction for each trajectory; none where the model has no forward dynamics.
    pub rollouts: Vec<RolloutScore>,
    /// Predictions over each of [`RESTARTS`], for those that the trajectories are long enough for.
    pub restarts: Vec<RestartScore>,
    /// States at which the mass matrix was singular.
    pub singular: usize,
    /// How far the samples lie outside of the states that the data of the model visited, where these are known.
    pub outside: Option<Outside>,
    /// Predictions that were stopped, by [`RolloutOptions::stop`]: those of motions are as long as they came, those over short
    /// times are in none of the figures.
    pub stopped: usize,
}

/// Scores `model` on `trajectories`: one-step errors over all samples, and a rollout of each trajectory.
///
/// A trajectory without forces is taken as free. Forces are held between samples, as a digital controller does. The steps of each
/// rollout are limited by the number of its samples, so that a bad model ends in time too, with [`Outcome::StepLimit`].
///
/// # Errors
/// As [`rollout`] and [`Trajectory::validate`]; [`crate::Error::Shape`] for trajectories of other degrees of freedom
/// than the model.
pub fn score(
    model: &dyn Model,
    trajectories: &[Trajectory],
    options: &RolloutOptions,
) -> Result<Score> {
    let predictions = predict_all(model, trajectories, options)?;
    score_predictions(model, trajectories, &predictions, options)
}

/// What a model predicts of some trajectories; empty for a model without forward dynamics.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Predictions {
    /// The motion of each trajectory from its first state, as [`predict`].
    pub rollouts: Vec<Rollout>,
    /// The accelerations at the samples of each trajectory; none for a trajectory without q̈.
    pub accelerations: Vec<Option<Accelerations>>,
}

/// Accelerations that a model predicts from (q, q̇, τ).
#[derive(Debug, Clone, PartialEq)]
pub struct Accelerations {
    /// q̈, `[m, n]`.
    pub qdd: Vec<f64>,
    /// The number of states at which the mass matrix is singular.
    pub singular: usize,
}

/// The predictions of a model that a score is made of.
///
/// # Errors
/// As [`score`].
pub fn predict_all(
    model: &dyn Model,
    trajectories: &[Trajectory],
    options: &RolloutOptions,
) -> Result<Predictions> {
    if !model.moves() {
        return Ok(Predictions::default());
    }
    let count = trajectories.len();
    let rollouts = trajectories
        .par_iter()
        .map(|t| predict(model, t, &bounded(options, t, count)));
    let rollouts = rollouts.collect::<Result<_>>()?;
    let accelerations = trajectories
        .iter()
        .map(|t| accelerations(model, t, options.stop));
    Ok(Predictions {
        rollouts,
        accelerations: accelerations.collect(),
    })
}

/// Steps of a prediction for each sample, and for each of the first hundred more: a good model needs a few, a stiff one whatever it may
/// take.
const STEPS: u64 = 20;
const MORE: (u64, u64) = (200, 100);
/// Of these further steps, all predictions together.
const MORE_OF_ALL: u64 = 2_000_000;

/// The options with a limit of steps that follows from the size of the task, of `count` such predictions.
pub(crate) fn bounded(
    options: &RolloutOptions,
    truth: &Trajectory,
    count: usize,
) -> RolloutOptions {
    let rows = truth.len() as u64;
    let more = MORE.0 * rows.min(MORE.1);
    let steps = STEPS * rows + more.min(MORE_OF_ALL / (count as u64).max(1));
    RolloutOptions {
        max_steps: options.max_steps.min(steps),
        ..*options
    }
}

/// Samples that are evaluated between two looks at whether to stop.
const SAMPLES: usize = 1 << 12;

/// The values of each part of the samples, [`SAMPLES`] at most; the first part is there whatever happens.
fn parts(values: usize, n: usize, stop: Stop) -> impl Iterator<Item = Range<usize>> {
    let size = SAMPLES * n.max(1);
    let begins = (0..values).step_by(size);
    begins
        .take_while(move |begin| *begin == 0 || !stop.is_asked())
        .map(move |begin| begin..(begin + size).min(values))
}

fn accelerations(model: &dyn Model, t: &Trajectory, stop: Stop) -> Option<Accelerations> {
    let mut qdd = vec![0.0; t.values(Signal::Qdd)?.len()];
    if model.driven().is_some() && t.tau.is_empty() {
        return None;
    }
    let free = vec![0.0; qdd.len()];
    let tau = t.values(Signal::Tau).unwrap_or(&free);
    let (mut evaluator, mut singular, mut done) = (model.evaluator(), 0, 0);
    for part in parts(qdd.len(), t.dof(), stop) {
        let (q, qd, tau) = (&t.q[part.clone()], &t.qd[part.clone()], &tau[part.clone()]);
        done = part.end;
        let outcome = evaluator.forward_dynamics(q, qd, tau, &mut qdd[part]);
        singular += outcome.singular();
    }
    qdd.truncate(done);
    Some(Accelerations { qdd, singular })
}

/// As [`score`], with the predictions that [`predict_all`] has made.
///
/// # Errors
/// As [`score`].
pub fn score_predictions(
    model: &dyn Model,
    trajectories: &[Trajectory],
    predictions: &Predictions,
    options: &RolloutOptions,
) -> Result<Score> {
    let one_step = one_step(
        model,
        trajectories,
        &predictions.accelerations,
        options.stop,
    );
    let pairs = trajectories.iter().zip(&predictions.rollouts);
    let rollouts = pairs.map(|(truth, prediction)| followed(model, truth, prediction));
    let rollouts = rollouts.collect::<Result<Vec<RolloutScore>>>()?;
    let (restarts, cut) = match model.moves() {
        true => restarts(model, trajectories, options)?,
        false => (Vec::new(), 0),
    };
    let stopped = rollouts.iter().filter(|r| r.outcome.is_stopped()).count();
    Ok(Score {
        stopped: stopped + cut,
        rollouts,
        restarts,
        ..one_step
    })
}

/// Time for the predictions of any recordings, and for those of a sample, s, and the longest. A usable model needs a tenth of it.
const TIME: (f64, f64, f64) = (30.0, 2e-3, 600.0);

/// The time that a score of so many samples may take, after which [`RolloutOptions::stop`] should end it.
#[must_use]
pub fn time_for(samples: usize) -> Duration {
    let (any, sample, longest) = TIME;
    Duration::from_secs_f64((any + sample * samples as f64).min(longest))
}

/// Scores `model` on samples that need not follow each other: the errors of single samples, and no rollouts.
///
/// # Errors
/// As [`Trajectory::validate`], but for the times; [`crate::Error::Shape`] for samples of other degrees of freedom than the model.
pub fn score_samples(model: &dyn Model, samples: &Trajectory) -> Result<Score> {
    samples.validate()?;
    let (found, n) = (samples.dof(), model.coordinates().dof());
    crate::Error::check_shape("a state", found, n, "give samples of the same system")?;
    let accelerations = match model.moves() {
        true => accelerations(model, samples, Stop::default()),
        false => None,
    };
    let samples = std::slice::from_ref(samples);
    Ok(one_step(model, samples, &[accelerations], Stop::default()))
}

/// The errors of single samples.
fn one_step(
    model: &dyn Model,
    trajectories: &[Trajectory],
    accelerations: &[Option<Accelerations>],
    stop: Stop,
) -> Score {
    let n = model.coordinates().dof();
    let (mut acceleration, mut torque) = (Errors::new(n), Errors::new(n));
    let mut singular = 0;
    for (truth, predicted) in trajectories.iter().zip(accelerations) {
        if let (Some(qdd), Some(predicted)) = (truth.values(Signal::Qdd), predicted) {
            acceleration.add(&qdd[..predicted.qdd.len()], &predicted.qdd);
            singular += predicted.singular;
        }
    }
    for trajectory in trajectories {
        add_torques(model, trajectory, stop, &mut torque);
    }
    Score {
        samples: trajectories.iter().map(Trajectory::len).sum(),
        acceleration: acceleration.finish(),
        torque: torque.finish(),
        rollouts: Vec::new(),
        restarts: Vec::new(),
        singular,
        outside: outside(model, trajectories),
        stopped: 0,
    }
}

/// The short predictions, and how many of them were stopped.
fn restarts(
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
/// As [`score`].
pub fn restart(
    model: &dyn Model,
    trajectories: &[Trajectory],
    seconds: f64,
    options: &RolloutOptions,
) -> Result<RestartScore> {
    restart_counted(model, trajectories, seconds, options).map(|(score, _)| score)
}

/// [`restart`], and how many of its predictions were stopped, which it leaves out.
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
fn windows(t: &Trajectory, seconds: f64) -> Vec<Trajectory> {
    let (Some(first), Some(last)) = (t.t.first(), t.t.last()) else {
        return Vec::new();
    };
    let slack = 1e-9 * seconds;
    let count = ((last - first + slack) / seconds).floor() as usize;
    let at = |time: f64| t.t.partition_point(|&s| s < time - slack);
    let piece = |k: usize| {
        let begin = at(first + k as f64 * seconds);
        let end = t.t.partition_point(|&s| s <= t.t[begin] + seconds + slack);
        let piece = t.part(begin..end);
        let gap = piece.t.windows(2).any(|w| w[1] - w[0] > 0.2 * seconds);
        (piece.len() > 2 && !gap).then_some(piece)
    };
    (0..count).filter_map(piece).collect()
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
            let mut error = y - x;
            if coordinates.is_circle(k % n) {
                error -= TAU * (error / TAU).round();
            }
            self.sums[k % n] += error * error;
        }
        self.count += truth.len() / n;
    }

    fn root_mean(&self) -> Vec<f64> {
        let count = self.count as f64;
        self.sums.iter().map(|sum| (sum / count).sqrt()).collect()
    }
}

/// What the model makes of a trajectory from its first state, under its forces, at its times.
///
/// # Errors
/// As [`score`].
pub fn predict(model: &dyn Model, truth: &Trajectory, options: &RolloutOptions) -> Result<Rollout> {
    truth.validate()?;
    let (n, found) = (model.coordinates().dof(), truth.dof());
    Error::check_shape(
        format_args!("a state of trajectory '{}'", truth.name),
        found,
        n,
        "give data of the coordinates that the model has",
    )?;
    if !truth.tau.is_empty() || model.driven().is_some() {
        return rollout_recorded(model, truth, Hold::Previous, options);
    }
    let (q, qd) = (&truth.q[..n], &truth.qd[..n]);
    rollout(model, q, qd, &truth.t, &free, options)
}

fn followed(model: &dyn Model, truth: &Trajectory, prediction: &Rollout) -> Result<RolloutScore> {
    let duration = truth.t.last().unwrap_or(&0.0) - truth.t.first().unwrap_or(&0.0);
    if prediction.trajectory.is_empty() {
        // Without a momentum of its first velocity it does not begin.
        return Ok(RolloutScore {
            outcome: prediction.outcome,
            duration,
            valid_seconds: 0.0,
            exceeded: true,
            q_mean_absolute: vec![f64::NAN; model.coordinates().dof()],
        });
    }
    let ValidTime { seconds, exceeded } = valid_prediction_time(
        truth,
        &prediction.trajectory,
        model.coordinates(),
        THRESHOLD,
    )?;
    Ok(RolloutScore {
        outcome: prediction.outcome,
        duration,
        valid_seconds: seconds,
        exceeded,
        q_mean_absolute: mean_absolute(model.coordinates(), &truth.q, &prediction.trajectory.q),
    })
}

/// The mean absolute difference of positions, `[n]`; on the circle for angles.
fn mean_absolute(coordinates: &Coordinates, truth: &[f64], predicted: &[f64]) -> Vec<f64> {
    let n = coordinates.dof();
    let mut sums = vec![0.0; n];
    for (k, (x, y)) in truth.iter().zip(predicted).enumerate() {
        let error = y - x;
        let turns = match coordinates.is_circle(k % n) {
            true => (error / TAU).round(),
            false => 0.0,
        };
        sums[k % n] += (error - TAU * turns).abs();
    }
    let count = (predicted.len() / n.max(1)) as f64;
    sums.iter().map(|sum| sum / count).collect()
}

/// Adds the errors of τ at every sample, where the model has inverse dynamics.
fn add_torques(model: &dyn Model, t: &Trajectory, stop: Stop, torque: &mut Errors) {
    let (Some(qdd), Some(tau)) = (t.values(Signal::Qdd), t.values(Signal::Tau)) else {
        return;
    };
    let mut evaluator = model.evaluator();
    for part in parts(tau.len(), t.dof(), stop) {
        let (q, qd, qdd) = (&t.q[part.clone()], &t.qd[part.clone()], &qdd[part.clone()]);
        let mut predicted = vec![0.0; part.len()];
        let outcome = evaluator.inverse_dynamics(q, qd, qdd, &mut predicted);
        if outcome.is_supported() {
            torque.add(&tau[part], &predicted);
        }
    }
}

/// The errors of the torques that a model predicts at some samples; `None` where it has no inverse dynamics.
#[must_use]
pub fn torque_error(model: &dyn Model, samples: &Samples) -> Option<SignalError> {
    let mut predicted = vec![0.0; samples.tau.len()];
    let Signals {
        q, qd, qdd, tau, ..
    } = &samples.signals;
    let outcome = model
        .evaluator()
        .inverse_dynamics(q, qd, qdd, &mut predicted);
    let mut errors = Errors::new(samples.n);
    errors.add(tau, &predicted);
    errors.finish().filter(|_| outcome.is_supported())
}

/// Squared errors, `[n]`, and the true signal that they belong to, `[m, n]`.
pub(crate) struct Errors {
    squared: Vec<f64>,
    truth: Vec<f64>,
}

impl Errors {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            squared: vec![0.0; n],
            truth: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, truth: &[f64], predicted: &[f64]) {
        let n = self.squared.len();
        for (k, (x, y)) in truth.iter().zip(predicted).enumerate() {
            self.squared[k % n] += (x - y).powi(2);
        }
        self.truth.extend_from_slice(truth);
    }

    pub(crate) fn finish(self) -> Option<SignalError> {
        let n = self.squared.len();
        if self.truth.is_empty() {
            return None;
        }
        let count = (self.truth.len() / n) as f64;
        let mean_over_samples = |f: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            let signal = |i| self.truth.iter().skip(i).step_by(n).map(move |x| f(i, *x));
            (0..n).map(|i| signal(i).sum::<f64>() / count).collect()
        };
        let mean = mean_over_samples(&|_, x| x);
        let variance = mean_over_samples(&|i, x| (x - mean[i]).powi(2));
        let mse: Vec<f64> = self.squared.iter().map(|s| s / count).collect();
        Some(SignalError::new(mse, &variance))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::mechanics::analytic::by_name;
    use crate::rollout::times;

    #[test]
    fn a_score_that_is_stopped_says_how_much_it_left_out_and_is_no_verdict_on_rollouts() {
        static STOP: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);
        let truth = by_name("pendulum", &[]).unwrap();
        let times = times(4.0, 0.02).unwrap();
        let options = RolloutOptions {
            stop: Stop::when(&STOP),
            ..RolloutOptions::default()
        };
        let swing = rollout(&*truth, &[1.0], &[0.0], &times, &free, &options).unwrap();
        let motions = [swing.trajectory];
        assert_eq!(score(&*truth, &motions, &options).unwrap().stopped, 0);
        STOP.store(true, std::sync::atomic::Ordering::Relaxed);
        let stopped = score(&*truth, &motions, &options).unwrap();
        // One motion, eight predictions of half a second and four of a second.
        assert_eq!(stopped.stopped, 13);
        assert!(stopped.rollouts[0].outcome.is_stopped() && stopped.restarts.is_empty());
        assert!(stopped.acceleration.as_ref().unwrap().nmse[0] < 1e-20);
        let assessment = Assessment::new(&*truth, &motions, &stopped);
        assert_eq!(assessment.verdict, Grade::Good, "{:?}", assessment.reasons);
    }

    #[test]
    fn an_error_that_is_no_number_is_not_passed_over_but_a_parameter_is() {
        let error = SignalError::new(vec![f64::NAN, 0.1, 0.0], &[1.0, 1.0, 0.0]);
        assert!(error.nmse_mean.is_nan());
        let error = SignalError::new(vec![0.1, 0.0], &[1.0, 0.0]);
        assert!((error.nmse_mean - 0.1).abs() < 1e-15);
    }

    #[test]
    fn the_truth_scores_without_error_and_another_pendulum_does_not() {
        let truth = by_name("pendulum", &[]).unwrap();
        let options = RolloutOptions::default();
        let swing = rollout(
            &*truth,
            &[1.0],
            &[0.0],
            &times(10.0, 0.05).unwrap(),
            &free,
            &options,
        )
        .unwrap();
        let same = score(&*truth, std::slice::from_ref(&swing.trajectory), &options).unwrap();
        assert!(same.acceleration.unwrap().nmse[0] < 1e-20 && !same.rollouts[0].exceeded);
        let longer = by_name("pendulum", &[("length", 2.0)]).unwrap();
        let other = score(&*longer, &[swing.trajectory], &options).unwrap();
        // q̈ is half of the truth, so a quarter of its mean square is missed.
        assert!((other.acceleration.unwrap().nmse[0] - 0.25).abs() < 0.05);
        // Small swings of periods 2 and 2.8 s are apart by tenths of a radian after a second.
        assert!(
            same.restarts
                .iter()
                .all(|r| r.unfinished == 0 && r.q_rms_end[0] < 1e-7)
        );
        assert_eq!(
            same.restarts.iter().map(|r| r.starts).collect::<Vec<_>>(),
            [20, 10]
        );
        assert!(other.restarts[1].q_rms_end[0] > 0.1);
        assert!(other.rollouts[0].exceeded && other.rollouts[0].valid_seconds < 2.0);
    }

    #[test]
    fn a_trajectory_of_another_system_is_refused() {
        let one = by_name("pendulum", &[]).unwrap();
        let two = by_name("double-pendulum", &[]).unwrap();
        let options = RolloutOptions::default();
        let swing = rollout(
            &*one,
            &[1.0],
            &[0.0],
            &times(1.0, 0.1).unwrap(),
            &free,
            &options,
        )
        .unwrap();
        assert!(score(&*two, &[swing.trajectory], &options).is_err());
    }
}
