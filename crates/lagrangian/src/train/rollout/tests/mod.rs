#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod gauss_newton;

use super::config::{Observe, RolloutLoss, Start};
use super::flow::Flow;
use super::gradient::{Derivatives, Shooting};
use super::segments::{Recorded, Rows};
use super::shoot::{Back, Block, Task};
use crate::dataset::{Dataset, Momenta};
use crate::fit::FitConfig;
use crate::models::Family;
use crate::models::delan::DelanConfig;
use crate::models::hnn::{HnnConfig, HnnStructure};
use crate::models::lnn::{Form, LnnConfig};
use crate::models::mlp::MlpConfig;
use crate::models::neural_ode::{NeuralOdeConfig, Order};
use crate::models::{Residuals, Training};
use crate::train::{ForceTerms, Learner, Loss, TrainingTask};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::integrate::Method;
use lagrangian_motion::Signals;
use lagrangian_motion::{Coordinates, Trajectory};
use nets::Packed;

pub(super) const METHODS: [Method; 3] =
    [Method::Rk4, Method::StormerVerlet, Method::ImplicitMidpoint];

/// The methods that a family can be trained through.
pub(super) fn methods(family: &dyn Family) -> Vec<Method> {
    let first = ["hnn", "neural-ode"].contains(&family.name());
    let known = METHODS.into_iter();
    known
        .filter(|m| !(first && *m == Method::StormerVerlet))
        .collect()
}

/// A motion that no model generated, at uneven times, one coordinate a circle, under forces.
pub(crate) fn dataset() -> Dataset {
    let trajectory = |shift: f64| {
        let t: Vec<f64> = (0..14)
            .map(|k| 0.06 * f64::from(k) + 0.01 * (f64::from(k) * 1.7).sin())
            .collect();
        let each = |f: &dyn Fn(f64) -> f64, g: &dyn Fn(f64) -> f64| -> Vec<f64> {
            t.iter().flat_map(|t| [f(*t), g(*t)]).collect()
        };
        let signals = Signals {
            q: each(&|t| 3.0 + (2.0 * t + shift).sin(), &|t| {
                (1.3 * t - shift).cos()
            }),
            qd: each(&|t| 2.0 * (2.0 * t + shift).cos(), &|t| {
                -1.3 * (1.3 * t - shift).sin()
            }),
            qdd: each(&|t| -4.0 * (2.0 * t + shift).sin(), &|t| {
                -1.69 * (1.3 * t).cos()
            }),
            tau: each(&|t| (5.0 * t + 0.2).sin(), &|t| {
                0.3 * (3.0 * t + shift).cos()
            }),
            p: each(&|t| 1.7 * (2.0 * t + shift).cos(), &|t| {
                (1.1 * t - shift).sin()
            }),
            pd: each(&|t| -3.4 * (2.0 * t + shift).sin(), &|t| {
                1.1 * (1.1 * t - shift).cos()
            }),
            ..Signals::default()
        };
        Trajectory::new("test", t, signals)
    };
    let mut coordinates = Coordinates::angles(2);
    coordinates.0[1].topology = lagrangian_motion::Topology::Line;
    let train = [trajectory(0.0), trajectory(0.8)];
    Dataset::new(coordinates, &train, &[]).unwrap()
}

pub(super) fn families() -> Vec<(Box<dyn Family>, ForceTerms)> {
    let lnn = |form| {
        let lnn = LnnConfig {
            form,
            width: 16,
            ..LnnConfig::default()
        };
        Box::<dyn Family>::from(lnn)
    };
    let delan = DelanConfig {
        width: 16,
        vector_potential: true,
        ..DelanConfig::default()
    };
    let mlp = MlpConfig {
        width: 16,
        ..MlpConfig::default()
    };
    let first = NeuralOdeConfig {
        order: Order::First,
        width: 16,
        ..NeuralOdeConfig::default()
    };
    let forces = ForceTerms {
        stribeck: true,
        load: true,
        offset: true,
        ..ForceTerms::friction()
    };
    let gears = ForceTerms {
        rotor: true,
        directional: true,
        quadratic: true,
        ..forces
    };
    let hnn = |structure, momenta| {
        let hnn = HnnConfig {
            structure,
            momenta,
            width: 16,
            ..HnnConfig::default()
        };
        (Box::<dyn Family>::from(hnn), ForceTerms::default())
    };
    vec![
        hnn(HnnStructure::Free, Momenta::Masses(vec![0.7, 1.3])),
        hnn(HnnStructure::Mass, Momenta::Recorded),
        hnn(HnnStructure::None, Momenta::Masses(vec![0.7, 1.3])),
        (lnn(Form::Free), forces),
        (lnn(Form::Convex), ForceTerms::default()),
        (Box::<dyn Family>::from(delan), gears),
        (Box::<dyn Family>::from(mlp), ForceTerms::default()),
        (Box::<dyn Family>::from(first), ForceTerms::default()),
    ]
}

