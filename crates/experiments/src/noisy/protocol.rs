//! Models of noisy recordings: fits of estimated accelerations against fits through an integrator.
//!
//! Recordings are free motions with white noise on positions and velocities, in parts of the deviation of each
//! component. What a fit found is judged without noise: accelerations along true motions, and how long its motion stays
//! near the true one.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use lagrangian::analytic::normal;
use lagrangian::dataset::Dataset;
use lagrangian::dynamics::Model;
use lagrangian::lagrangian::analytic::AnalyticModel;
use lagrangian::rollout::{Rollout, RolloutOptions, free, rollout_many, times};
use lagrangian::score::valid_prediction_time;
use lagrangian::trajectory::Signals;
use lagrangian::trajectory::{Columns, EstimateOptions, Recording};
use lagrangian::{Coordinates, Error, Result, Trajectory};

/// How recordings are made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Protocol {
    /// Recordings to fit, and as many more for validation by a quarter.
    pub(crate) recordings: usize,
    /// Length of each, s.
    pub(crate) duration: f64,
    /// Time from one sample to the next, s.
    pub(crate) step: f64,
    /// Noise on q and q̇, in parts of the deviation of each component.
    pub(crate) noise: f64,
    /// True motions that a model is judged by.
    pub(crate) tests: usize,
    /// Length of each, s.
    pub(crate) test_duration: f64,
}

/// Recordings, and true motions to judge by.
#[derive(Debug, Clone)]
pub(crate) struct Noisy {
    /// What is fitted: accelerations are estimated from the noisy velocities.
    pub(crate) dataset: Dataset,
    /// True motions with their accelerations.
    pub(crate) truth: Vec<Rollout>,
    /// Deviation of the estimated accelerations from the true ones over those.
    pub(crate) estimate_error: f64,
}

/// Records a system as the protocol says.
pub(crate) fn record(system: &dyn AnalyticModel, protocol: &Protocol, seed: u64) -> Result<Noisy> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let held = protocol.recordings.div_ceil(4);
    let mut motions = |count: usize, duration: f64| {
        let starts: Vec<_> = (0..count).map(|_| system.sample_start(&mut rng)).collect();
        let times = times(duration, protocol.step)?;
        rollout_many(system, &starts, &times, &free, &RolloutOptions::truth())
    };
    let clean = motions(protocol.recordings + held, protocol.duration)?;
    let mut truth = motions(protocol.tests, protocol.test_duration)?;
    for rollout in &mut truth {
        rollout.trajectory.qdd = accelerations(system, &rollout.trajectory);
    }
    let scales = deviations(&clean, system.coordinates());
    let sigma: Vec<f64> = scales.iter().map(|s| s * protocol.noise).collect();
    let mut trajectories = Vec::new();
    let (mut errors, mut squares) = (0.0, 0.0);
    for rollout in &clean {
        let noisy = with_noise(&rollout.trajectory, &sigma, &mut rng);
        let recording = recording(noisy, system.coordinates());
        let (trajectory, _) = recording.into_trajectory(&EstimateOptions::default())?;
        let exact = accelerations(system, &rollout.trajectory);
        for (a, b) in trajectory.qdd.iter().zip(&exact) {
            errors += (a - b).powi(2);
            squares += b * b;
        }
        trajectories.push(trajectory);
    }
    let (train, validation) = trajectories.split_at(protocol.recordings);
    Ok(Noisy {
        dataset: Dataset::new(system.coordinates().clone(), train, validation)?,
        truth,
        estimate_error: (errors / squares).sqrt(),
    })
}

fn accelerations(system: &dyn Model, trajectory: &Trajectory) -> Vec<f64> {
    let mut qdd = vec![0.0; trajectory.q.len()];
    let free = vec![0.0; trajectory.q.len()];
    let mut evaluator = system.evaluator();
    let _ = evaluator.forward_dynamics(&trajectory.q, &trajectory.qd, &free, &mut qdd);
    qdd
}

/// Deviations of the components of (q, q̇) over all motions, `[2n]`; of an angle at most that of a uniform one.
fn deviations(motions: &[Rollout], coordinates: &Coordinates) -> Vec<f64> {
    let n = coordinates.dof();
    let one = |c: usize| {
        let values = || {
            let of = |r: &'_ Rollout| {
                let x = if c < n {
                    &r.trajectory.q
                } else {
                    &r.trajectory.qd
                };
                x.iter().skip(c % n).step_by(n).copied().collect::<Vec<_>>()
            };
            motions.iter().flat_map(of)
        };
        let count = values().count().max(1) as f64;
        let mean = values().sum::<f64>() / count;
        let deviation = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
        match c < n && coordinates.is_circle(c) {
            true => deviation.min(std::f64::consts::PI / 3f64.sqrt()),
            false => deviation,
        }
    };
    (0..2 * n).map(one).collect()
}

fn with_noise(trajectory: &Trajectory, sigma: &[f64], rng: &mut ChaCha8Rng) -> Trajectory {
    let mut noisy = trajectory.clone();
    let n = noisy.dof();
    let Signals { q, qd, .. } = &mut noisy.signals;
    for (x, sigma) in [(q, &sigma[..n]), (qd, &sigma[n..])] {
        let pairs = x.iter_mut().zip(sigma.iter().cycle());
        pairs.for_each(|(x, s)| *x += s * normal(rng));
    }
    noisy
}

