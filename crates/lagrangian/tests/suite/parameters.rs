//! Coordinates that never move: a model with a parameter is a family of models without one.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::Arc;

use lagrangian::analytic::{Analytic, AnalyticModel, Parameter, System, by_name};
use lagrangian::mechanics::{Jet, Lagrangian, Mechanical, Scaling};
use lagrangian::models::{Delan, Form, Lnn, Mlp, MlpConfig, MlpScaling};
use lagrangian::rollout::{free, times};
use lagrangian::trajectory::{Samples, Topology};
use lagrangian::{
    Coordinates, Dataset, DelanConfig, Error, LnnConfig, Model, RolloutOptions, Signals, State,
    rollout,
};
use num_dual::DualNum;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A pendulum that has its length as second coordinate.
#[derive(Debug, Clone)]
struct AnyPendulum;

impl System for AnyPendulum {
    const NAME: &'static str = "any-pendulum";
    const ABOUT: &'static str = "a pendulum of any length";
    const PARAMETERS: &'static [Parameter] = &[];

    fn new(_: &[f64]) -> Self {
        Self
    }

    fn coordinates(&self) -> Coordinates {
        let mut coordinates = Coordinates::angles(2);
        coordinates.0[1].topology = Topology::Parameter;
        coordinates
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        // The length has a velocity here as well, so that only its declaration holds it.
        let (l, v) = (q[1], q[1] * qd[0] + qd[1]);
        v * v * 0.5 + l * q[0].cos() * 9.8
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(
            vec![rng.random_range(-3.0..3.0), rng.random_range(0.3..2.0)],
            vec![rng.random_range(-3.0..3.0), 0.0],
        )
    }
}

#[test]
fn a_system_with_a_parameter_moves_as_the_system_that_has_its_value() {
    let any = Analytic::new(AnyPendulum);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..20 {
        let State { q, qd } = any.sample_state(&mut rng);
        let one = by_name("pendulum", &[("length", q[1])]).unwrap();
        let (mut all, mut alone) = ([0.0; 2], [0.0]);
        let _ = any
            .evaluator()
            .forward_dynamics(&q, &qd, &[0.7, 5.0], &mut all);
        let _ = one
            .evaluator()
            .forward_dynamics(&q[..1], &qd[..1], &[0.7], &mut alone);
        assert!(
            (all[0] - alone[0]).abs() < 1e-12 && all[1] == 0.0,
            "{all:?} {alone:?}"
        );
        let (mut tau, mut own) = ([1.0; 2], [0.0]);
        let _ = any
            .evaluator()
            .inverse_dynamics(&q, &qd, &[2.0, 0.0], &mut tau);
        let _ = one
            .evaluator()
            .inverse_dynamics(&q[..1], &qd[..1], &[2.0], &mut own);
        assert!((tau[0] - own[0]).abs() < 1e-12 && tau[1] == 0.0);
    }
}

#[test]
fn a_rollout_keeps_a_parameter_to_the_bit_and_refuses_one_that_moves() {
    let any = Analytic::new(AnyPendulum);
    let (times, options) = (times(5.0, 0.1).unwrap(), RolloutOptions::default());
    let motion = rollout(&any, &[1.0, 0.7], &[0.0, 0.0], &times, &free, &options).unwrap();
    assert!(motion.outcome.is_finished());
    assert!(
        motion
            .trajectory
            .q
            .chunks(2)
            .all(|q| (q[1] - 0.7).abs() < f64::EPSILON)
    );
    let error = rollout(&any, &[1.0, 0.7], &[0.0, 0.1], &times, &free, &options).unwrap_err();
    assert!(matches!(error, Error::Moves { sample: 1, .. }), "{error}");
    assert!(error.to_string().contains("`parameter"), "{error}");
}

/// A line, a circle and a parameter.
fn coordinates() -> Coordinates {
    let mut coordinates = Coordinates::lines(3);
    coordinates.0[1].topology = Topology::Circle;
    coordinates.0[2].topology = Topology::Parameter;
    coordinates
}

fn networks() -> Vec<Arc<dyn Lagrangian>> {
    let scaling = Scaling::identity(3);
    let lnn = |form| {
        let config = LnnConfig {
            form,
            width: 32,
            kinetic: 2.0,
            ..LnnConfig::default()
        };
        Lnn::random(coordinates(), config, scaling.clone(), 4).unwrap()
    };
    let config = DelanConfig {
        vector_potential: true,
        ..DelanConfig::default()
    };
    let delan = Delan::random(coordinates(), config, scaling.clone(), 4).unwrap();
    vec![
        Arc::new(lnn(Form::Free)),
        Arc::new(lnn(Form::Convex)),
        Arc::new(delan),
    ]
}

