//! Weights of models as one vector.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::expression::{check_mechanics, coordinates, models, scaling};
use crate::dataset::Momenta;
use crate::models::hnn::{Hnn, HnnConfig, HnnStructure};
use crate::models::{Direction, Mlp, MlpConfig, MlpScaling};
use crate::{Error, Learned};
use lagrangian_mechanics::expression::{Equations, Flow, Graph, Span, input};
use lagrangian_mechanics::{Canonical, Model};

fn all(spans: &[Span]) -> Vec<f64> {
    let values = spans.iter().flat_map(|span| &span.values);
    values.copied().collect()
}

#[test]
fn expressions_of_weights_say_the_same_as_their_models() {
    for (name, model) in models() {
        let Equations::Mechanics(equations) = model.equations(Graph::of_weights()).unwrap() else {
            panic!("{name} is a Lagrangian");
        };
        check_mechanics(&name, &model, &equations);
    }
}

#[test]
fn a_model_takes_all_weights_of_its_vector() {
    for (name, model) in models() {
        let weights = all(&model.weights().unwrap());
        let moved: Vec<f64> = weights.iter().map(|w| 1.25 * w + 1e-3).collect();
        let other = model.with_weights(&moved).unwrap();
        assert_eq!(all(&other.weights().unwrap()), moved, "{name}");
        let mut evaluator = other.evaluator();
        let mut energy = [0.0];
        let state = ([0.3, -0.2, 0.5], [0.1, 0.4, -0.3]);
        assert!(
            evaluator
                .energy(&state.0, &state.1, &mut energy)
                .is_finite()
        );
        let again = other.with_weights(&weights).unwrap();
        assert_eq!(all(&again.weights().unwrap()), weights, "{name}");
    }
}

#[test]
fn weights_that_a_model_cannot_have_are_refused() {
    let (_, model) = models().remove(0);
    let mut weights = all(&model.weights().unwrap());
    let short = model.with_weights(&weights[1..]).unwrap_err();
    assert!(matches!(short, Error::Shape { .. }), "{short}");
    weights[0] = f64::NAN;
    let infinite = model.with_weights(&weights).unwrap_err();
    assert!(matches!(infinite, Error::NotFinite { .. }), "{infinite}");
    weights[0] = 0.0;
    let spans = model.weights().unwrap();
    let viscous = spans.iter().find(|span| span.name.ends_with("viscous"));
    weights[viscous.unwrap().first] = -1.0;
    let negative = model.with_weights(&weights).unwrap_err();
    assert!(matches!(negative, Error::Argument { .. }), "{negative}");
}

fn flows() -> Vec<(&'static str, Learned)> {
    let hnn = |structure, momenta| -> Learned {
        let config = HnnConfig {
            structure,
            momenta,
            width: 16,
            ..HnnConfig::default()
        };
        Canonical::conservative(Hnn::random(coordinates(), config, scaling(3), 2).unwrap()).into()
    };
    let first = MlpConfig {
        direction: Direction::Flow,
        forced: true,
        ..MlpConfig::default()
    };
    let scales = MlpScaling {
        inputs: scaling(3),
        ..MlpScaling::identity(3)
    };
    let network = Mlp::random(coordinates(), first, scales, 3).unwrap();
    vec![
        ("first order", network.into()),
        ("plain", hnn(HnnStructure::None, Momenta::Recorded)),
        ("velocities", hnn(HnnStructure::Free, Momenta::Velocities)),
    ]
}

#[test]
fn flows_say_the_same_as_expressions() {
    for (name, model) in flows() {
        for graph in [Graph::new(), Graph::of_weights()] {
            let Equations::Flow(Flow { graph, rates }) = model.equations(graph).unwrap() else {
                panic!("{name} is a flow");
            };
            let (q, z, tau) = ([0.3, -0.2, 0.5], [0.1, 0.4, -0.3], [1.0, 0.5, -0.7]);
            let at: [(&str, &[f64]); 3] = [(input::Q, &q), (input::QD, &z), (input::TAU, &tau)];
            let found = graph
                .evaluate(&at, &rates.map(|id| graph.value(id)))
                .unwrap();
            let (mut dq, mut dz) = ([0.0; 3], [0.0; 3]);
            let mut evaluator = model.evaluator();
            let flow = evaluator.phase_flow().unwrap();
            assert!(flow.flow(&q, &z, &tau, &mut dq, &mut dz).is_finite());
            for (found, expected) in found.concat().iter().zip([dq, dz].concat()) {
                let error = (found - expected).abs();
                assert!(
                    error <= 1e-12 * expected.abs().max(1.0),
                    "{name}: {error:e}"
                );
            }
        }
    }
}
