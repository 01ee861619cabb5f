//! Expressions compared with their models, and their derivatives with differences.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::SeedableRng;

use crate::models::{Delan, Direction, Lnn, Mlp, MlpConfig, MlpScaling, Trunks, lnn::Form};
use crate::{DelanConfig, Learned, LnnConfig};
use lagrangian_mechanics::analytic::uniform;
use lagrangian_mechanics::expression::{Equations, Function, Graph, Mechanics, Value, input};
use lagrangian_mechanics::rigid::{self, RigidBodies};
use lagrangian_mechanics::{Actuation, Dissipation, Scaling};
use lagrangian_mechanics::{Mechanical, Model};
use lagrangian_motion::{Coordinates, Signals};
use nets::Activation;

type Rng = rand_chacha::ChaCha8Rng;

pub(super) fn coordinates() -> Coordinates {
    let mut coordinates = Coordinates::angles(3);
    coordinates.0[1] = Coordinates::lines(1).0.remove(0);
    coordinates
}

pub(super) fn scaling(n: usize) -> Scaling {
    let list = |first: f64| (0..n).map(|i| first + 0.3 * i as f64).collect::<Vec<_>>();
    Scaling {
        q_center: list(0.1),
        q_scale: list(0.7),
        qd_scale: list(1.3),
        energy: 2.5,
        cyclic: (2..n).collect(),
    }
}

/// Friction of all kinds, and gains and offsets.
fn forces(n: usize) -> (Dissipation, Actuation) {
    let list = |first: f64| (0..n).map(|i| first + 0.1 * i as f64).collect::<Vec<_>>();
    let friction = Dissipation {
        drag: Some(list(0.15)),
        coulomb: list(0.3),
        smoothing: list(0.05),
        load: Some(list(0.1)),
        between: Some(
            (0..n * n)
                .map(|k| if k / n == k % n { 0.0 } else { -0.02 })
                .collect(),
        ),
        ..Dissipation::viscous(list(0.2))
    };
    let mut matrix: Vec<f64> = (0..n * n).map(|k| 0.05 * (k as f64).sin()).collect();
    (0..n).for_each(|i| matrix[i * n + i] = 2.0);
    (friction, Actuation::new(matrix, list(-0.2)).unwrap())
}

fn learned(lagrangian: impl crate::models::LearnedLagrangian + Clone) -> Learned {
    let (friction, actuation) = forces(lagrangian.coordinates().dof());
    Mechanical::with_forces(lagrangian, Some(friction), Some(actuation))
        .unwrap()
        .into()
}

pub(super) fn models() -> Vec<(String, Learned)> {
    let mut models = Vec::new();
    for activation in [
        Activation::Softplus,
        Activation::Tanh,
        Activation::Gelu,
        Activation::XTanh,
        Activation::Square,
    ] {
        for (form, speed_limit) in [
            (Form::Free, None),
            (Form::Convex, None),
            (Form::Free, Some(20.0)),
        ] {
            let config = LnnConfig {
                form,
                speed_limit,
                activation,
                width: 16,
                exponential: activation == Activation::Tanh,
                ..LnnConfig::default()
            };
            let lnn = Lnn::random(coordinates(), config, scaling(3), 3).unwrap();
            models.push((
                format!("lnn {activation:?} {form:?} {speed_limit:?}"),
                learned(lnn),
            ));
        }
        for (trunks, vector_potential) in [(Trunks::Shared, false), (Trunks::Separate, true)] {
            let config = DelanConfig {
                activation,
                trunks,
                vector_potential,
                width: 12,
                ..DelanConfig::default()
            };
            let delan = Delan::random(coordinates(), config, scaling(3), 4).unwrap();
            let delan = delan.with_rotors(vec![0.1, 0.0, 0.3]).unwrap();
            models.push((format!("delan {activation:?} {trunks:?}"), learned(delan)));
        }
    }
    models
}

/// Values of the expressions at one state.
struct Asked<'a> {
    graph: &'a Graph,
    inputs: Vec<(&'static str, Vec<f64>)>,
}

impl Asked<'_> {
    fn of(&self, id: usize) -> Vec<f64> {
        let inputs: Vec<(&str, &[f64])> = self
            .inputs
            .iter()
            .map(|(name, x)| (*name, &x[..]))
            .collect();
        self.graph
            .evaluate(&inputs, &[self.graph.value(id)])
            .unwrap()
            .remove(0)
    }

    fn set(&mut self, name: &str, numbers: &[f64]) {
        let own = self
            .inputs
            .iter_mut()
            .find(|(other, _)| *other == name)
            .unwrap();
        own.1.copy_from_slice(numbers);
    }

    fn unit(&mut self, k: usize, n: usize) {
        let unit: Vec<f64> = (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
        self.set(input::DIRECTION, &unit);
    }
}