/// Passes the learner of the rates to `f`.
pub(super) fn with_flow<R>(model: &Training, f: impl FnOnce(&dyn Learner<f64>) -> R) -> R {
    f(&*model.learner(Residuals::OfRates))
}

pub(super) fn template(dataset: &Dataset, family: &dyn Family, forces: ForceTerms) -> Training {
    let config = FitConfig {
        family: family.boxed(),
        training: TrainingTask {
            loss: Loss::ROLLOUT,
            forces,
            ..TrainingTask::default()
        },
    };
    config.trainable(dataset).unwrap()
}

pub(super) fn settings(integrator: Method) -> RolloutLoss {
    RolloutLoss {
        horizon: 3,
        integrator,
        substeps: 2,
        ..RolloutLoss::default()
    }
}

/// A smooth direction in the space of the parameters.
pub(super) fn direction(length: usize, seed: f64) -> Vec<f64> {
    (0..length).map(|k| (seed + 1.3 * k as f64).sin()).collect()
}

pub(super) fn moved(x: &[f64], along: &[f64], step: f64) -> Vec<f64> {
    x.iter().zip(along).map(|(x, d)| x + step * d).collect()
}

/// The loss and its gradient on a few segments.
fn loss(
    config: &RolloutLoss,
    (family, template): (&dyn Family, &Training),
    dataset: &Dataset,
    parameters: &[f64],
) -> (f64, Vec<f64>) {
    let recorded = Recorded::train(dataset, family.momenta());
    let weights = recorded.weights(config.horizon);
    let rows = Rows::new(config, config.horizon, 2);
    let task = Task {
        recorded,
        config,
        weights: &weights,
        starts: &[],
        rows: &rows,
    };
    let mut gradient = vec![0.0; parameters.len()];
    let value = {
        let learner = &*template.learner(Residuals::OfRates);
        let derivatives = Derivatives {
            gradient: &mut gradient,
            moves: &mut Vec::new(),
        };
        let mut shooting = Shooting::new(learner, config, 16);
        let task = (&task, &recorded.starts(config.horizon, 2)[..]);
        shooting.evaluate(learner, parameters, task, Some(derivatives))
    };
    assert_eq!(value.singular, 0);
    (value.mean(), gradient)
}

/// The derivative along a direction: by the gradient, and by differences.
fn slopes(
    config: &RolloutLoss,
    dataset: &Dataset,
    fitted: (&dyn Family, &Training),
) -> Vec<(f64, f64)> {
    let parameters = fitted.1.initialise(3);
    let (_, gradient) = loss(config, fitted, dataset, &parameters);
    let one = |seed| {
        let along = direction(parameters.len(), seed);
        let at = |step| loss(config, fitted, dataset, &moved(&parameters, &along, step)).0;
        let step = 2e-5;
        let far = (at(2.0 * step) - at(-2.0 * step)) / (4.0 * step);
        let near = (at(step) - at(-step)) / (2.0 * step);
        (
            lagrangian_motion::solve::dot(&gradient, &along),
            (4.0 * near - far) / 3.0,
        )
    };
    [0.2, 1.9].map(one).to_vec()
}

#[test]
fn the_gradient_back_through_the_steps_agrees_with_differences() {
    let dataset = dataset();
    for (family, forces) in families() {
        let template = template(&dataset, &*family, forces);
        for method in methods(&*family) {
            for observe in [Observe::States, Observe::Positions] {
                let config = RolloutLoss {
                    observe,
                    ..settings(method)
                };
                for (by_gradient, by_differences) in
                    slopes(&config, &dataset, (&*family, &template))
                {
                    assert!(
                        (by_gradient - by_differences).abs() < 1e-7 * by_differences.abs(),
                        "{} {}: {by_gradient} against {by_differences}",
                        family.name(),
                        method.name()
                    );
                }
            }
        }
    }
}

