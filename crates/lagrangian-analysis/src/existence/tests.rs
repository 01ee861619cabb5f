#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;
use lagrangian::analytic::{by_name, normal};
use lagrangian::rollout::{free, times};
use lagrangian::{
    Budget, Coordinates, Dissipation, Error, Mechanical, Model, RolloutOptions, Trajectory, rollout,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Where recordings of a system begin, and how long they last.
pub(super) struct Starts {
    /// The length of a recording, s.
    pub(super) duration: f64,
    /// |q| at the start is at most this.
    pub(super) q: f64,
    /// |q̇| at the start is at most this.
    pub(super) qd: f64,
}

/// `count` free motions of 150 samples from random starts.
pub(super) fn recordings(
    model: &dyn Model,
    starts: &Starts,
    count: usize,
    seed: u64,
) -> Vec<Trajectory> {
    let n = model.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform =
        |bound: f64| -> Vec<f64> { (0..n).map(|_| rng.random_range(-bound..bound)).collect() };
    let times = times(starts.duration, starts.duration / 149.0).unwrap();
    let mut one = |k| {
        let (q, qd) = (uniform(starts.q), uniform(starts.qd));
        let motion = rollout(model, &q, &qd, &times, &free, &RolloutOptions::default()).unwrap();
        Trajectory {
            name: format!("recording {k}"),
            ..motion.trajectory
        }
    };
    (0..count).map(&mut one).collect()
}

/// Recordings of a pendulum, which may have dry friction.
fn pendulums(coulomb: f64, count: usize) -> Vec<Trajectory> {
    let pendulum = by_name("pendulum", &[]).unwrap();
    let friction = Dissipation {
        coulomb: vec![coulomb],
        smoothing: vec![0.1],
        ..Dissipation::viscous(vec![0.0])
    };
    let starts = Starts {
        duration: 6.0,
        q: 2.5,
        qd: 2.0,
    };
    match coulomb > 0.0 {
        true => {
            let damped = Mechanical::dissipative(pendulum.lagrangian(), friction).unwrap();
            recordings(&damped, &starts, count, 1)
        }
        false => recordings(&*pendulum, &starts, count, 1),
    }
}

/// The recordings with white noise on the accelerations, `part` of their root mean square.
fn noisy(mut recordings: Vec<Trajectory>, part: f64) -> Vec<Trajectory> {
    let deviation = part * acceleration(&recordings);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for x in recordings.iter_mut().flat_map(|r| &mut r.qdd) {
        *x += deviation * normal(&mut rng);
    }
    recordings
}

/// Root mean square of all accelerations.
fn acceleration(recordings: &[Trajectory]) -> f64 {
    let qdd: Vec<f64> = recordings.iter().flat_map(|r| r.qdd.clone()).collect();
    (qdd.iter().map(|x| x * x).sum::<f64>() / qdd.len() as f64).sqrt()
}

fn surveyed(recordings: &[Trajectory]) -> Survey {
    let config = SurveyConfig {
        budget: Budget::Steps(80),
        ..SurveyConfig::default()
    };
    survey(&Coordinates::angles(1), recordings, &config, &mut ()).unwrap()
}

#[test]
fn a_pendulum_needs_no_friction_and_one_with_dry_friction_does() {
    for (coulomb, truth) in [(0.0, Existence::Lagrangian), (0.3, Existence::WithFriction)] {
        let found = surveyed(&pendulums(coulomb, 16));
        assert_eq!(found.verdict.existence, truth, "{:?}", found.verdict);
        // Four recordings are held out of the sixteen.
        assert!(
            (0.9..=0.9375).contains(&found.verdict.confidence),
            "{:?}",
            found.verdict
        );
    }
}

#[test]
fn noise_bounds_what_can_be_said_of_hidden_forces() {
    let recordings = noisy(pendulums(0.0, 16), 0.05);
    let found = surveyed(&recordings);
    assert_eq!(
        found.verdict.existence,
        Existence::Lagrangian,
        "{:?}",
        found.verdict
    );
    let size = acceleration(&recordings);
    // A force must add thrice the variance of the noise to double the error.
    assert!(
        (found.hidden[0] / (3.0_f64.sqrt() * 0.05 * size) - 1.0).abs() < 0.3,
        "{found:?}"
    );
}

#[test]
fn one_recording_is_enough_for_a_guess_and_not_for_certainty() {
    let found = surveyed(&pendulums(0.3, 1));
    assert!(found.verdict.confidence <= 0.75, "{:?}", found.verdict);
    assert_eq!(found.unrestricted.squares.len(), 8);
}

#[test]
fn too_few_samples_are_refused_with_their_number() {
    let short = pendulums(0.0, 1)[0].part(0..60);
    let refused = survey(
        &Coordinates::angles(1),
        &[short],
        &SurveyConfig::default(),
        &mut (),
    );
    assert!(
        matches!(refused, Err(Error::TooShort { found: 60, .. })),
        "{refused:?}"
    );
}
