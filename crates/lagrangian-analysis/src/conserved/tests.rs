#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::mechanics::{Applied, Dissipation};
use lagrangian::rollout::{record_forces, rollout_many, sines, times, with_friction};

fn physics(system: &dyn AnalyticModel) -> Physics<'_> {
    Physics {
        model: system,
        lagrangian: system.lagrangian(),
        applied: Applied::default(),
    }
}

/// Ten motions, from random states.
fn motions(system: &dyn AnalyticModel, seconds: f64) -> Vec<Trajectory> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let starts: Vec<_> = (0..10).map(|_| system.sample_state(&mut rng)).collect();
    let times = times(seconds, 0.05).unwrap();
    let rolled = rollout_many(system, &starts, &times, &free, &RolloutOptions::truth()).unwrap();
    rolled.into_iter().map(|r| r.trajectory).collect()
}

fn found(name: &str, parameters: &[(&str, f64)], points: &[Vec<usize>], seconds: f64) -> Conserved {
    let system = by_name(name, parameters).unwrap();
    let all = candidates(system.coordinates(), points).unwrap();
    let options = ConservedOptions::default();
    conserved(
        &physics(&*system),
        &all,
        &motions(&*system, seconds),
        &options,
    )
    .unwrap()
}

/// Names of the conserved quantities, with a check of their drift: the motions must confirm each symmetry.
fn names(found: &Conserved) -> Vec<&str> {
    for quantity in &found.quantities {
        let drifts = [Some(&quantity.data), quantity.own.as_ref()];
        let still = drifts
            .into_iter()
            .flatten()
            .all(|drift| drift.relative < 1e-6);
        assert_eq!(still, quantity.symmetric, "{quantity:?}");
    }
    let symmetric = found.quantities.iter().filter(|q| q.symmetric);
    symmetric.map(|q| q.name.as_str()).collect()
}

#[test]
fn a_planet_keeps_energy_and_angular_momentum() {
    let found = found("kepler", &[], &[vec![0, 1]], 3.0);
    assert_eq!(names(&found), ["energy", "angular momentum"]);
    let generators = found.generators.unwrap();
    assert_eq!(generators.len(), 1);
    // In both directions of rotation.
    let turns = [
        "δq1 = -1.00 q2, δq2 = +1.00 q1",
        "δq1 = +1.00 q2, δq2 = -1.00 q1",
    ];
    assert!(
        turns.contains(&generators[0].text.as_str()),
        "{}",
        generators[0].text
    );
}

#[test]
fn three_bodies_keep_their_total_momenta_and_their_angular_momentum() {
    let points = [vec![0, 1], vec![2, 3], vec![4, 5]];
    let found = found("n-body", &[], &points, 1.0);
    let expected = [
        "energy",
        "total momentum along x",
        "total momentum along y",
        "angular momentum",
    ];
    assert_eq!(names(&found), expected);
    // Bodies that nearly keep a triangle do not determine other directions.
    assert!(found.generators.is_none());
}

#[test]
fn two_bodies_in_space_keep_energy_and_two_vectors() {
    let system = by_name("n-body", &[("bodies", 2.0), ("dimensions", 3.0)]).unwrap();
    let points = points_by_name(system.coordinates());
    assert_eq!(points, [[0, 1, 2], [3, 4, 5]]);
    let mut all = motions(&*system, 1.0);
    // The states of the table lie in a plane; these leave it.
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let starts: Vec<_> = (0..10)
        .map(|_| {
            let mut state = system.sample_state(&mut rng);
            let tilt = lagrangian::analytic::uniform(&mut rng, 6, -0.4, 0.4);
            state.q.iter_mut().zip(&tilt).for_each(|(q, t)| *q += t);
            state
                .qd
                .iter_mut()
                .zip(tilt.iter().rev())
                .for_each(|(q, t)| *q += t);
            state
        })
        .collect();
    let times = times(1.0, 0.05).unwrap();
    let tilted = rollout_many(&*system, &starts, &times, &free, &RolloutOptions::truth()).unwrap();
    all.extend(tilted.into_iter().map(|r| r.trajectory));
    let all_candidates = candidates(system.coordinates(), &points).unwrap();
    let options = ConservedOptions::default();
    let found = conserved(&physics(&*system), &all_candidates, &all, &options).unwrap();
    assert_eq!(names(&found).len(), 1 + 3 + 3);
}

#[test]
fn a_double_pendulum_keeps_its_energy_alone() {
    let found = found("double-pendulum", &[], &[], 1.0);
    assert_eq!(names(&found), ["energy"]);
    assert!(found.generators.unwrap().is_empty());
    assert!(
        found.quantities[1].violation > 0.1,
        "gravity is no small force"
    );
}

#[test]
fn cyclic_coordinates_keep_their_momenta() {
    let furuta = found("furuta-pendulum", &[], &[], 1.0);
    assert_eq!(names(&furuta).len(), 2, "{:?}", names(&furuta));
    assert!(names(&furuta)[1].starts_with("momentum of"));
    assert_eq!(furuta.generators.unwrap().len(), 1);
    let cart = found("cart-pole", &[], &[], 1.0);
    assert_eq!(names(&cart), ["energy", "momentum of x"]);
}

