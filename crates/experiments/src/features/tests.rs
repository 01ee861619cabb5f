//! Lagrangians that are linear in random features.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::dataset::random_states;
use lagrangian::mechanics::Outcome;
use lagrangian::rollout::{free, times};
use lagrangian::trajectory::Samples;
use lagrangian::{Dataset, Learned, Model, RolloutOptions, Signals, rollout};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{FeaturesConfig, Lnn, solve};

/// Random states of the pendulum under random torques.
fn forced(m: usize, seed: u64) -> Samples {
    let system = by_name("pendulum", &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut column =
        |size: f64| -> Vec<f64> { (0..m).map(|_| rng.random_range(-size..size)).collect() };
    let (q, qd, tau) = (column(3.1), column(6.0), column(5.0));
    let mut qdd = vec![0.0; m];
    let _ = system.evaluator().forward_dynamics(&q, &qd, &tau, &mut qdd);
    Samples::new(
        1,
        Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        },
    )
}

fn pendulum() -> Dataset {
    let coordinates = by_name("pendulum", &[]).unwrap().coordinates().clone();
    Dataset::from_samples(coordinates, forced(1000, 1), forced(250, 2)).unwrap()
}

fn fitted(dataset: &Dataset) -> Learned {
    let solution = solve::solve(dataset, &FeaturesConfig::default(), 0);
    solution.unwrap().model
}

/// Mean squared error over the mean square of the truth.
fn normalized(found: &[f64], truth: &[f64]) -> f64 {
    let error: f64 = found.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum();
    error / truth.iter().map(|x| x * x).sum::<f64>()
}

#[test]
fn the_torques_of_a_pendulum_are_learned_by_one_regression() {
    let model = fitted(&pendulum());
    let held = forced(500, 3);
    let mut tau = vec![0.0; held.tau.len()];
    let _ = model
        .evaluator()
        .inverse_dynamics(&held.q, &held.qd, &held.qdd, &mut tau);
    let error = normalized(&tau, &held.tau);
    println!("nMSE of torques: {error:.1e}");
    assert!(error < 1e-4, "{error:.1e}");
}

#[test]
fn the_motion_of_a_pendulum_is_learned_without_forces_and_keeps_its_true_energy() {
    let system = by_name("pendulum", &[]).unwrap();
    for dataset in [pendulum(), random_states(&*system, 2000, 500, 4).unwrap()] {
        let model = fitted(&dataset);
        let times = times(20.0, 0.05).unwrap();
        let options = RolloutOptions::default();
        let motion = rollout(&model, &[1.5], &[0.0], &times, &free, &options).unwrap();
        assert_eq!(motion.outcome, Outcome::Finished);
        let path = &motion.trajectory;
        let mut energy = vec![0.0; path.len()];
        assert!(
            system
                .evaluator()
                .energy(&path.q, &path.qd, &mut energy)
                .is_finite()
        );
        // From the bottom to the top it is 2 m g l = 19.6 J.
        let worst = energy
            .iter()
            .fold(0.0, |w: f64, e| w.max((e - energy[0]).abs()));
        println!(
            "forced: {}, worst energy error {:.1e}",
            dataset.forced,
            worst / 19.6
        );
        assert!(worst < 0.01 * 19.6, "{worst} J");
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let dataset = pendulum();
    let weights = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let model = pool.install(|| fitted(&dataset));
        let lagrangian = model.lagrangian_as::<Lnn>().unwrap();
        lagrangian.parameters().to_vec()
    };
    let bits = |threads| {
        weights(threads)
            .iter()
            .map(|w| w.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(1), bits(3));
}
