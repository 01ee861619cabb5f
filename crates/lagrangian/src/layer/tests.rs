#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::{Inputs, Layer, Map};
use crate::dataset::Momenta;
use crate::fit::FitConfig;
use crate::models::Family;
use crate::models::hnn::{HnnConfig, HnnStructure};
use crate::models::lnn::{Form, LnnConfig};
use crate::models::neural_ode::{NeuralOdeConfig, Order};
use crate::train::{ForceTerms, Input, TrainingTask};
use crate::{DelanConfig, MlpConfig, VinConfig};
use lagrangian_mechanics::Quantities;
use lagrangian_motion::Topology;
use lagrangian_motion::{Coordinates, Error};

const N: usize = 2;
const WIDTH: usize = 16;
const MAPS: [Map; 5] = [
    Map::Acceleration,
    Map::Rates,
    Map::Force,
    Map::Step(0.05),
    Map::Scalar,
];

fn families() -> Vec<(Box<dyn Family>, ForceTerms)> {
    let lnn = |form| {
        Box::<dyn Family>::from(LnnConfig {
            form,
            width: WIDTH,
            ..LnnConfig::default()
        })
    };
    let hnn = |structure, momenta| {
        Box::<dyn Family>::from(HnnConfig {
            structure,
            momenta,
            width: WIDTH,
            ..HnnConfig::default()
        })
    };
    let ode = |order| {
        Box::<dyn Family>::from(NeuralOdeConfig {
            order,
            width: WIDTH,
            ..NeuralOdeConfig::default()
        })
    };
    let delan = DelanConfig {
        width: WIDTH,
        vector_potential: true,
        ..DelanConfig::default()
    };
    let vin = VinConfig {
        width: WIDTH,
        ..VinConfig::default()
    };
    let mlp = MlpConfig {
        width: WIDTH,
        ..MlpConfig::default()
    };
    let none = ForceTerms::default();
    let all = ForceTerms {
        stribeck: true,
        load: true,
        offset: true,
        ..ForceTerms::friction()
    };
    let with = |input| ForceTerms { input, ..all };
    let geared = ForceTerms {
        quadratic: true,
        ..all
    };
    let rotor = ForceTerms {
        rotor: true,
        ..with(Input::Gains)
    };
    let offset = ForceTerms {
        offset: true,
        input: Input::Matrix,
        ..none
    };
    vec![
        (lnn(Form::Free), with(Input::Matrix)),
        (lnn(Form::Free), none),
        (lnn(Form::Convex), geared),
        (delan.into(), rotor),
        (vin.into(), none),
        (hnn(HnnStructure::Free, Momenta::Recorded), offset),
        (
            hnn(HnnStructure::Mass, Momenta::Masses(vec![0.7, 1.3])),
            none,
        ),
        (hnn(HnnStructure::None, Momenta::Recorded), none),
        (hnn(HnnStructure::Free, Momenta::Velocities), none),
        (mlp.into(), none),
        (ode(Order::First), none),
        (ode(Order::Second), none),
    ]
}

/// A fresh layer of an angle and a length, whose parameters keep a distance to the border of their domain.
fn layer((family, forces): (Box<dyn Family>, ForceTerms)) -> Layer {
    let mut coordinates = Coordinates::angles(N);
    coordinates.0[1].topology = Topology::Line;
    let config = FitConfig {
        family,
        training: TrainingTask {
            forces,
            ..TrainingTask::default()
        },
    };
    let mut layer = Layer::new(coordinates, &config).unwrap();
    let inside = |w: &f64| if *w >= 0.0 && *w < 1e-3 { w + 2e-3 } else { *w };
    let parameters: Vec<f64> = layer.parameters().iter().map(inside).collect();
    layer.set_parameters(&parameters).unwrap();
    layer
}

/// `m` states and inputs.
fn states(m: usize) -> [Vec<f64>; 3] {
    let wave = |a: f64, b: f64| (0..m * N).map(|k| (a * k as f64 + b).sin()).collect();
    [wave(1.7, 0.3), wave(0.9, 1.1), wave(2.3, -0.4)]
}

fn inputs(states: &[Vec<f64>; 3]) -> Inputs<'_> {
    let [q, v, u] = states;
    Inputs { q, v, u }
}

/// Σ g y of a map that the layer has.
fn loss(layer: &Layer, map: Map, states: &[Vec<f64>; 3], g: &[f64]) -> f64 {
    let values = layer.evaluate(map, &inputs(states)).unwrap();
    values.iter().zip(g).map(|(y, g)| y * g).sum()
}

/// Half the step of central differences.
const H: f64 = 1e-5;

/// The difference of a slope from the central difference of two losses, relative where that is larger than one.
fn off(slope: f64, above: f64, below: f64) -> f64 {
    let difference = (above - below) / (2.0 * H);
    (slope - difference).abs() / difference.abs().max(1.0)
}

/// The largest difference to central differences of Σ g y.
fn worst(slopes: &[f64], mut loss: impl FnMut(usize, f64) -> f64) -> f64 {
    let error = |(k, slope): (usize, &f64)| off(*slope, loss(k, H), loss(k, -H));
    slopes.iter().enumerate().map(error).fold(0.0, f64::max)
}