#[test]
fn a_rollout_in_training_is_that_of_the_model() {
    let dataset = dataset();
    for (family, forces) in families() {
        let template = template(&dataset, &*family, forces);
        let parameters = template.initialise(5);
        let model = template.assemble(&parameters).unwrap();
        for method in methods(&*family) {
            let config = settings(method);
            let recorded = Recorded::train(&dataset, family.momenta());
            let weights = recorded.weights(config.horizon);
            let rows = Rows::new(&config, config.horizon, 2);
            let task = Task {
                recorded,
                config: &config,
                weights: &weights,
                starts: &[],
                rows: &rows,
            };
            let state = with_flow(&template, |learner| {
                let mut packed = Packed::new(learner.net());
                let (weights, extra) = parameters.split_at(learner.net().parameters);
                packed.set(learner.net(), weights);
                let mut block = Block::new(learner, &config, false);
                let flow = Flow {
                    learner,
                    packed: &packed,
                    extra,
                    sizes: block.sizes,
                };
                block.shoot(&flow, &task, &[4]);
                block.back(&task, Back::Each);
                block.states[2][..4].to_vec()
            });
            let x0: Vec<f64> = (0..4).map(|c| recorded.state(4, c)).collect();
            let (t, tau) = (&dataset.train_times.t, &dataset.train.tau);
            let times = [t[4], 0.5 * (t[4] + t[5]), t[5]];
            let mut evaluator = model.evaluator();
            let control = lagrangian_mechanics::integrate::Control {
                step: 0.51 * (t[5] - t[4]),
                rtol: 1e-9,
                atol: 1e-9,
                max_steps: 100,
                stop: lagrangian_motion::Stop::default(),
            };
            let span = lagrangian_mechanics::integrate::Span::new(&x0, &times, &control);
            let mut end = Vec::new();
            let mut sink = |_: usize, x: &[f64]| end = x.to_vec();
            let force = &tau[8..10];
            let _ = match evaluator.phase_flow() {
                None => {
                    let mut f = |_: f64, q: &[f64], v: &[f64], a: &mut [f64]| {
                        let _ = evaluator.forward_dynamics(q, v, force, a);
                    };
                    method.solve(&mut f, span, &mut sink)
                }
                Some(phase) => {
                    let mut f = |_: f64, q: &[f64], z: &[f64], dq: &mut [f64], dz: &mut [f64]| {
                        let _ = phase.flow(q, z, force, dq, dz);
                    };
                    method.solve_flow(&mut f, span, &mut sink)
                }
            };
            for (a, b) in state.iter().zip(&end) {
                assert!(
                    (a - b).abs() < 1e-12,
                    "{} {}: {a} {b}",
                    family.name(),
                    method.name()
                );
            }
        }
    }
}

#[test]
fn free_starts_have_the_slopes_of_differences() {
    let dataset = dataset();
    let (family, forces) = &families()[3];
    let template = template(&dataset, &**family, *forces);
    let parameters = template.initialise(5);
    let recorded = Recorded::train(&dataset, family.momenta());
    for method in METHODS {
        let config = RolloutLoss {
            start: Start::Free,
            ..settings(method)
        };
        let weights = recorded.weights(config.horizon);
        let rows = Rows::new(&config, config.horizon, 2);
        let states = (0..dataset.train.len() * 4).map(|at| recorded.state(at / 4, at % 4));
        let starts: Vec<f64> = states
            .enumerate()
            .map(|(k, x)| x + 0.1 * (k as f64).sin())
            .collect();
        let at = |starts: &[f64]| {
            let task = Task {
                recorded,
                config: &config,
                weights: &weights,
                starts,
                rows: &rows,
            };
            with_flow(&template, |learner| {
                let mut packed = Packed::new(learner.net());
                let (weights, extra) = parameters.split_at(learner.net().parameters);
                packed.set(learner.net(), weights);
                let mut block = Block::new(learner, &config, false);
                let flow = Flow {
                    learner,
                    packed: &packed,
                    extra,
                    sizes: block.sizes,
                };
                block.shoot(&flow, &task, &[2]);
                block.back(&task, Back::Each);
                (block.residual, block.sensitivities.to_start)
            })
        };
        let (_, slopes) = at(&starts);
        for c in 0..4 {
            let along: Vec<f64> = (0..starts.len())
                .map(|k| f64::from(u8::from(k == 8 + c)))
                .collect();
            let (up, down) = (
                at(&moved(&starts, &along, 1e-5)).0,
                at(&moved(&starts, &along, -1e-5)).0,
            );
            for row in 0..rows.count() {
                let difference = (up[row] - down[row]) / 2e-5;
                let slope = slopes[row * 4 + c];
                assert!(
                    (slope - difference).abs() < 1e-7,
                    "{c} {row}: {slope} {difference}"
                );
            }
        }
    }
}
