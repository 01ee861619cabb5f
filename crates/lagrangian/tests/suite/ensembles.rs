//! Ensembles: bands that hold the stated part, and members that are fitted to different blocks.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::TrainingTask;
use lagrangian::ensemble::{Calibration, Ensemble, fit_ensemble};
use lagrangian::rollout::{free, times};
use lagrangian::{
    Budget, Dataset, Error, FitConfig, LnnConfig, Loss, Model, RolloutOptions, Trajectory,
    analytic, rollout, split,
};
use rand::{RngExt, SeedableRng};

/// Swings of a pendulum under torques, with noise in the torque.
fn swings(count: u64, seed: u64) -> Vec<Trajectory> {
    let pendulum = analytic::by_name("pendulum", &[]).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let options = RolloutOptions::default();
    let mut swing = || {
        let (q0, qd0) = (rng.random_range(-2.0..2.0), rng.random_range(-2.0..2.0));
        let times = times(2.0, 0.02).unwrap();
        let mut motion = rollout(&*pendulum, &[q0], &[qd0], &times, &free, &options)
            .unwrap()
            .trajectory;
        let m = motion.len();
        motion.qdd = vec![0.0; m];
        let zeros = vec![0.0; m];
        let (q, qd) = (motion.q.clone(), motion.qd.clone());
        let mut evaluator = pendulum.evaluator();
        let _ = evaluator.forward_dynamics(&q, &qd, &zeros, &mut motion.signals.qdd);
        // Noise that is not normally distributed.
        motion.tau = (0..m)
            .map(|_| 0.3 * rng.random_range(-1.0_f64..1.0).powi(3))
            .collect();
        motion
    };
    (0..count).map(|_| swing()).collect()
}

fn dataset(seed: u64) -> Dataset {
    let pendulum = analytic::by_name("pendulum", &[]).unwrap();
    let (train, validation) = split(swings(30, seed), 0.2, 0).unwrap();
    Dataset::new(pendulum.coordinates().clone(), &train, &validation).unwrap()
}

fn config() -> FitConfig {
    FitConfig {
        family: Box::new(LnnConfig {
            width: 12,
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            loss: Loss::TORQUE,
            budget: Budget::Steps(60),
            batch: 64,
            ..TrainingTask::default()
        },
    }
}

#[test]
fn bands_hold_what_they_say_of_new_motions() {
    let ensemble = fit_ensemble(&dataset(1), &config(), 6, &mut ()).unwrap();
    let coverage = ensemble.coverage(&swings(30, 2));
    let torque = coverage.torque.unwrap();
    for (found, level) in torque.all.iter().zip([0.5, 0.8, 0.95]) {
        assert!((found - level).abs() < 0.05, "{level}: {found}");
    }
    assert_eq!(torque.samples, 30 * 101);
    let position = coverage.position.unwrap();
    assert!(position.all[1] > 0.6, "{position:?}");
    // The band is wider where there were no data.
    let deviation = |qd: f64| ensemble.torques(&[0.5], &[qd], &[1.0]).unwrap().deviation[0];
    let (far, near) = (deviation(40.0), deviation(1.0));
    assert!(far > 1.5 * near, "{far} {near}");
    let visited = ensemble.members()[0].visited().unwrap();
    let coordinates = ensemble.members()[0].coordinates();
    assert!(visited.distance(coordinates, &[0.5], &[40.0]) > 1.0);
}

#[test]
fn the_same_seed_gives_the_same_bits_and_members_differ() {
    let data = dataset(3);
    let torque = || {
        let ensemble = fit_ensemble(&data, &config(), 3, &mut ()).unwrap();
        let answer = |member: &lagrangian::Learned| {
            let mut tau = [0.0];
            let _ = member
                .evaluator()
                .inverse_dynamics(&[0.3], &[1.0], &[2.0], &mut tau);
            tau[0]
        };
        ensemble.members().iter().map(answer).collect::<Vec<f64>>()
    };
    let (first, second) = (torque(), torque());
    assert_eq!(first, second);
    let apart = |a: f64, b: f64| (a - b).abs() > 1e-6;
    assert!(apart(first[0], first[1]) && apart(first[1], first[2]));
}

#[test]
fn levels_quantiles_and_wrong_arguments() {
    let data = dataset(4);
    let ensemble = fit_ensemble(&data, &config(), 3, &mut ()).unwrap();
    let torque = ensemble.torques(&[0.3], &[1.0], &[2.0]).unwrap();
    let (low, high) = torque.band(0.8).unwrap();
    assert_eq!(torque.quantile(0.1).unwrap(), low);
    assert_eq!(torque.quantile(0.9).unwrap(), high);
    assert_eq!(torque.quantile(0.5).unwrap(), torque.mean);
    let (inner, outer) = (
        torque.band(0.5).unwrap().1[0],
        torque.band(0.99).unwrap().1[0],
    );
    assert!(inner < high[0] && high[0] < outer);
    for level in [-0.1, 0.995, f64::NAN] {
        assert!(matches!(torque.band(level), Err(Error::Argument { .. })));
    }
    assert!(torque.quantile(0.999).is_err());
    assert!(ensemble.torques(&[0.3], &[1.0], &[]).is_err());
    assert!(ensemble.torques(&[0.3], &[f64::NAN], &[1.0]).is_err());
    assert!(ensemble.positions(&[&[0.0]]).is_err());
    for members in [0, 1, 101] {
        assert!(fit_ensemble(&data, &config(), members, &mut ()).is_err());
    }
    let calibration = ensemble.calibration().clone();
    let text = serde_json::to_string(&calibration).unwrap();
    let again: Calibration = serde_json::from_str(&text).unwrap();
    assert_eq!(again, calibration);
    let members = ensemble.members().to_vec();
    assert!(Ensemble::new(members[..1].to_vec(), calibration.clone()).is_err());
    let mut damaged = calibration;
    damaged.torque.as_mut().unwrap().floor.push(1.0);
    assert!(Ensemble::new(members, damaged).is_err());
}
