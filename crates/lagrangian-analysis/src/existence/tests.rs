#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::field::FieldScale;
use super::*;
use lagrangian::analytic::{by_name, normal};
use lagrangian::mechanics::{Dissipation, Evaluation, Mechanical};
use lagrangian::rollout::{free, times};
use lagrangian::{
    Budget, Coordinates, Error, Evaluator, Model, RolloutOptions, Trajectory, rollout,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A law q̈ = a(q, q̇) of these coordinates; the function writes a.
#[derive(Clone)]
pub(super) struct Law(Coordinates, fn(&[f64], &[f64], &mut [f64]));

impl Model for Law {
    fn coordinates(&self) -> &Coordinates {
        &self.0
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.clone())
    }
}

impl Evaluator for Law {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        _: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.0.dof();
        for at in (0..qdd.len()).step_by(n) {
            let state = at..at + n;
            self.1(&q[state.clone()], &qd[state.clone()], &mut qdd[state]);
        }
        Evaluation::of(qdd, n, 0)
    }
}

/// A law whose motions all end in one cycle, on which a Lagrangian does not exist.
pub(super) fn van_der_pol() -> Law {
    Law(Coordinates::lines(1), |q, qd, qdd| {
        qdd[0] = 2.0 * (1.0 - q[0] * q[0]) * qd[0] - q[0];
    })
}

/// A particle with an internal drive to the speed 1.
pub(super) fn active_particle() -> Law {
    Law(Coordinates::lines(2), |q, qd, qdd| {
        let drive = 1.0 - (qd[0] * qd[0] + qd[1] * qd[1]);
        (qdd[0], qdd[1]) = (drive * qd[0] - q[0], drive * qd[1] - 1.5 * q[1]);
    })
}

/// A particle in a force of positions that is not the gradient of a potential.
pub(super) fn curl_force() -> Law {
    Law(Coordinates::lines(2), |q, _, qdd| {
        let k = 0.1 * (q[0] * q[0] + q[1] * q[1]);
        (qdd[0], qdd[1]) = (-q[0] - k * q[1], k * q[0] - q[1]);
    })
}

/// Scales 1 of `n` coordinates.
pub(super) fn unit(n: usize, time: f64) -> FieldScale {
    FieldScale {
        signals: std::array::from_fn(|_| vec![1.0; n]),
        time,
    }
}

/// Initial states of recordings of a system, and their duration.
pub(super) struct Starts {
    /// Length of a recording, s.
    pub(super) duration: f64,
    /// Largest |q| at the start.
    pub(super) q: f64,
    /// Largest |q̇| at the start.
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
    let qdd: Vec<f64> = recordings.iter().flat_map(|r| r.qdd.clone()).collect();
    let deviation = part * (qdd.iter().map(|x| x * x).sum::<f64>() / qdd.len() as f64).sqrt();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for x in recordings.iter_mut().flat_map(|r| &mut r.qdd) {
        *x += deviation * normal(&mut rng);
    }
    recordings
}

fn surveyed(recordings: &[Trajectory]) -> Survey {
    let config = SurveyConfig {
        budget: Budget::Steps(80),
        seed: 0,
    };
    survey(&Coordinates::angles(1), recordings, &config, &mut ()).unwrap()
}

#[test]
fn a_pendulum_needs_no_friction_and_one_with_dry_friction_does() {
    for (coulomb, truth) in [(0.0, Existence::Lagrangian), (0.3, Existence::WithFriction)] {
        let found = surveyed(&pendulums(coulomb, 16));
        assert_eq!(found.verdict.existence, truth, "{:?}", found.verdict);
        // Four of the sixteen recordings are held out.
        assert!(
            (0.9..=0.9375).contains(&found.verdict.confidence),
            "{:?}",
            found.verdict
        );
    }
}

#[test]
fn a_pendulum_is_lagrangian_under_noise_of_its_accelerations() {
    let found = surveyed(&noisy(pendulums(0.0, 16), 0.05));
    assert_eq!(
        found.verdict.existence,
        Existence::Lagrangian,
        "{:?}",
        found.verdict
    );
}

#[test]
fn recordings_at_rest_are_refused() {
    let mut still = pendulums(0.0, 4);
    for recording in &mut still {
        recording.qd.fill(0.0);
        recording.qdd.fill(0.0);
    }
    let config = SurveyConfig {
        budget: Budget::Steps(1),
        seed: 0,
    };
    let refused = survey(&Coordinates::angles(1), &still, &config, &mut ()).unwrap_err();
    assert!(
        refused.to_string().contains("recordings that move"),
        "{refused}"
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
    let config = SurveyConfig {
        budget: Budget::Steps(1),
        seed: 0,
    };
    let refused = survey(&Coordinates::angles(1), &[short], &config, &mut ());
    assert!(
        matches!(refused, Err(Error::TooShort { found: 60, .. })),
        "{refused:?}"
    );
}
