//! Cyclic coordinates: found in motions, refused where these contradict them, and kept by construction.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{Analytic, AnalyticModel, Parameter, System, by_name};
use lagrangian::rollout::{free, rollout, times};
use lagrangian::{Coordinates, FitConfig, FitSpec, Model, Prepared, RolloutOptions, State, fit};
use lagrangian_recordings::Recording;
use num_dual::DualNum;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two carts that a spring joins: their momentum together is kept.
#[derive(Debug, Clone)]
struct Carts;

impl System for Carts {
    const NAME: &'static str = "carts";
    const ABOUT: &'static str = "two carts that a spring joins";
    const PARAMETERS: &'static [Parameter] = &[];

    fn new(_: &[f64]) -> Self {
        Self
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let stretch = q[0] - q[1];
        qd[0] * qd[0] * 0.5 + qd[1] * qd[1] - stretch * stretch * 2.0 - stretch.powi(4) * 0.5
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let mut draw = || vec![rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
        State::new(draw(), draw())
    }
}

/// A bead in a channel that winds like a screw: what its turn and its advance keep together is the momentum of neither.
#[derive(Debug, Clone)]
struct Screw;

impl System for Screw {
    const NAME: &'static str = "screw";
    const ABOUT: &'static str = "a bead in a channel that winds";
    const PARAMETERS: &'static [Parameter] = &[];

    fn new(_: &[f64]) -> Self {
        Self
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(3)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let kinetic = qd[0] * qd[0] + (q[0] * qd[1]).powi(2) + qd[2] * qd[2];
        let radial = q[0] - 1.5;
        kinetic * 0.5 - radial * radial * 4.0 - (q[1] - q[2] * 2.0).cos()
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let mut draw = |middle: [f64; 3], half: [f64; 3]| -> Vec<f64> {
            let each = middle.into_iter().zip(half);
            each.map(|(m, h)| m + h * rng.random_range(-1.0..1.0))
                .collect()
        };
        let q = draw([1.5, 0.0, 0.0], [0.5, 3.0, 2.0]);
        State::new(q, draw([0.0; 3], [1.0, 1.5, 1.5]))
    }
}

/// Motions of a system from its own states.
fn motions(system: &dyn Model, sample: &dyn Fn(&mut dyn Rng) -> State) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let t = times(4.0, 0.02).unwrap();
    let recording = |i: usize| {
        let State { q, qd } = sample(&mut rng);
        let made = rollout(system, &q, &qd, &t, &free, &RolloutOptions::truth()).unwrap();
        Recording::new(
            format!("motion {i}"),
            system.coordinates().clone(),
            t.clone(),
            made.trajectory.signals,
        )
    };
    (0..10).map(recording).collect()
}

fn of_system(name: &str) -> Vec<Recording> {
    let system = by_name(name, &[]).unwrap();
    motions(&*system, &|rng| system.sample_state(rng))
}

fn spec(family: Option<&str>, cyclic: &[&str]) -> FitSpec {
    let mut spec = FitSpec {
        family: family.map(Into::into),
        steps: Some(30),
        ..FitSpec::default()
    };
    spec.prepare.cyclic = cyclic.iter().map(|name| (*name).into()).collect();
    spec
}

fn found(recordings: Vec<Recording>) -> Vec<usize> {
    let prepared = Prepared::new(recordings, Vec::new(), &spec(None, &["find"])).unwrap();
    prepared.dataset.cyclic
}

#[test]
fn momenta_that_motions_keep_are_found_before_any_fit() {
    assert_eq!(found(of_system("cart-pole")), [0]);
    assert_eq!(found(of_system("furuta-pendulum")), [0]);
    assert!(found(of_system("double-pendulum")).is_empty());
    // The momentum of both is that of neither.
    let carts = Analytic::new(Carts);
    assert!(found(motions(&carts, &|rng| carts.sample_state(rng))).is_empty());
    let screw = Analytic::new(Screw);
    assert!(found(motions(&screw, &|rng| screw.sample_state(rng))).is_empty());
}

#[test]
fn a_declaration_that_the_data_contradict_is_refused_and_so_is_a_family_that_ignores_it() {
    let refused = |family, name: &str| {
        let prepared = Prepared::new(of_system("cart-pole"), Vec::new(), &spec(family, &[name]));
        prepared.map(drop).unwrap_err().to_string()
    };
    assert!(refused(Some("lnn"), "theta").contains("change with theta"));
    assert!(refused(Some("lnn"), "angle").contains("none of the coordinates x, theta"));
    let chain = spec(Some("chain"), &["x"]).choose(&lagrangian::train::DataFacts::default());
    assert!(chain.unwrap_err().to_string().contains("changes nothing"));
}

#[test]
fn a_network_does_not_depend_on_a_cyclic_coordinate() {
    for family in ["lnn", "delan", "hnn", "mlp"] {
        let mut spec = spec(Some(family), &["x"]);
        if family == "hnn" {
            spec.settings.insert("momenta".into(), "velocities".into());
        }
        let prepared = Prepared::new(of_system("cart-pole"), Vec::new(), &spec).unwrap();
        let chosen = FitConfig::for_data(&prepared.dataset, &prepared.estimates, &spec).unwrap();
        let fitted = fit(&prepared.dataset, &chosen.config, None, &mut ()).unwrap();
        let saved = fitted
            .model
            .save(lagrangian::Provenance::default())
            .unwrap();
        let loaded = lagrangian::Learned::load(&saved).unwrap();
        for model in [&fitted.model, &loaded] {
            let accelerations = |x: f64| {
                let mut qdd = [0.0; 2];
                let _ = model.evaluator().forward_dynamics(
                    &[x, 0.7],
                    &[0.3, -0.4],
                    &[0.0; 2],
                    &mut qdd,
                );
                qdd.map(f64::to_bits)
            };
            assert_eq!(accelerations(0.0), accelerations(1e6), "{family}");
        }
    }
}