fn asked<'a>(graph: &'a Graph, n: usize, rng: &mut Rng) -> Asked<'a> {
    let names = [
        input::Q,
        input::QD,
        input::QDD,
        input::TAU,
        input::DIRECTION,
    ];
    let inputs = names.map(|name| (name, uniform(rng, n, -1.5, 1.5)));
    Asked {
        graph,
        inputs: inputs.to_vec(),
    }
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    let size = expected.iter().fold(1e-3_f64, |most, x| most.max(x.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() <= tolerance * size,
            "{what}: {found:?} is not {expected:?}"
        );
    }
}

/// Checks that all expressions agree with the model at random states.
pub(super) fn check_mechanics(name: &str, model: &dyn Model, equations: &Mechanics) {
    let n = model.coordinates().dof();
    let mut rng = Rng::seed_from_u64(7);
    let mut evaluator = model.evaluator();
    for _ in 0..3 {
        let mut ask = asked(&equations.graph, n, &mut rng);
        let [q, qd, qdd, tau, direction] = [0, 1, 2, 3, 4].map(|k| ask.inputs[k].1.clone());
        let check = |id, write: &mut dyn FnMut(&mut [f64]), length, what: &str| {
            let mut expected = vec![0.0; length];
            write(&mut expected);
            assert_close(&ask.of(id), &expected, 1e-12, &format!("{name}, {what}"));
        };
        let own = &mut *evaluator;
        check(
            equations.needed,
            &mut |x| assert!(own.inverse_dynamics(&q, &qd, &qdd, x).is_finite()),
            n,
            "inverse dynamics",
        );
        check(
            equations.bias,
            &mut |x| assert!(own.bias(&q, &qd, x).is_finite()),
            n,
            "bias",
        );
        check(
            equations.momentum,
            &mut |x| assert!(own.momentum(&q, &qd, x).is_finite()),
            n,
            "momentum",
        );
        check(
            equations.energy,
            &mut |x| assert!(own.energy(&q, &qd, x).is_finite()),
            1,
            "energy",
        );
        check(
            equations.lagrangian,
            &mut |x| assert!(own.lagrangian(&q, &qd, x).is_finite()),
            1,
            "lagrangian",
        );
        check(
            equations.exerted,
            &mut |x| own.applied().exerted(&qd, &tau, x),
            n,
            "force",
        );
        let mut mass = vec![0.0; n * n];
        assert!(own.mass_matrix(&q, &qd, &mut mass).is_finite());
        let column: Vec<f64> = mass
            .chunks(n)
            .map(|row| lagrangian_motion::solve::dot(row, &direction))
            .collect();
        assert_close(
            &ask.of(equations.mass),
            &column,
            1e-12,
            &format!("{name}, mass matrix"),
        );
        let pairs = [
            (equations.needed, equations.needed_along[0], input::Q),
            (equations.needed, equations.needed_along[1], input::QD),
            (equations.needed, equations.needed_along[2], input::QDD),
            (equations.exerted, equations.exerted_along[0], input::QD),
            (equations.exerted, equations.exerted_along[1], input::TAU),
        ];
        for (of, along, by) in pairs {
            for k in 0..n {
                ask.unit(k, n);
                let slope = ask.of(along);
                assert_close(
                    &slope,
                    &difference(&mut ask, of, by, k),
                    1e-6,
                    &format!("{name}, by {by} {k}"),
                );
            }
        }
    }
}

/// Central differences of the fourth order.
fn difference(ask: &mut Asked<'_>, of: usize, by: &str, k: usize) -> Vec<f64> {
    let start = ask
        .inputs
        .iter()
        .find(|(name, _)| *name == by)
        .unwrap()
        .1
        .clone();
    let mut at = |step: f64| {
        let mut moved = start.clone();
        moved[k] += step;
        ask.set(by, &moved);
        ask.of(of)
    };
    let h = 1e-3;
    let [a, b, c, d] = [-2.0 * h, -h, h, 2.0 * h].map(&mut at);
    at(0.0);
    (0..a.len())
        .map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h))
        .collect()
}

fn mechanics(model: &Learned) -> Mechanics {
    match model.equations(Graph::new()).unwrap() {
        Equations::Mechanics(mechanics) => mechanics,
        other => panic!("{other:?}"),
    }
}