fn weights(count: usize) -> Vec<f64> {
    (0..count).map(|k| (0.7 * k as f64 + 0.2).cos()).collect()
}

/// The maps that a layer has, with their sensitivities.
fn maps<'a>(
    layer: &'a Layer,
    states: &'a [Vec<f64>; 3],
) -> impl Iterator<Item = (Map, Vec<f64>)> + 'a {
    let has = |map: Map| {
        Some((
            map,
            weights(layer.evaluate(map, &inputs(states)).ok()?.len()),
        ))
    };
    MAPS.into_iter().filter_map(has)
}

#[test]
fn slopes_by_states_and_inputs_agree_with_differences() {
    for family in families() {
        let (layer, given) = (layer(family), states(3));
        for (map, g) in maps(&layer, &given) {
            let slopes = layer.pull_back(map, &inputs(&given), &g).unwrap();
            for (which, slopes) in [slopes.q, slopes.v, slopes.u].iter().enumerate() {
                let error = worst(slopes, |k, h| {
                    let mut moved = given.clone();
                    moved[which][k] += h;
                    loss(&layer, map, &moved, &g)
                });
                assert!(error < 1e-6, "{layer:?} {map:?}, input {which}: {error:e}");
            }
        }
    }
}

#[test]
fn slopes_by_every_parameter_agree_with_differences() {
    for family in families() {
        let input = family.1.input;
        let (layer, given) = (layer(family), states(3));
        let parameters = layer.parameters().to_vec();
        let maps: Vec<(Map, Vec<f64>)> = maps(&layer, &given).collect();
        // A layer with another parameter serves all maps.
        let losses = |k: usize, h: f64| -> Vec<f64> {
            let mut moved = parameters.clone();
            moved[k] += h;
            let moved = layer.with_parameters(&moved).unwrap();
            let loss = |(map, g): &(Map, Vec<f64>)| loss(&moved, *map, &given, g);
            maps.iter().map(loss).collect()
        };
        let count = 0..parameters.len();
        let differences = count.map(|k| (losses(k, H), losses(k, -H)));
        let differences: Vec<(Vec<f64>, Vec<f64>)> = differences.collect();
        for (i, (map, g)) in maps.iter().enumerate() {
            let slopes = layer.pull_back(*map, &inputs(&given), g).unwrap();
            // The entry of the input matrix that keeps the unit of energy is not learned.
            let is_held =
                |k: &usize| slopes.parameters[*k] == 0.0 && (parameters[*k] - 1.0).abs() < 1e-12;
            let held = (0..parameters.len()).filter(is_held).count();
            let moves = (0..parameters.len()).filter(|k| !is_held(k));
            let error = moves.map(|k| {
                let (above, below) = &differences[k];
                off(slopes.parameters[k], above[i], below[i])
            });
            let error = error.fold(0.0, f64::max);
            assert!(error < 1e-6, "{layer:?} {map:?}: {error:e}");
            let most = usize::from(input != Input::Torque);
            assert!(
                held <= most || *map == Map::Scalar,
                "{layer:?} {map:?}: {held}"
            );
        }
    }
}

#[test]
fn every_family_has_the_maps_that_its_equation_gives() {
    let names = |family| {
        let layer = layer(family);
        let given = states(2);
        let has = MAPS.map(|map| layer.evaluate(map, &inputs(&given)).is_ok());
        let back = MAPS.map(|map| {
            let g = weights(2 * layer.width(map));
            layer.pull_back(map, &inputs(&given), &g).is_ok()
        });
        assert_eq!(has, back, "{layer:?}");
        has
    };
    let found: Vec<_> = families().into_iter().map(names).collect();
    let (lagrangian, first) = ([true; 5], [false, true, false, true, true]);
    let flow = [false, true, false, true, false];
    let plain = [true, true, false, true, false];
    let expected = [
        lagrangian, lagrangian, lagrangian, lagrangian, lagrangian, first, first, flow, first,
        plain, flow, plain,
    ];
    assert_eq!(found, expected);
}

#[test]
fn the_layer_of_a_model_answers_as_the_model() {
    for family in families() {
        let (layer, given) = (layer(family), states(3));
        let model = layer.model().clone();
        let again = Layer::of(&model).unwrap();
        for (map, _) in maps(&layer, &given) {
            let (a, b) = (
                layer.evaluate(map, &inputs(&given)),
                again.evaluate(map, &inputs(&given)),
            );
            let pairs = a.unwrap().into_iter().zip(b.unwrap());
            let worst = pairs
                .map(|(a, b)| (a - b).abs() / (1.0 + a.abs()))
                .fold(0.0, f64::max);
            assert!(worst < 1e-12, "{layer:?} {map:?}: {worst:e}");
        }
        if layer.is_second_order() {
            let qdd = layer.evaluate(Map::Acceleration, &inputs(&given)).unwrap();
            let [q, v, u] = &given;
            let own = model.forward_dynamics(q, v, u).unwrap();
            assert_eq!(qdd, own);
        }
    }
}

