//! The quality of a model on trajectories that it has not seen.

mod assessment;
mod candidate;
mod errors;
mod forecast;
mod inertia;
mod judgement;
mod outside;
mod predictable;
mod restarts;
mod speed;
mod valid_time;
mod work;

use std::ops::Range;
use std::time::Duration;

use lagrangian_motion::parallel::prelude::*;
use serde::Serialize;

use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{
    Hold, Outcome, Rollout, RolloutOptions, free, rollout, rollout_recorded,
};
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::{column, mean};
use lagrangian_motion::{Coordinates, Error, Result, Stop, Trajectory};

pub use assessment::{Assessment, Grade, Reason};
pub use candidate::CandidateResult;
pub use errors::{SignalError, torque_error};
pub use forecast::Forecast;
pub use inertia::{Forward, Spectrum, spectrum_of};
pub use judgement::{Judgement, TrackingErrors, extrapolation};
pub use outside::{Outside, outside};
pub use restarts::{RESTARTS, RestartScore};
pub use valid_time::{ValidTime, valid_prediction_time};

pub(crate) use assessment::HALF;
pub(crate) use errors::{Errors, accelerations_at};
pub(crate) use inertia::poles;

use errors::add_torques;
use inertia::torque_noise;
use predictable::predictable_seconds;
use restarts::Short;
use valid_time::{differences, least_variances};

/// The normalised error at which a prediction is no longer valid.
pub const THRESHOLD: f64 = 0.5;

/// The normalised error up to which a prediction follows a motion. A free motion is followed closely, a driven one as far as it is valid,
/// since recorded forces have errors of their own.
fn following(truth: &Trajectory) -> f64 {
    match truth.tau.iter().any(|&x| x != 0.0) {
        true => THRESHOLD,
        false => 0.5 * THRESHOLD,
    }
}

/// A prediction of one trajectory from its first state, under its forces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RolloutScore {
    /// The outcome of the rollout.
    pub outcome: Outcome,
    /// Duration of the truth, s.
    pub duration: f64,
    /// Time until the normalised error exceeded [`THRESHOLD`], s; see [`valid_prediction_time`].
    pub valid_seconds: f64,
    /// Whether the error exceeded it at all.
    pub exceeded: bool,
    /// Time until it exceeded [`THRESHOLD`] in a driven motion, and half of it in a free one, s.
    pub followed_seconds: f64,
    /// Time for which a good model follows this motion in that sense, s (theory.md, 139): three natural periods, unless the motion
    /// is chaotic, unstable or noisy; 0 where it is unknown.
    pub predictable_seconds: f64,
    /// Mean absolute error of q over the predicted samples, `[n]`, in the unit of q; on the circle for angles.
    pub q_mean_absolute: Vec<f64>,
}

/// A model's figures on some trajectories.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// The number of all samples.
    pub samples: usize,
    /// Errors of q̈ predicted from (q, q̇, τ); `None` where no trajectory has q̈, or the model has no forward dynamics.
    pub acceleration: Option<SignalError>,
    /// The part of the variance of q̈ that the errors of its estimate explain, mean over the coordinates; 0 where they are not known.
    pub acceleration_noise: f64,
    /// The parts of the variance of each τ that the errors of q̈ explain through the mass matrix, `[n]`; empty where they are not known.
    pub torque_noise: Vec<f64>,
    /// Errors of τ predicted from (q, q̇, q̈); `None` where no trajectory has q̈ and τ, or the model has no inverse dynamics.
    pub torque: Option<SignalError>,
    /// One free prediction for each trajectory; empty where the model has no forward dynamics.
    pub rollouts: Vec<RolloutScore>,
    /// Predictions over each of [`RESTARTS`] for which the trajectories are long enough.
    pub restarts: Vec<RestartScore>,
    /// The error a short time ahead; `None` where it is unknown.
    pub forecast: Option<Forecast>,
    /// States at which the mass matrix was singular.
    pub singular: usize,
    /// Distance of the samples from the states that the data of the model visited, where these are known.
    pub outside: Option<Outside>,
    /// The number of predictions that [`RolloutOptions::stop`] ended. Those of motions count up to their end, those over short
    /// times are omitted from all figures.
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

