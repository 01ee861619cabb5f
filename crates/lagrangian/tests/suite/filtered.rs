//! Filtering motion and forces alike keeps the equation of motion where noise would bend it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::models::{RigidConfig, identify};
use lagrangian::{Coordinates, Dataset, Error, EstimateOptions, Recording, Signals};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A pendulum that is driven along q = sin 3t + 0.5 sin 5t, at 500 Hz, with white noise on q and τ.
fn recording(noise: [f64; 2]) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut scatter = |size: f64| size * rng.random_range(-1.7..1.7);
    let t: Vec<f64> = (0..5000).map(|k| 0.002 * f64::from(k)).collect();
    let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { t.iter().map(|&t| f(t)).collect() };
    let q = of(&|t| (3.0 * t).sin() + 0.5 * (5.0 * t).sin());
    let qd = of(&|t| 3.0 * (3.0 * t).cos() + 2.5 * (5.0 * t).cos());
    let qdd = of(&|t| -9.0 * (3.0 * t).sin() - 12.5 * (5.0 * t).sin());
    let mut tau = vec![0.0; t.len()];
    let pendulum = by_name("pendulum", &[]).unwrap();
    let _ = pendulum
        .evaluator()
        .inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let q = q.iter().map(|q| q + scatter(noise[0])).collect();
    let tau = tau.iter().map(|tau| tau + scatter(noise[1])).collect();
    Recording::new(
        "driven",
        Coordinates::angles(1),
        t,
        Signals {
            tau,
            q,
            ..Signals::default()
        },
    )
}

fn options(cutoff: f64) -> EstimateOptions {
    EstimateOptions {
        low_pass: Some(cutoff),
        ..EstimateOptions::default()
    }
}

#[test]
fn the_inertia_of_a_noisy_pendulum_is_found_from_filtered_signals() {
    let (filtered, estimates) = recording([2e-3, 0.5])
        .into_trajectory(&options(5.0))
        .unwrap();
    assert_eq!(
        estimates.iter().map(|e| e.signal).collect::<Vec<_>>(),
        ["q", "qd", "qdd", "tau"]
    );
    // Half a period of the cut-off is lost at each end.
    assert_eq!(filtered.len(), 5000 - 100);
    let dataset = Dataset::new(Coordinates::angles(1), &[filtered], &[]).unwrap();
    let found = identify(&dataset, &RigidConfig::default(), false).unwrap();
    let parameters = found.model.parameters();
    // a₁₁ = ½ m l² and c₁ = m g l of the pendulum of 1 kg and 1 m.
    let (inertia, gravity) = (parameters[0].value, parameters[1].value);
    assert!((inertia - 0.5).abs() < 0.01, "{inertia}");
    assert!((gravity - 9.8).abs() < 0.15, "{gravity}");
}

#[test]
fn dry_friction_stays_as_sharp_as_it_is_through_a_low_pass() {
    let mut driven = recording([2e-4, 0.05]);
    let velocity = |t: f64| 3.0 * (3.0 * t).cos() + 2.5 * (5.0 * t).cos();
    let forces = driven.signals.tau.iter_mut().zip(&driven.t);
    forces.for_each(|(tau, t)| *tau += 2.0 * velocity(*t).signum() + 0.3 * velocity(*t));
    let (mut filtered, _) = driven.into_trajectory(&options(5.0)).unwrap();
    let mut friction = || {
        let data = Dataset::new(Coordinates::angles(1), &[filtered.clone()], &[]).unwrap();
        let found = identify(&data, &RigidConfig::default(), true).unwrap();
        filtered.spreading = 0.0;
        let friction = found.model.motion().dissipation().unwrap();
        (friction.coulomb[0], friction.smoothing[0])
    };
    let (sharp, smeared) = (friction(), friction());
    assert!((sharp.0 / 2.0 - 1.0).abs() < 0.07, "{sharp:?}");
    assert!(sharp.1 < 0.6 * smeared.1, "{sharp:?} {smeared:?}");
}

#[test]
fn a_low_pass_keeps_a_motion_that_is_slower_than_its_cut_off() {
    let exact = recording([0.0, 0.0]);
    let (filtered, _) = exact.clone().into_trajectory(&options(20.0)).unwrap();
    assert!((filtered.t[0] - exact.t[13]).abs() < 1e-12);
    let (tau, n) = (exact.signals.tau, filtered.len());
    let filtered = filtered.signals.tau;
    assert!((0..n).all(|k| (filtered[k] - tau[13 + k]).abs() < 2e-2));
}

#[test]
fn a_cut_off_too_low_for_the_recording_too_high_for_its_rate_or_no_frequency_is_refused() {
    let refused = |filter| {
        recording([0.0, 0.0])
            .into_trajectory(&options(filter))
            .unwrap_err()
    };
    assert!(matches!(refused(0.09), Error::TooShort { .. }));
    for cutoff in [0.0, -1.0, f64::NAN, 200.0] {
        assert!(matches!(refused(cutoff), Error::Argument { .. }));
    }
}