#[test]
fn many_states_have_the_slopes_of_each_alone_and_the_same_bits_on_any_number_of_threads() {
    for family in families() {
        let (layer, given) = (layer(family), states(150));
        let g = weights(150 * layer.width(Map::Rates));
        let pull = || layer.pull_back(Map::Rates, &inputs(&given), &g).unwrap();
        let pool = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
        };
        let all = pool(1).install(pull);
        assert_eq!(all, pool(3).install(pull), "{layer:?}");
        let mut sum = vec![0.0; layer.parameters().len()];
        for s in [0, 31, 32, 149] {
            let row = s * N..(s + 1) * N;
            let [q, v, u] = [0, 1, 2].map(|k| &given[k][row.clone()]);
            let own = &g[2 * row.start..2 * row.end];
            let one = layer
                .pull_back(Map::Rates, &Inputs { q, v, u }, own)
                .unwrap();
            for (one, all) in [(one.q, &all.q), (one.v, &all.v), (one.u, &all.u)] {
                let pairs = one.iter().zip(&all[row.clone()]);
                assert!(
                    pairs
                        .clone()
                        .all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + a.abs()))
                );
            }
            sum.iter_mut()
                .zip(&one.parameters)
                .for_each(|(a, b)| *a += b);
        }
        assert!(sum.iter().any(|x| *x != 0.0));
    }
}

#[test]
fn inputs_that_are_no_states_are_refused() {
    let layer = layer(families().remove(0));
    let evaluate = |q: &[f64], v: &[f64], u: &[f64]| {
        layer
            .evaluate(Map::Acceleration, &Inputs { q, v, u })
            .unwrap_err()
    };
    assert!(matches!(
        evaluate(&[0.0; 3], &[0.0; 4], &[]),
        Error::Shape { .. }
    ));
    assert!(matches!(
        evaluate(&[0.0; 4], &[0.0; 2], &[]),
        Error::Shape { .. }
    ));
    assert!(matches!(
        evaluate(&[0.0; 2], &[0.0; 2], &[0.0]),
        Error::Shape { .. }
    ));
    let nan = evaluate(&[0.0, f64::NAN], &[0.0; 2], &[]).to_string();
    assert!(nan.contains('q') && nan.contains("index 1"), "{nan}");
    let state = Inputs {
        q: &[0.0; 2],
        v: &[0.0; 2],
        u: &[],
    };
    let pull = |g: &[f64]| layer.pull_back(Map::Acceleration, &state, g).unwrap_err();
    assert!(matches!(pull(&[1.0]), Error::Shape { .. }));
    assert!(matches!(
        pull(&[1.0, f64::INFINITY]),
        Error::NotFinite { .. }
    ));
    let step = layer.evaluate(Map::Step(f64::NAN), &state).unwrap_err();
    assert!(step.to_string().contains("step"), "{step}");
    let nothing = Inputs {
        q: &[],
        v: &[],
        u: &[],
    };
    assert!(layer.evaluate(Map::Rates, &nothing).unwrap().is_empty());
    let still = layer.pull_back(Map::Rates, &nothing, &[]).unwrap();
    assert!(still.parameters.iter().all(|x| *x == 0.0));
}

#[test]
fn parameters_of_another_model_are_refused_and_those_outside_their_domain_projected() {
    let mut layer = layer((
        LnnConfig {
            form: Form::Convex,
            width: WIDTH,
            ..LnnConfig::default()
        }
        .into(),
        ForceTerms::friction(),
    ));
    let before = layer.parameters().to_vec();
    assert!(matches!(
        layer.set_parameters(&before[1..]),
        Err(Error::Shape { .. })
    ));
    let mut wrong = before.clone();
    wrong[3] = f64::NAN;
    assert!(matches!(
        layer.set_parameters(&wrong),
        Err(Error::NotFinite { .. })
    ));
    let mut negative: Vec<f64> = before.iter().map(|w| w - 1.0).collect();
    assert!(layer.set_parameters(&negative).is_err());
    assert_eq!(layer.parameters(), before);
    layer.project(&mut negative).unwrap();
    layer.set_parameters(&negative).unwrap();
    assert_eq!(layer.initialise(3), layer.initialise(3));
}

#[test]
fn models_without_a_layer_say_so() {
    let refused = |family: Box<dyn Family>| {
        let config = FitConfig {
            family,
            ..FitConfig::default()
        };
        Layer::new(Coordinates::angles(1), &config)
            .unwrap_err()
            .to_string()
    };
    let fast = LnnConfig {
        speed_limit: Some(3.0),
        ..LnnConfig::default()
    };
    assert!(refused(fast.into()).contains("limit of speed"));
    assert!(refused(crate::FeaturesConfig::default().into()).contains("features"));
    let config = FitConfig::default();
    assert!(Layer::new(Coordinates(Vec::new()), &config).is_err());
    let mut parameter = Coordinates::angles(2);
    parameter.0[1].topology = Topology::Parameter;
    let error = Layer::new(parameter, &config).unwrap_err().to_string();
    assert!(error.contains("parameters"), "{error}");
}