#[test]
fn networks_say_the_same_as_expressions() {
    for (name, model) in models() {
        check_mechanics(&name, &model, &mechanics(&model));
    }
}

#[test]
fn robots_say_the_same_as_expressions() {
    for example in rigid::EXAMPLES {
        let robot = RigidBodies::from_urdf(rigid::example(example).unwrap()).unwrap();
        let n = robot.dof();
        let drives = |first: f64| (0..n).map(|i| first + 0.1 * i as f64).collect::<Vec<_>>();
        let robot = robot.with_drives(drives(0.1), drives(-0.4)).unwrap();
        let robot = robot.with_springs(drives(1.7)).unwrap();
        let (friction, actuation) = forces(n);
        let model = Mechanical::with_forces(robot, Some(friction), Some(actuation)).unwrap();
        let equations = Mechanics::of(Graph::new(), &model.lagrangian, &model.applied()).unwrap();
        check_mechanics(example, &model, &equations);
    }
}

#[test]
fn a_correction_of_a_robot_fades_in_the_expression_as_in_the_model() {
    let robot = RigidBodies::from_urdf(rigid::example("two_link_arm").unwrap()).unwrap();
    let coordinates = lagrangian_mechanics::Lagrangian::coordinates(&robot).clone();
    let delan = Delan::random(
        coordinates.clone(),
        DelanConfig::default(),
        Scaling::identity(2),
        1,
    )
    .unwrap();
    let (friction, actuation) = forces(2);
    let rest: std::sync::Arc<dyn crate::models::LearnedLagrangian> = std::sync::Arc::new(delan);
    let rest = Mechanical::with_forces(rest, Some(friction), Some(actuation)).unwrap();
    let samples = Signals {
        q: vec![-0.8, -0.8, 0.9, 0.9, 0.3, 0.1],
        qd: vec![-0.7, 0.7, 0.9, -0.9, 0.1, 0.2],
        ..Signals::default()
    };
    let visited = lagrangian_mechanics::Visited::of(&coordinates, &samples);
    let model = Learned::with_nominal(robot, rest)
        .unwrap()
        .with_visited(visited);
    check_mechanics("nominal", &model, &mechanics(&model));
}

#[test]
fn plain_networks_say_the_same_as_expressions() {
    for direction in [Direction::Forward, Direction::Inverse] {
        let config = MlpConfig {
            direction,
            forced: true,
            ..MlpConfig::default()
        };
        let scaling = MlpScaling {
            inputs: scaling(3),
            qdd: vec![2.0, 3.0, 4.0],
            tau: vec![0.5, 0.6, 0.7],
        };
        let model: Learned = Mlp::random(coordinates(), config, scaling, 5)
            .unwrap()
            .into();
        let Ok(Equations::Plain(plain)) = model.equations(Graph::new()) else {
            panic!("mechanics");
        };
        let mut ask = asked(&plain.graph, 3, &mut Rng::seed_from_u64(1));
        let [q, qd, qdd, tau, _] = [0, 1, 2, 3, 4].map(|k| ask.inputs[k].1.clone());
        let mut expected = vec![0.0; 3];
        let outcome = match plain.inverse {
            true => model
                .evaluator()
                .inverse_dynamics(&q, &qd, &qdd, &mut expected),
            false => model
                .evaluator()
                .forward_dynamics(&q, &qd, &tau, &mut expected),
        };
        assert!(outcome.is_finite());
        assert_close(&ask.of(plain.output), &expected, 1e-12, "plain network");
        let third = if plain.inverse {
            input::QDD
        } else {
            input::TAU
        };
        for (along, by) in plain.along.into_iter().zip([input::Q, input::QD, third]) {
            ask.unit(1, 3);
            let slope = ask.of(along);
            assert_close(&slope, &difference(&mut ask, plain.output, by, 1), 1e-6, by);
        }
    }
}

#[test]
fn what_needs_not_be_computed_is_not() {
    let graph = Graph::new();
    let x = graph.input("x", 3);
    let (zero, one) = (graph.number(0.0), graph.number(1.0));
    assert_eq!(x + zero, x);
    assert_eq!(one * x, x);
    assert_eq!(-(-x), x);
    assert!((x * zero).numbers().is_some() && (x - x).numbers().is_some());
    let parts: Vec<Value<'_>> = x.each();
    assert_eq!(graph.join(&[parts[2], parts[0]]).at(1), parts[0]);
    let twice = x.sin() * x + x.sin();
    assert_eq!(graph.needed(&[twice.id()]).len(), 4);
    assert_eq!(x.map(Function::WithinTurn).along(&[(x, x)]), x);
}