/// The predictions of a model for some trajectories; empty for a model without forward dynamics.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Predictions {
    /// The motion of each trajectory from its first state, as [`predict`].
    pub rollouts: Vec<Rollout>,
    /// The accelerations at the samples of each trajectory; `None` for a trajectory without q̈.
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

/// The predictions of a model that a score is computed from.
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

/// Steps of a prediction for each sample, and for each of the first hundred in addition: a good model needs few, a stiff one needs as many
/// as it is granted.
const STEPS: u64 = 20;
const MORE: (u64, u64) = (200, 100);
/// The largest number of these additional steps of all predictions together.
const MORE_OF_ALL: u64 = 2_000_000;

/// The options with a limit of steps that follows from the size of the task, for `count` such predictions.
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

/// The number of samples that are evaluated between two checks of the stop.
const SAMPLES: usize = 1 << 12;

/// The values of each part of the samples, at most [`SAMPLES`] samples each; the first part comes even after a stop.
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
    let accelerations = &predictions.accelerations;
    let least = least_variances(trajectories, model.coordinates().dof());
    let one_step = one_step(model, trajectories, accelerations, &least, options.stop);
    let pairs = trajectories.iter().zip(&predictions.rollouts);
    let rollouts = pairs.map(|(truth, prediction)| followed(model, truth, prediction));
    let rollouts = rollouts.collect::<Result<Vec<RolloutScore>>>()?;
    let short = |s: &f64| Short::new(model, trajectories, *s, usize::MAX, options);
    let shorts = RESTARTS.iter().filter(|_| model.moves()).map(short);
    let shorts: Vec<Short> = shorts.collect::<Result<_>>()?;
    let restarts = shorts.iter().map(|s| s.score(model.coordinates()));
    let stopped = rollouts.iter().filter(|r| r.outcome.is_stopped()).count();
    Ok(Score {
        stopped: stopped + shorts.iter().map(Short::stopped).sum::<usize>(),
        forecast: forecast::forecast(model, trajectories, shorts.first(), options)?,
        rollouts,
        restarts: restarts.filter(|s| s.starts > 0).collect(),
        ..one_step
    })
}

/// Time for the predictions of any recordings, time for those of a sample, and the longest time, s. A usable model needs a tenth of it.
const TIME: (f64, f64, f64) = (30.0, 2e-3, 600.0);

/// The time that a score of `samples` samples may take, after which [`RolloutOptions::stop`] should end it.
#[must_use]
pub fn time_for(samples: usize) -> Duration {
    let (any, sample, longest) = TIME;
    Duration::from_secs_f64((any + sample * samples as f64).min(longest))
}

/// Scores `model` on samples that need not follow each other: the errors of single samples, and no rollouts.
///
/// # Errors
/// As [`Trajectory::validate`], except for the times; [`crate::Error::Shape`] for samples of other degrees of freedom than the model.
pub fn score_samples(model: &dyn Model, samples: &[Trajectory]) -> Result<Score> {
    let n = model.coordinates().dof();
    let (mut predicted, remedy) = (Vec::new(), "give samples of the same system");
    for own in samples {
        own.validate()?;
        Error::check_shape("a state", own.dof(), n, remedy)?;
        let moves = model.moves();
        let accelerations = moves.then(|| accelerations(model, own, Stop::default()));
        predicted.push(accelerations.flatten());
    }
    Ok(one_step(model, samples, &predicted, &[], Stop::default()))
}

