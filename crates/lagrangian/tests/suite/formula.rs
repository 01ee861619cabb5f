//! Laws as formulas, found in recordings of positions.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{by_name, normal};
use lagrangian::dataset::random_starts;
use lagrangian::mechanics::Quantities;
use lagrangian::models::WrittenLaw;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::train::FitSpec;
use lagrangian::{
    Fit, FitConfig, Learned, Prepared, Provenance, Recording, RolloutOptions, SavedModel, Signals,
    fit,
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