/// As it would stand in a file.
fn recording(trajectory: Trajectory, coordinates: &Coordinates) -> Recording {
    Recording {
        name: trajectory.name,
        coordinates: coordinates.clone(),
        t: trajectory.t,
        columns: Columns::default(),
        unwrapped: vec![0; coordinates.dof()],
        sampled: None,
        signals: Signals {
            q: trajectory.signals.q,
            qd: trajectory.signals.qd,
            ..Signals::default()
        },
    }
}

/// How well a model knows the motion without noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Errors {
    /// Root mean square error of accelerations along true motions, over their root mean square.
    pub(crate) acceleration: f64,
    /// Median valid prediction time, s, the model integrated exactly; at most the duration.
    pub(crate) valid: f64,
    /// The same with steps of another length by the method that it was trained through: (step over that of the data,
    /// s).
    pub(crate) steps: Vec<(f64, f64)>,
}

/// The error, in deviations of the motion, beyond which a prediction is no longer valid.
const THRESHOLD: f64 = 0.5;

/// The errors of a model along the true motions; `step` is that of the data.
pub(crate) fn errors(model: &dyn Model, truth: &[Rollout], step: f64) -> Result<Errors> {
    let (mut errors, mut squares) = (0.0, 0.0);
    for rollout in truth {
        let found = accelerations(model, &rollout.trajectory);
        let exact = rollout.trajectory.qdd.iter();
        for (a, b) in found.iter().zip(exact) {
            errors += (a - b).powi(2);
            squares += b * b;
        }
    }
    let exact = RolloutOptions::default();
    let fixed = |factor: f64| -> Result<(f64, f64)> {
        let options = RolloutOptions {
            method: lagrangian::Method::Rk4,
            step: factor * step,
            ..RolloutOptions::default()
        };
        Ok((factor, valid(model, truth, &options, factor)?))
    };
    Ok(Errors {
        acceleration: (errors / squares).sqrt(),
        valid: valid(model, truth, &exact, 1.0)?,
        steps: [0.25, 1.0, 4.0]
            .into_iter()
            .map(fixed)
            .collect::<Result<_>>()?,
    })
}

/// Median valid prediction time on every `stride`-th sample of the true motions, where a step may not be shorter.
fn valid(
    model: &dyn Model,
    truth: &[Rollout],
    options: &RolloutOptions,
    stride: f64,
) -> Result<f64> {
    let Some(first) = truth.first() else {
        return Err(Error::argument("true motions", "none", "at least one"));
    };
    let stride = (stride.round() as usize).max(1);
    let thin = |rollout: &Rollout| thinned(&rollout.trajectory, stride);
    let truth: Vec<Trajectory> = truth.iter().map(thin).collect();
    let starts: Vec<_> = truth.iter().map(start).collect();
    let times = &thinned(&first.trajectory, stride).t;
    let found = rollout_many(model, &starts, times, &free, options)?;
    let mut seconds = Vec::new();
    for (truth, found) in truth.iter().zip(&found) {
        let coordinates = model.coordinates();
        let valid = valid_prediction_time(truth, &found.trajectory, coordinates, THRESHOLD)?;
        seconds.push(valid.seconds);
    }
    seconds.sort_by(f64::total_cmp);
    let middle = seconds.len() / 2;
    Ok(match seconds.len().is_multiple_of(2) {
        true => 0.5 * (seconds[middle - 1] + seconds[middle]),
        false => seconds[middle],
    })
}

fn start(trajectory: &Trajectory) -> lagrangian::State {
    let n = trajectory.dof();
    lagrangian::State::new(trajectory.q[..n].to_vec(), trajectory.qd[..n].to_vec())
}

/// Every `stride`-th sample.
fn thinned(trajectory: &Trajectory, stride: usize) -> Trajectory {
    let n = trajectory.dof().max(1);
    let rows = |x: &[f64]| -> Vec<f64> {
        let rows = x.chunks_exact(n).step_by(stride);
        rows.flatten().copied().collect()
    };
    Trajectory::new(
        trajectory.name.clone(),
        trajectory.t.iter().step_by(stride).copied().collect(),
        Signals {
            q: rows(&trajectory.q),
            qd: rows(&trajectory.qd),
            ..Signals::default()
        },
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::lagrangian::analytic::by_name;

    const PROTOCOL: Protocol = Protocol {
        recordings: 3,
        duration: 2.0,
        step: 0.05,
        noise: 0.05,
        tests: 3,
        test_duration: 4.0,
    };

    #[test]
    fn the_true_model_is_valid_to_the_end_and_accelerations_from_noise_are_poor() {
        let pendulum = by_name("pendulum", &[]).unwrap();
        let noisy = record(&*pendulum, &PROTOCOL, 1).unwrap();
        assert!(
            (0.03..1.0).contains(&noisy.estimate_error),
            "{}",
            noisy.estimate_error
        );
        let found = errors(&*pendulum, &noisy.truth, PROTOCOL.step).unwrap();
        assert!(found.acceleration < 1e-14 && (found.valid - 4.0).abs() < 1e-9);
    }
}
