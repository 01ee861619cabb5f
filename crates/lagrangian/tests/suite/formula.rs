//! Laws as formulas, found in recordings of positions.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{by_name, normal};
use lagrangian::dataset::random_starts;
use lagrangian::mechanics::Quantities;
use lagrangian::models::WrittenLaw;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::train::FitSpec;
use lagrangian::{
    Coordinates, Fit, FitConfig, Learned, Prepared, Provenance, Recording, RolloutOptions,
    SavedModel, Signals, fit,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Recordings of positions of a system, with noise of this deviation.
fn recordings(system: &str, count: usize, deviation: f64) -> Vec<Recording> {
    let system = by_name(system, &[]).unwrap();
    let starts = random_starts(&*system, count, 5);
    let times = times(3.0, 0.02).unwrap();
    let motions = rollout_many(&*system, &starts, &times, &free, &RolloutOptions::truth()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let recording = |motion: lagrangian::Rollout| {
        let exact = motion.trajectory.signals.q.iter();
        Recording {
            name: "swing".into(),
            coordinates: system.coordinates().clone(),
            signals: Signals {
                q: exact.map(|x| x + deviation * normal(&mut rng)).collect(),
                ..Signals::default()
            },
            columns: Default::default(),
            unwrapped: vec![0; system.coordinates().dof()],
            sampled: None,
            t: motion.trajectory.t,
        }
    };
    motions.into_iter().map(recording).collect()
}

/// The fit of a formula to recordings, and what it writes.
fn found(recordings: Vec<Recording>) -> (Fit, WrittenLaw) {
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(recordings, Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fit = fit(&prepared.dataset, &candidates[0].config, None, &mut ()).unwrap();
    let written = fit.model.written().unwrap();
    (fit, written)
}

#[test]
fn the_law_of_a_pendulum_is_found_with_its_standard_error() {
    for deviation in [0.0, 2e-3] {
        let (fit, written) = found(recordings("pendulum", 6, deviation));
        assert!(written.is_law(), "{}", written.text);
        let parameters = fit.model.parameters();
        let names: Vec<&str> = parameters.iter().map(|own| &*own.name).collect();
        assert_eq!(names, ["q1'^2", "cos(q1)"], "{}", written.text);
        assert!((parameters[0].value - 0.5).abs() < 1e-12);
        let error = parameters[1].standard_error.unwrap();
        let off = (parameters[1].value - 9.8).abs();
        assert!(off < 5.0 * error && error < 0.02, "{off} {error}");
        assert!(written.latex.contains(r"\cos(q_{1})"), "{}", written.latex);
    }
}

#[test]
fn a_formula_is_saved_to_the_bit_and_has_the_derivatives_of_its_text() {
    let (fit, _) = found(recordings("double-pendulum", 8, 0.0));
    let saved = fit.model.save(Provenance::default()).unwrap();
    let bytes = saved.to_bytes().unwrap();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
    assert_eq!(loaded.written(), fit.model.written());
    let truth = by_name("double-pendulum", &[]).unwrap();
    let state = ([0.4, -1.1], [1.2, 0.3], [0.0, 0.0]);
    let own = fit
        .model
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    let again = loaded
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    let exact = truth
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    assert_eq!(own, again);
    for (own, exact) in own.iter().zip(&exact) {
        assert!((own - exact).abs() < 1e-4 * exact.abs(), "{own} {exact}");
    }
}

#[test]
fn what_no_sum_of_these_terms_explains_is_no_law() {
    // A relativistic particle: its mass grows with its speed.
    let recordings = recordings("relativistic-particle", 6, 0.0);
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(recordings, Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fitted = fit(&prepared.dataset, &candidates[0].config, None, &mut ());
    let written = fitted.ok().and_then(|fit| fit.model.written());
    assert!(written.is_none_or(|own| !own.is_law()));
}

/// Two springs that do not feel each other, 2 and 2.6 rad/s, with noise in parts of the amplitude of each motion.
fn two_springs(noise: f64) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let motion = |k: usize| {
        let size = |i: usize| 0.3 + 0.7 * ((3 * k + 5 * i) % 8) as f64 / 7.0;
        let place = |i: usize, t: f64| {
            let (rate, phase) = ([2.0, 2.6][i], (1 + i) as f64 * k as f64);
            size(i) * (rate * t + phase).sin()
        };
        let t: Vec<f64> = (0..200).map(|s| 0.02 * s as f64).collect();
        let both = t.iter().flat_map(|t| [0, 1].map(|i| (i, place(i, *t))));
        let q = both.map(|(i, q)| q + noise * size(i) * normal(&mut rng));
        Recording {
            name: format!("motion {k}"),
            coordinates: Coordinates::lines(2),
            signals: Signals {
                q: q.collect(),
                ..Signals::default()
            },
            columns: Default::default(),
            unwrapped: vec![0; 2],
            sampled: None,
            t,
        }
    };
    (0..8).map(motion).collect()
}

#[test]
fn coordinates_that_move_by_themselves_have_a_law_each() {
    for noise in [0.0, 1e-3] {
        let (fit, written) = found(two_springs(noise));
        assert!(
            written.is_law(),
            "{noise}: {} {}",
            written.text,
            written.meaning
        );
        let mut terms: Vec<(String, f64)> = fit
            .model
            .parameters()
            .into_iter()
            .map(|own| (own.name, own.value))
            .collect();
        terms.sort_by(|a, b| a.0.cmp(&b.0));
        let expected = [
            ("q1'^2", 0.5),
            ("q1^2", -2.0),
            ("q2'^2", 0.5),
            ("q2^2", -3.38),
        ];
        assert_eq!(terms.len(), expected.len(), "{noise}: {}", written.text);
        for ((name, value), (own, exact)) in terms.iter().zip(expected) {
            assert!(
                name == own && (value - exact).abs() < 3e-3,
                "{noise}: {}",
                written.text
            );
        }
    }
}
