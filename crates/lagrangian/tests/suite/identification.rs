//! Chains of rigid links are found again from their motions and torques.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::mechanics::{Dissipation, Mechanical};
use lagrangian::models::{Angles, Identified, RigidChain, RigidConfig, identify};
use lagrangian::trajectory::Samples;
use lagrangian::{Coordinates, Dataset, Error, Model, Signals};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SMOOTHING: f64 = 0.3;

fn friction(n: usize) -> Dissipation {
    Dissipation {
        viscous: (0..n).map(|i| 0.1 + 0.05 * i as f64).collect(),
        coulomb: (0..n).map(|i| 0.3 - 0.04 * i as f64).collect(),
        smoothing: vec![SMOOTHING; n],
        ..Dissipation::default()
    }
}

/// Random states and accelerations of a model, with the torques that they need and `noise` of that deviation on these.
fn samples(model: &dyn Model, count: usize, noise: f64, seed: u64) -> Samples {
    let n = model.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut column = |most: f64| -> Vec<f64> {
        (0..count * n)
            .map(|_| rng.random_range(-most..most))
            .collect()
    };
    let (q, qd, qdd) = (column(3.0), column(5.0), column(20.0));
    // Uniform noise of deviation 1.
    let scatter = column(3.0_f64.sqrt());
    let mut tau = vec![0.0; count * n];
    assert!(
        model
            .evaluator()
            .inverse_dynamics(&q, &qd, &qdd, &mut tau)
            .is_finite()
    );
    tau.iter_mut()
        .zip(scatter)
        .for_each(|(tau, s)| *tau += noise * s);
    Samples::new(
        n,
        Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        },
    )
}

fn identified(truth: &dyn Model, noise: f64, config: &RigidConfig) -> Identified {
    let (train, held) = (samples(truth, 600, noise, 1), samples(truth, 200, noise, 2));
    let dataset = Dataset::from_samples(truth.coordinates().clone(), train, held).unwrap();
    identify(&dataset, config, true).unwrap()
}

fn value(found: &Identified, name: &str) -> f64 {
    let parameters = found.model.parameters();
    parameters.iter().find(|p| p.name == name).unwrap().value
}

/// The largest difference of accelerations between two models, over the size of the accelerations.
fn difference(a: &dyn Model, b: &dyn Model) -> f64 {
    let states = samples(b, 50, 0.0, 3);
    let accelerations = |model: &dyn Model| {
        let mut qdd = vec![0.0; states.q.len()];
        assert_eq!(
            model
                .evaluator()
                .forward_dynamics(&states.q, &states.qd, &states.tau, &mut qdd)
                .singular(),
            0
        );
        qdd
    };
    let (a, b) = (accelerations(a), accelerations(b));
    let largest = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    a.iter()
        .zip(b)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
        / largest
}

#[test]
fn a_pendulum_with_friction_is_found_again() {
    let system = by_name("pendulum", &[("length", 2.0), ("mass", 0.5)]).unwrap();
    let truth = Mechanical::dissipative(system.lagrangian(), friction(1)).unwrap();
    let config = RigidConfig {
        smoothing: Some(SMOOTHING),
        ..RigidConfig::default()
    };
    let found = identified(&truth, 0.0, &config);
    // a₁₁ = ½ m l², c₁ = m g l.
    for (name, expected) in [
        ("inertia_1_1", 1.0),
        ("gravity_cos_1", 9.8),
        ("gravity_sin_1", 0.0),
        ("offset_1", 0.0),
        ("viscous_1", 0.1),
        ("coulomb_1", 0.3),
    ] {
        let found = value(&found, name);
        assert!((found - expected).abs() < 1e-8, "{name}: {found}");
    }
}

#[test]
fn a_double_pendulum_is_found_again_and_its_convention_of_angles_too() {
    let system = by_name("double-pendulum", &[("mass2", 0.6), ("length1", 1.5)]).unwrap();
    let truth = Mechanical::dissipative(system.lagrangian(), friction(2)).unwrap();
    let config = RigidConfig {
        smoothing: Some(SMOOTHING),
        ..RigidConfig::default()
    };
    let found = identified(&truth, 0.0, &config);
    assert_eq!(found.model.motion().lagrangian.angles(), Angles::Absolute);
    // m₂ l₁ l₂ and ½ m₂ l₂².
    assert!((value(&found, "inertia_1_2") - 0.9).abs() < 1e-8);
    assert!((value(&found, "inertia_2_2") - 0.3).abs() < 1e-8);
    assert!(found.validation.unwrap() < 1e-12);
    assert!(difference(&found.model, &truth) < 1e-7);
}

