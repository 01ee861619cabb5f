//! Lagrangians that are linear in random features.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::dataset::random_states;
use lagrangian::mechanics::Outcome;
use lagrangian::models::{FeatureLagrangian, FeaturesConfig};
use lagrangian::rollout::{free, times};
use lagrangian::train::ForceTerms;
use lagrangian::trajectory::Samples;
use lagrangian::{
    Dataset, Error, FitConfig, FitSpec, Learned, Loss, Model, Provenance, RolloutOptions,
    SavedModel, Signals, fit, rollout,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

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

fn fitted(dataset: &Dataset, family: FeaturesConfig) -> Learned {
    let config = FitConfig {
        family: Box::new(family),
        ..FitConfig::default()
    };
    fit(dataset, &config, None, &mut ()).unwrap().model
}

/// Mean squared error over the mean square of the truth.
fn normalized(found: &[f64], truth: &[f64]) -> f64 {
    let error: f64 = found.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum();
    error / truth.iter().map(|x| x * x).sum::<f64>()
}

#[test]
fn the_torques_of_a_pendulum_are_learned_by_one_regression() {
    let model = fitted(&pendulum(), FeaturesConfig::default());
    let held = forced(500, 3);
    let mut tau = vec![0.0; held.tau.len()];
    let _ = model
        .evaluator()
        .inverse_dynamics(&held.q, &held.qd, &held.qdd, &mut tau);
    let error = normalized(&tau, &held.tau);
    println!("nMSE of torques: {error:.1e}");
    assert!(error < 1e-4, "{error:.1e}");
    assert_eq!(model.family(), "features");
    assert!(model.lagrangian_as::<FeatureLagrangian>().is_some());
}

#[test]
fn the_motion_of_a_pendulum_is_learned_without_forces_and_keeps_its_true_energy() {
    let system = by_name("pendulum", &[]).unwrap();
    for dataset in [pendulum(), random_states(&*system, 2000, 500, 4).unwrap()] {
        let model = fitted(&dataset, FeaturesConfig::default());
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
fn a_saved_model_comes_back_bit_by_bit() {
    let model = fitted(
        &pendulum(),
        FeaturesConfig {
            width: 40,
            ..FeaturesConfig::default()
        },
    );
    let saved = model.save(Provenance::of_seed(0)).unwrap();
    let bytes = saved.to_bytes().unwrap();
    let back = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
    let states = forced(20, 5);
    let torques = |model: &Learned| {
        let mut tau = vec![0.0; 20];
        let _ = model
            .evaluator()
            .inverse_dynamics(&states.q, &states.qd, &states.qdd, &mut tau);
        tau.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(torques(&model), torques(&back));
    assert_eq!(back.family(), "features");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let dataset = pendulum();
    let weights = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let model = pool.install(|| fitted(&dataset, FeaturesConfig::default()));
        let lagrangian = model.lagrangian_as::<FeatureLagrangian>().unwrap();
        lagrangian.network().parameters().to_vec()
    };
    let bits = |threads| {
        weights(threads)
            .iter()
            .map(|w| w.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(1), bits(3));
}

#[test]
fn what_does_not_belong_to_random_features_is_refused() {
    for (name, value) in [
        ("layers", json!(2)),
        ("dissipation", json!(true)),
        ("depth", json!(1)),
    ] {
        let mut request = FitSpec::of("features");
        request.settings.insert(name.into(), value);
        let refused = request.family().unwrap_err();
        assert!(
            matches!(refused, Error::Setting { .. }),
            "{name}: {refused}"
        );
    }
    let with = |change: fn(&mut FitConfig)| {
        let mut config = FitConfig {
            family: Box::new(FeaturesConfig::default()),
            ..FitConfig::default()
        };
        change(&mut config);
        config.validate(&pendulum()).unwrap_err()
    };
    let friction = with(|config| config.forces = ForceTerms::friction());
    assert!(matches!(friction, Error::Argument { name: "forces", .. }));
    let rollout = with(|config| config.loss = Loss::ROLLOUT);
    assert!(matches!(rollout, Error::Argument { name: "loss", .. }));
    let narrow = with(|config| {
        config.family = Box::new(FeaturesConfig {
            width: 0,
            ..FeaturesConfig::default()
        });
    });
    let bounds = "`width` is 0: it must be a whole number from 1 to 2048";
    assert!(narrow.to_string().contains(bounds), "{narrow}");
}