#[test]
fn a_charged_particle_keeps_its_canonical_momenta_up_to_a_gauge() {
    // L changes by d/dt(½ e B y) under a shift along x, so that m ẋ − e B y is conserved, and p alone is not; it is
    // invariant under a rotation.
    let system = by_name("charged-particle", &[("charge", 2.0)]).unwrap();
    let found = found("charged-particle", &[("charge", 2.0)], &[vec![0, 1]], 3.0);
    let expected = [
        "energy",
        "momentum of q1",
        "momentum of q2",
        "angular momentum",
    ];
    assert_eq!(names(&found), expected);
    let [_, along_x, _, turn] = &found.quantities[..] else {
        panic!("{found:?}");
    };
    assert!(turn.gauge.terms.is_empty() && !turn.gauge.at_rest);
    let [(name, factor)] = &along_x.gauge.terms[..] else {
        panic!("{:?}", along_x.gauge);
    };
    assert!(
        name == "q2" && (factor - 1.0).abs() < 1e-9,
        "½ e B y: {factor}"
    );
    for (motion, start) in motions(&*system, 3.0).iter().zip(&along_x.data.start) {
        assert!(
            (motion.qd[0] - 2.0 * motion.q[1] - start).abs() < 1e-9,
            "m ẋ − e B y"
        );
    }
    assert_eq!(found.generators.unwrap().len(), 3);
}

#[test]
fn an_electric_field_breaks_the_shift_along_it() {
    let found = found("charged-particle", &[("electric", 1.0)], &[vec![0, 1]], 3.0);
    assert_eq!(names(&found), ["energy", "momentum of q2"]);
}

#[test]
fn the_work_of_forces_and_friction_is_taken_off() {
    let cart = by_name("cart-pole", &[]).unwrap();
    let friction = Dissipation::viscous(vec![0.3, 0.05]);
    let drive = sines(2, 2.0, 3);
    let force = with_friction(&drive, &friction);
    let times = times(3.0, 0.005).unwrap();
    let start = (&[0.0, 1.0], &[0.5, 0.0]);
    let driven = rollout(
        &*cart,
        start.0,
        start.1,
        &times,
        &force,
        &RolloutOptions::truth(),
    );
    let mut motion = driven.unwrap().trajectory;
    record_forces(&mut motion, &drive);
    let damped =
        lagrangian::mechanics::Mechanical::dissipative(cart.lagrangian(), friction.clone())
            .unwrap();
    let physics = Physics {
        model: &damped,
        lagrangian: cart.lagrangian(),
        applied: Applied {
            dissipation: damped.dissipation(),
            actuation: None,
        },
    };
    let all = candidates(cart.coordinates(), &[]).unwrap();
    let found = conserved(&physics, &all, &[motion], &ConservedOptions::default()).unwrap();
    for quantity in &found.quantities[..2] {
        assert!(
            quantity.symmetric && quantity.data.relative < 1e-4,
            "{quantity:?}"
        );
        assert!(
            quantity.own.as_ref().unwrap().relative < 1e-4,
            "{quantity:?}"
        );
    }
    assert!(found.quantities[2].data.relative > 0.1);
}

#[test]
fn another_gauge_changes_nothing() {
    // L + dG/dt with G = sin(x) y has other values of p and δL.
    use lagrangian::analytic::{Analytic, Domain, Kepler, Parameter, Rng, System};
    use lagrangian::{Coordinates, State};
    #[derive(Clone)]
    struct Gauged(Kepler);
    impl System for Gauged {
        const NAME: &'static str = "gauged";
        const ABOUT: &'static str = "a planet in another gauge";
        const PARAMETERS: &'static [Parameter] = &[Parameter {
            name: "none",
            unit: "",
            value: 0.0,
            domain: Domain::Finite,
        }];
        fn new(_: &[f64]) -> Self {
            Self(Kepler::new(&[1.0, 1.0]))
        }
        fn coordinates(&self) -> Coordinates {
            self.0.coordinates()
        }
        fn lagrangian<D: num_dual::DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
            self.0.lagrangian(q, qd) + q[0].cos() * q[1] * qd[0] + q[0].sin() * qd[1]
        }
        fn sample_state(&self, rng: &mut dyn Rng) -> State {
            self.0.sample_state(rng)
        }
    }
    let system = Analytic::<Gauged>::standard();
    let all = candidates(lagrangian::Model::coordinates(&system), &[vec![0, 1]]).unwrap();
    let options = ConservedOptions::default();
    let found = conserved(&physics(&system), &all, &motions(&system, 3.0), &options).unwrap();
    assert_eq!(names(&found), ["energy", "angular momentum"]);
    assert!(found.quantities[3].gauge.at_rest);
    assert_eq!(found.generators.unwrap().len(), 1);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let system = by_name("kepler", &[]).unwrap();
    let coordinates = system.coordinates();
    for points in [
        vec![vec![0]],
        vec![vec![0, 1], vec![1, 0]],
        vec![vec![0, 7]],
    ] {
        assert!(candidates(coordinates, &points).is_err(), "{points:?}");
    }
    let pendulum = by_name("double-pendulum", &[]).unwrap();
    let error = candidates(pendulum.coordinates(), &[vec![0, 1]]).unwrap_err();
    assert!(error.to_string().contains("no angles"), "{error}");
    let options = ConservedOptions::default();
    assert!(conserved(&physics(&*system), &[], &[], &options).is_err());
    let wrong = motions(&*by_name("pendulum", &[]).unwrap(), 1.0);
    assert!(conserved(&physics(&*system), &[], &wrong, &options).is_err());
    let options = ConservedOptions {
        tolerance: 0.0,
        ..options
    };
    assert!(conserved(&physics(&*system), &[], &motions(&*system, 1.0), &options).is_err());
}