#[test]
fn chains_of_one_to_seven_links_with_joint_angles_move_as_the_truth() {
    for n in 1..=7 {
        let coordinates = Coordinates::angles(n);
        let names = RigidChain::names(&coordinates, Angles::Relative).unwrap();
        // Masses of ½ kg on links of ½ m, the gravity not quite along the zero of the angles, and rotors.
        let pi = |name: &String| {
            let index = |k| {
                name.split('_')
                    .nth(k)
                    .and_then(|i| i.parse().ok())
                    .unwrap_or(0)
            };
            let beyond = |i: usize| (n + 1 - i) as f64;
            match name.split('_').next().unwrap() {
                "inertia" if index(1) == index(2) => 0.0625 * beyond(index(1)),
                "inertia" => 0.125 * beyond(index(2)),
                "rotor" => 0.02,
                "offset" => 0.01,
                _ if name.contains("sin") => 0.1 * beyond(index(2)),
                _ => 2.45 * beyond(index(2)),
            }
        };
        let chain = RigidChain::new(
            coordinates,
            Angles::Relative,
            names.iter().map(pi).collect(),
        )
        .unwrap();
        let truth = Mechanical::dissipative(chain, friction(n)).unwrap();
        let config = RigidConfig {
            smoothing: Some(SMOOTHING),
            ..RigidConfig::default()
        };
        let found = identified(&truth, 0.0, &config);
        assert_eq!(
            n > 1,
            found.model.motion().lagrangian.angles() == Angles::Relative
        );
        let difference = difference(&found.model, &truth);
        assert!(difference < 1e-5, "{n} links: {difference:e}");
    }
}

#[test]
fn the_errors_of_noisy_torques_are_of_the_size_that_is_reported() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let truth = Mechanical::dissipative(system.lagrangian(), friction(2)).unwrap();
    let config = RigidConfig {
        smoothing: Some(SMOOTHING),
        angles: Some(Angles::Absolute),
        ..RigidConfig::default()
    };
    let exact = identified(&truth, 0.0, &config).model.parameters();
    let noisy = identified(&truth, 0.5, &config).model.parameters();
    let scores: Vec<f64> = exact
        .iter()
        .zip(&noisy)
        // Terms that were omitted have no error.
        .filter(|(_, n)| n.standard_error > Some(0.0))
        .map(|(e, n)| (n.value - e.value) / n.standard_error.unwrap())
        .collect();
    let rms = (scores.iter().map(|s| s * s).sum::<f64>() / scores.len() as f64).sqrt();
    assert!((0.3..2.0).contains(&rms), "{scores:?}");
}

#[test]
fn the_speed_at_which_friction_turns_is_chosen_from_the_data() {
    let system = by_name("pendulum", &[]).unwrap();
    let truth = Mechanical::dissipative(system.lagrangian(), friction(1)).unwrap();
    let found = identified(&truth, 0.0, &RigidConfig::default());
    let chosen = found.model.motion().dissipation().unwrap().smoothing[0];
    assert!((0.1..0.9).contains(&chosen), "{chosen}");
}

#[test]
fn friction_that_would_put_energy_in_is_left_out() {
    let system = by_name("pendulum", &[]).unwrap();
    let mut train = samples(&*system, 500, 0.0, 1);
    let Signals { qd, tau, .. } = &mut train.signals;
    let pairs = tau.iter_mut().zip(qd);
    pairs.for_each(|(tau, v)| *tau -= 0.2 * *v);
    let dataset = Dataset::from_samples(
        Coordinates::angles(1),
        train,
        Samples {
            n: 1,
            ..Samples::default()
        },
    )
    .unwrap();
    let found = identify(&dataset, &RigidConfig::default(), true).unwrap();
    let friction = found.model.motion().dissipation().unwrap();
    assert!(friction.viscous[0] <= 0.0 && friction.coulomb[0] <= 0.0);
}

#[test]
fn data_that_cannot_tell_a_chain_are_refused() {
    let refused = |coordinates: Coordinates, train: Samples| {
        let held = Samples {
            n: train.n,
            ..Samples::default()
        };
        let dataset = Dataset::from_samples(coordinates, train, held).unwrap();
        let error = identify(&dataset, &RigidConfig::default(), false).unwrap_err();
        assert!(matches!(error, Error::Argument { .. }), "{error}");
        error.to_string()
    };
    let pendulum = by_name("pendulum", &[]).unwrap();
    let driven = samples(&*pendulum, 50, 0.0, 1);
    assert!(refused(Coordinates::lines(1), driven.clone()).contains("`angles`"));
    let mut free = driven;
    free.tau.fill(0.0);
    assert!(refused(Coordinates::angles(1), free).contains("`tau`"));
    let eight = Samples::new(
        8,
        Signals {
            q: vec![0.1; 8],
            qd: vec![0.1; 8],
            qdd: vec![0.1; 8],
            tau: vec![0.1; 8],
            ..Signals::default()
        },
    );
    assert!(refused(Coordinates::angles(8), eight).contains("1 to 7"));
}