#[test]
fn energy_changes_by_the_power_of_the_forces_whatever_the_value_of_a_parameter() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for (k, network) in networks().into_iter().enumerate() {
        let model = Mechanical::conservative(network);
        let mut evaluator = model.evaluator();
        for _ in 0..20 {
            let mut state = || {
                (0..3)
                    .map(|_| rng.random_range(-2.0..2.0))
                    .collect::<Vec<f64>>()
            };
            let (q, mut qd, tau) = (state(), state(), state());
            qd[2] = 0.0;
            let mut qdd = [0.0; 3];
            let _ = evaluator.forward_dynamics(&q, &qd, &tau, &mut qdd);
            assert!(
                qdd[2].abs() < f64::MIN_POSITIVE,
                "nothing moves a parameter"
            );
            let power: f64 = tau.iter().zip(&qd).map(|(f, v)| f * v).sum();
            let mut energy = |t: f64| {
                let at = |i: usize| q[i] + qd[i] * t + 0.5 * qdd[i] * t * t;
                let (q, qd): (Vec<f64>, Vec<f64>) =
                    (0..3).map(|i| (at(i), qd[i] + qdd[i] * t)).unzip();
                let mut energy = [0.0];
                assert!(evaluator.energy(&q, &qd, &mut energy).is_finite());
                energy[0]
            };
            let h = 1e-4;
            let rate =
                (8.0 * (energy(h) - energy(-h)) - energy(2.0 * h) + energy(-2.0 * h)) / (12.0 * h);
            let size = qdd.iter().fold(1.0_f64, |m, a| m.max(a.abs()));
            assert!(
                (rate - power).abs() < 1e-7 * size,
                "network {k}: {rate} is not {power}"
            );
        }
    }
}

#[test]
fn a_network_sees_the_value_of_a_parameter() {
    for network in networks() {
        let at = |value: f64| {
            let mut jet = Jet::default();
            network
                .jets()
                .jet(&[0.3, 0.2, value], &[1.0, -1.0, 0.0], &mut jet);
            jet.lagrangian[0]
        };
        assert!((at(0.5) - at(-0.5)).abs() > 1e-6);
    }
}

#[test]
fn a_plain_network_holds_a_parameter() {
    let config = MlpConfig::default();
    let mlp = Mlp::random(coordinates(), config, MlpScaling::identity(3), 2).unwrap();
    let mut qdd = [1.0; 6];
    let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let _ = mlp
        .evaluator()
        .forward_dynamics(&q, &[0.0; 6], &[0.0; 6], &mut qdd);
    assert!(qdd[2] == 0.0 && qdd[5] == 0.0 && qdd[0] != 0.0);
}

fn samples(qd: f64, qdd: f64) -> Samples {
    Samples::new(
        2,
        Signals {
            q: vec![0.1, 5.0, 0.4, 5.0],
            qd: vec![1.0, 0.0, 2.0, qd],
            qdd: vec![3.0, 0.0, 1.0, qdd],
            tau: vec![0.0; 4],
            ..Signals::default()
        },
    )
}

#[test]
fn scales_of_a_constant_parameter_divide() {
    let coordinates = AnyPendulum.coordinates();
    let data = Dataset::from_samples(coordinates, samples(0.0, 0.0), samples(0.0, 0.0)).unwrap();
    let scaling = data.scaling();
    scaling.validate(2).unwrap();
    assert!((scaling.q_scale[1] - 1.0).abs() < 1e-15 && (scaling.qd_scale[1] - 1.0).abs() < 1e-15);
    // The energy is that of the moving coordinate.
    assert!((scaling.energy - 2.5).abs() < 1e-12, "{}", scaling.energy);
}

#[test]
fn data_in_which_a_parameter_moves_are_refused() {
    for (bad, what) in [
        (samples(0.1, 0.0), "velocity"),
        (samples(0.0, 0.1), "acceleration"),
    ] {
        let found = Dataset::from_samples(AnyPendulum.coordinates(), bad, samples(0.0, 0.0));
        let message = found.unwrap_err().to_string();
        assert!(
            message.contains(what) && message.contains("sample 2"),
            "{message}"
        );
    }
}
