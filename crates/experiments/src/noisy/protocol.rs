//! Models of noisy recordings: fits of estimated accelerations against fits through an integrator.
//!
//! Recordings are free motions with white noise on positions and velocities, in parts of the deviation of each
//! component. A fit is measured without noise: accelerations along true motions, and how long its motion stays
//! near the true one.

use lagrangian::analytic::{AnalyticModel, normal};
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::score::valid_prediction_time;
use lagrangian::{
    Coordinates, Dataset, Error, Model, Result, Rollout, RolloutOptions, Signals, Trajectory,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::data::{accelerations, column, estimated, first_state, relative_error, thinned};
use crate::harness::spread::median;

/// How recordings are made.
pub(crate) struct Protocol {
    /// Recordings to fit, and as many more for validation by a quarter.
    pub(crate) recordings: usize,
    /// Length of each, s.
    pub(crate) duration: f64,
    /// Time from one sample to the next, s.
    pub(crate) step: f64,
    /// Noise on q and q̇, in parts of the deviation of each component.
    pub(crate) noise: f64,
    /// True motions that a model is tested on.
    pub(crate) tests: usize,
    /// Length of each, s.
    pub(crate) test_duration: f64,
}

/// Recordings, and true motions to test on.
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
        rollout.trajectory.qdd = free_accelerations(system, &rollout.trajectory);
    }
    let scales = deviations(&clean, system.coordinates());
    let sigma: Vec<f64> = scales.iter().map(|s| s * protocol.noise).collect();
    let (mut trajectories, mut exact) = (Vec::new(), Vec::new());
    for rollout in &clean {
        let noisy = with_noise(&rollout.trajectory, &sigma, &mut rng);
        trajectories.push(estimated(noisy, system.coordinates())?);
        exact.push(free_accelerations(system, &rollout.trajectory));
    }
    let accelerations = trajectories.iter().flat_map(|t| &t.signals.qdd);
    let estimate_error = relative_error(accelerations.zip(exact.iter().flatten()));
    let (train, validation) = trajectories.split_at(protocol.recordings);
    Ok(Noisy {
        dataset: Dataset::new(system.coordinates().clone(), train, validation)?,
        truth,
        estimate_error,
    })
}

fn free_accelerations(model: &dyn Model, motion: &Trajectory) -> Vec<f64> {
    accelerations(model, &motion.q, &motion.qd, &vec![0.0; motion.q.len()])
}

/// Deviations of the components of (q, q̇) over all motions, `[2n]`; of an angle at most that of a uniform one.
fn deviations(motions: &[Rollout], coordinates: &Coordinates) -> Vec<f64> {
    let n = coordinates.dof();
    let one = |c: usize| {
        let signals = motions.iter().map(|r| match c < n {
            true => &r.trajectory.signals.q,
            false => &r.trajectory.signals.qd,
        });
        let values: Vec<f64> = signals.flat_map(|x| column(x, n, c % n)).collect();
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let deviation = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
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

/// How well a model knows the motion without noise.
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

/// Steps of rollouts over that of the data.
const STEPS: [f64; 3] = [0.25, 1.0, 4.0];

/// The errors of a model along the true motions; `step` is that of the data.
pub(crate) fn errors(model: &dyn Model, truth: &[Rollout], step: f64) -> Result<Errors> {
    let found = truth
        .iter()
        .map(|r| free_accelerations(model, &r.trajectory));
    let found: Vec<f64> = found.flatten().collect();
    let right = truth.iter().flat_map(|r| &r.trajectory.signals.qdd);
    let exact = RolloutOptions::default();
    let fixed = |factor: f64| -> Result<(f64, f64)> {
        let options = RolloutOptions {
            method: lagrangian::integrate::Method::Rk4,
            step: factor * step,
            ..RolloutOptions::default()
        };
        Ok((factor, valid(model, truth, &options, factor)?))
    };
    Ok(Errors {
        acceleration: relative_error(found.iter().zip(right)),
        valid: valid(model, truth, &exact, 1.0)?,
        steps: STEPS.into_iter().map(fixed).collect::<Result<_>>()?,
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
    let starts: Vec<_> = truth.iter().map(first_state).collect();
    let times = &thinned(&first.trajectory, stride).t;
    let found = rollout_many(model, &starts, times, &free, options)?;
    let coordinates = model.coordinates();
    let seconds = truth.iter().zip(&found).map(|(truth, found)| {
        let valid = valid_prediction_time(truth, &found.trajectory, coordinates, THRESHOLD)?;
        Ok(valid.seconds)
    });
    Ok(median(&seconds.collect::<Result<Vec<f64>>>()?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::analytic::by_name;

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