/// The errors of single samples; the variances of the accelerations count as these at least, `[n]` or none.
fn one_step(
    model: &dyn Model,
    trajectories: &[Trajectory],
    accelerations: &[Option<Accelerations>],
    least: &[f64],
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
    let acceleration = acceleration.finish_with(least);
    let noise = |error: &SignalError| estimate_noise(trajectories, error);
    Score {
        samples: trajectories.iter().map(Trajectory::len).sum(),
        acceleration_noise: acceleration.as_ref().map_or(0.0, noise),
        acceleration,
        torque_noise: torque_noise(model, trajectories),
        torque: torque.finish(),
        rollouts: Vec::new(),
        restarts: Vec::new(),
        forecast: None,
        singular,
        outside: outside(model, trajectories),
        stopped: 0,
    }
}

/// The squared standard errors of accelerations over the variances that `error` tells, mean over the coordinates.
fn estimate_noise(trajectories: &[Trajectory], error: &SignalError) -> f64 {
    let samples: usize = trajectories.iter().map(Trajectory::len).sum();
    let errors: Vec<f64> = trajectories
        .iter()
        .flat_map(|t| &t.errors.qdd)
        .copied()
        .collect();
    let squares = column(&errors, error.mse.len(), |x| x.map(|e| e * e).sum());
    let parts = squares.iter().zip(error.nmse.iter().zip(&error.mse));
    let parts = parts.map(|(sum, (nmse, mse))| sum / samples.max(1) as f64 * nmse / mse);
    mean(&mut parts.filter(|part| part.is_finite()))
}

/// The motion that the model predicts for a trajectory, from its first state, under its forces, at its times.
///
/// # Errors
/// As [`score`].
pub fn predict(model: &dyn Model, truth: &Trajectory, options: &RolloutOptions) -> Result<Rollout> {
    predict_held(model, truth, Hold::Previous, options)
}

/// [`predict`] with this interpolation of the forces.
fn predict_held(
    model: &dyn Model,
    truth: &Trajectory,
    hold: Hold,
    options: &RolloutOptions,
) -> Result<Rollout> {
    truth.validate()?;
    let n = model.coordinates().dof();
    truth.check_dof(n)?;
    if !truth.tau.is_empty() || model.driven().is_some() {
        return rollout_recorded(model, truth, hold, options);
    }
    let (q, qd) = (&truth.q[..n], &truth.qd[..n]);
    rollout(model, q, qd, &truth.t, &free, options)
}

fn followed(model: &dyn Model, truth: &Trajectory, prediction: &Rollout) -> Result<RolloutScore> {
    let duration = truth.t.last().unwrap_or(&0.0) - truth.t.first().unwrap_or(&0.0);
    if prediction.trajectory.is_empty() {
        // Without a momentum of its first velocity the motion does not begin.
        return Ok(RolloutScore {
            outcome: prediction.outcome,
            duration,
            valid_seconds: 0.0,
            exceeded: true,
            followed_seconds: 0.0,
            predictable_seconds: 0.0,
            q_mean_absolute: vec![f64::NAN; model.coordinates().dof()],
        });
    }
    let predicted = &prediction.trajectory;
    let valid = |threshold| valid_prediction_time(truth, predicted, model.coordinates(), threshold);
    let ValidTime { seconds, exceeded } = valid(THRESHOLD)?;
    Ok(RolloutScore {
        outcome: prediction.outcome,
        duration,
        valid_seconds: seconds,
        exceeded,
        followed_seconds: valid(following(truth))?.seconds,
        predictable_seconds: predictable_seconds(model, truth, predicted),
        q_mean_absolute: mean_absolute(model.coordinates(), &truth.q, &predicted.q),
    })
}

/// The mean absolute difference of positions, `[n]`; on the circle for angles.
fn mean_absolute(coordinates: &Coordinates, truth: &[f64], predicted: &[f64]) -> Vec<f64> {
    let errors: Vec<f64> = differences(coordinates, truth, predicted).collect();
    column(&errors, coordinates.dof(), |x| mean(&mut x.map(f64::abs)))
}

#[cfg(test)]
mod tests;
