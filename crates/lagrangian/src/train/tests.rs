#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::forces::{ForceTerms, Forces, Input};
use super::learner::Learner;
use super::loss::Loss;
use super::natural::{Natural, NaturalConfig, StepSize};
use super::network::{Batches, NetworkMemory};
use super::positions::PositionsLearner;
use super::problem::{Batch, LeastSquares};
use crate::models::NetworkShape;
use crate::models::delan::learner::DelanLearner;
use crate::models::delan::{DelanConfig, Inertia, Trunks};
use crate::models::lnn::learner::LnnLearner;
use crate::models::lnn::{Form, LnnConfig};
use crate::models::mlp::learner::MlpLearner;
use crate::models::mlp::{MlpConfig, MlpScaling, MlpShape};
use crate::models::{delan::DelanShape, lnn::LnnShape};
use lagrangian_mechanics::lagrangian::{Scaling, SpeedChart};
use lagrangian_mechanics::rigid::{self, RigidBodies};
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::{Coordinates, Topology};

pub(crate) fn samples(n: usize, m: usize) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut column = || (0..m * n).map(|_| rng.random_range(-1.5..1.5)).collect();
    Samples::new(
        n,
        Signals {
            q: column(),
            qd: column(),
            qdd: column(),
            tau: column(),
            ..Signals::default()
        },
    )
}

/// Three neighbours of positions, at steps that are not even.
fn neighbours(n: usize, m: usize) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    Samples {
        steps: (0..2 * m).map(|_| rng.random_range(0.05..0.15)).collect(),
        ..samples(n, m)
    }
}

fn shape(n: usize, form: Form) -> LnnShape {
    let config = LnnConfig {
        form,
        width: 16,
        ..Default::default()
    };
    let scaling = Scaling {
        energy: 1.7,
        qd_scale: vec![1.3; n],
        ..Scaling::identity(n)
    };
    LnnShape::new(Coordinates::angles(n), config, scaling).unwrap()
}

pub(crate) fn forces(terms: ForceTerms, n: usize) -> Forces {
    Forces::new(terms, vec![0.7; n], vec![1.5; n], vec![1.1; n])
}

/// All kinds of forces.
fn all_forces(input: Input) -> ForceTerms {
    ForceTerms {
        viscous: true,
        drag: true,
        coulomb: true,
        stribeck: true,
        load: true,
        // Tests both the closed slopes and the carried ones.
        directional: input == Input::Matrix,
        quadratic: input == Input::Matrix,
        offset: true,
        rotor: true,
        input,
    }
}

/// Random weights, and forces that differ from their initial values.
fn parameters(learner: &dyn Learner<f64>) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut parameters = learner.net().initialise(&mut rng);
    let initial = learner.forces().map(Forces::initial).unwrap_or_default();
    parameters.extend(initial.iter().map(|x| x + rng.random_range(0.1..0.4)));
    learner.project(&mut parameters);
    parameters
}

fn delan(n: usize, config: DelanConfig) -> DelanShape {
    let scaling = Scaling {
        energy: 1.7,
        qd_scale: (0..n).map(|i| 1.3 + 0.2 * i as f64).collect(),
        ..Scaling::identity(n)
    };
    let config = DelanConfig {
        width: 16,
        ..config
    };
    DelanShape::new(Coordinates::angles(n), config, scaling).unwrap()
}

#[test]
fn the_gradient_of_a_deep_lagrangian_network_agrees_with_differences() {
    let losses = [
        Loss::TORQUE,
        Loss::TORQUE_L1,
        Loss::ACCELERATION,
        Loss::TORQUE_ACCELERATION,
        Loss::TORQUE_POWER,
    ];
    for n in [1, 2, 3] {
        for loss in losses {
            for trunks in [Trunks::Shared, Trunks::Separate] {
                let vector_potential = trunks == Trunks::Separate;
                let shape = delan(
                    n,
                    DelanConfig {
                        trunks,
                        vector_potential,
                        ..Default::default()
                    },
                );
                let input = [Input::Torque, Input::Gains, Input::Matrix][n - 1];
                let weights: Vec<f64> = (0..2 * n).map(|i| 0.8 + 0.1 * i as f64).collect();
                let learner = DelanLearner {
                    nominal: None,
                    phase: false,
                    shape: &shape,
                    loss,
                    weights: &weights,
                    forces: forces(all_forces(input), n),
                };
                let error = gradient_error(&learner, loss, &samples(n, 37));
                assert!(error < 1e-7, "n {n} {trunks:?} {loss:?}: {error:e}");
            }
        }
    }
}

/// Calls `f` with learners of positions alone of all kinds, for `n` coordinates, each with a name.
fn each_learner_of_positions(n: usize, mut f: impl FnMut(&dyn Learner<f64>, Loss, String)) {
    let weights: Vec<f64> = (0..n).map(|i| 0.8 + 0.1 * i as f64).collect();
    let input = [Input::Torque, Input::Gains, Input::Matrix][n - 1];
    for loss in [Loss::POSITIONS, Loss::POSITIONS_TRAPEZOIDAL] {
        let rule = loss.rule().unwrap();
        for form in [Form::Free, Form::Convex] {
            let shape = shape(n, form);
            let learner = PositionsLearner {
                family: &shape,
                loss,
                rule,
                constant: false,
                weights: &weights,
                forces: forces(ForceTerms::friction(), n),
                chords: 12,
            };
            f(&learner, loss, format!("{form:?} {loss:?} of {n}"));
        }
        for (trunks, inertia) in [
            (Trunks::Shared, Inertia::Configuration),
            (Trunks::Separate, Inertia::Configuration),
            (Trunks::Shared, Inertia::Constant),
        ] {
            let config = DelanConfig {
                trunks,
                inertia,
                vector_potential: trunks == Trunks::Separate,
                ..Default::default()
            };
            let shape = delan(n, config);
            let learner = PositionsLearner {
                family: &shape,
                loss,
                rule,
                constant: shape.config.has_constant_momentum(),
                weights: &weights,
                // The chords converge where friction changes its sign as slowly as with these parameters.
                forces: forces(
                    ForceTerms {
                        drag: false,
                        ..all_forces(input)
                    },
                    n,
                ),
                chords: 30,
            };
            f(
                &learner,
                loss,
                format!("{trunks:?} {inertia:?} {loss:?} of {n}"),
            );
        }
    }
}

#[test]
fn the_gradient_through_the_discrete_euler_lagrange_equation_agrees_with_differences() {
    for n in [1, 2] {
        each_learner_of_positions(n, |learner, loss, name| {
            let error = gradient_error(learner, loss, &neighbours(n, 37));
            assert!(error < 1e-5, "{name}: {error:e}");
        });
    }
}

#[test]
fn a_natural_step_on_positions_shrinks_every_residual_by_its_rate() {
    each_learner_of_positions(2, |learner, loss, _| {
        // A constant mass matrix has too few parameters for many residuals to be independent.
        assert_step_solves(learner, loss, &neighbours(2, 7));
    });
}

#[test]
fn a_natural_step_of_a_deep_lagrangian_network_shrinks_every_residual_by_its_rate() {
    for loss in [
        Loss::TORQUE,
        Loss::ACCELERATION,
        Loss::TORQUE_ACCELERATION,
        Loss::TORQUE_POWER,
    ] {
        let shape = delan(
            2,
            DelanConfig {
                vector_potential: true,
                ..Default::default()
            },
        );
        // Near M r_q̈ = −r_τ the residuals of both kinds depend on each other: fewer samples keep them apart.
        let count = if loss == Loss::TORQUE_ACCELERATION {
            7
        } else {
            21
        };
        let weights = [0.8, 1.2, 0.5, 0.6];
        let learner = DelanLearner {
            nominal: None,
            phase: false,
            shape: &shape,
            loss,
            weights: &weights,
            forces: forces(all_forces(Input::Matrix), 2),
        };
        assert_step_solves(&learner, loss, &samples(2, count));
    }
}

/// The largest relative error of the gradient against central differences, over some parameters.
pub(crate) fn gradient_error(learner: &dyn Learner<f64>, loss: Loss, samples: &Samples) -> f64 {
    let parameters = parameters(learner);
    let numbers: Vec<usize> = (0..samples.len()).collect();
    let mut batches = Batches::new(learner, samples.len());
    let mut gradient = vec![0.0; parameters.len()];
    batches.evaluate(
        learner,
        loss,
        &parameters,
        Batch {
            samples,
            indices: &numbers,
        },
        Some(&mut gradient),
    );
    let largest = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
    let mut worst = 0.0_f64;
    for k in (0..parameters.len())
        .step_by(parameters.len() / 40 + 1)
        .chain([parameters.len() - 1])
    {
        let mut at = |x: f64| {
            let mut moved = parameters.clone();
            moved[k] += x;
            batches
                .evaluate(
                    learner,
                    loss,
                    &moved,
                    Batch {
                        samples,
                        indices: &numbers,
                    },
                    None,
                )
                .mean()
        };
        let h = 1e-4;
        let (near, far) = (at(h) - at(-h), at(2.0 * h) - at(-2.0 * h));
        let slope = (8.0 * near - far) / (12.0 * h);
        worst = worst.max((slope - gradient[k]).abs() / largest);
    }
    worst
}

#[test]
fn the_gradient_through_the_euler_lagrange_equation_agrees_with_differences() {
    for n in [1, 2, 3] {
        for form in [Form::Free, Form::Convex] {
            for (loss, friction) in [
                (Loss::ACCELERATION, false),
                (Loss::ACCELERATION, true),
                (Loss::TORQUE, true),
                (Loss::ACCELERATION_L1, false),
                (Loss::ACCELERATION_RELATIVE, false),
            ] {
                let shape = shape(n, form);
                let terms = if friction {
                    ForceTerms::friction()
                } else {
                    ForceTerms::default()
                };
                let weights = vec![0.8; n];
                let learner = LnnLearner {
                    nominal: None,
                    phase: false,
                    shape: &shape,
                    loss,
                    weights: &weights,
                    forces: forces(terms, n),
                };
                let error = gradient_error(&learner, loss, &samples(n, 37));
                assert!(error < 1e-7, "n {n} {form:?} {loss:?}: {error:e}");
            }
        }
    }
}

/// Two coordinates on a line, of which the second is a parameter.
fn with_parameter() -> Coordinates {
    let mut coordinates = Coordinates::lines(2);
    coordinates.0[1].topology = Topology::Parameter;
    coordinates
}

/// Samples of them: the parameter has values, and neither velocity nor acceleration.
fn held_samples(m: usize) -> Samples {
    let mut held = samples(2, m);
    let Signals { qd, qdd, .. } = &mut held.signals;
    for signal in [qd, qdd] {
        signal.chunks_exact_mut(2).for_each(|x| x[1] = 0.0);
    }
    held
}

#[test]
fn gradients_leave_a_parameter_out_and_agree_with_differences() {
    let (held, weights) = (held_samples(37), [0.8, 0.0, 0.5, 0.0]);
    let terms = forces(ForceTerms::friction(), 2);
    for loss in [
        Loss::ACCELERATION,
        Loss::ACCELERATION_RELATIVE,
        Loss::ACCELERATION_L1,
        Loss::TORQUE,
        Loss::TORQUE_L1,
    ] {
        for form in [Form::Free, Form::Convex] {
            let shape = LnnShape {
                coordinates: with_parameter(),
                ..shape(2, form)
            };
            let net = shape.config.net(
                shape.scaling.features(&shape.coordinates),
                shape.coordinates.dof(),
            );
            let shape = LnnShape { net, ..shape };
            let learner = LnnLearner {
                shape: &shape,
                loss,
                weights: &weights[..2],
                forces: terms.clone(),
                nominal: None,
                phase: false,
            };
            let error = gradient_error(&learner, loss, &held);
            assert!(error < 1e-7, "lnn {form:?} {loss:?}: {error:e}");
        }
        let scaling = Scaling::identity(2);
        let shape = DelanShape::new(with_parameter(), DelanConfig::default(), scaling).unwrap();
        let learner = DelanLearner {
            shape: &shape,
            loss,
            weights: &weights,
            forces: terms.clone(),
            nominal: None,
            phase: false,
        };
        let error = gradient_error(&learner, loss, &held);
        assert!(error < 1e-7, "delan {loss:?}: {error:e}");
        assert_eq!(<dyn Learner<f64>>::counted(&learner), 1);
    }
}

#[test]
fn gradients_through_charts_of_the_speed_and_exponential_units_agree_with_differences() {
    let artanh = SpeedChart::Artanh;
    for (form, speed_limit, speed_chart) in [
        (Form::Free, Some(2.0), artanh),
        (Form::Free, Some(2.0), SpeedChart::Arcsin),
        (Form::Free, None, artanh),
        (Form::Convex, None, artanh),
    ] {
        for (loss, count) in [(Loss::ACCELERATION, 21), (Loss::TORQUE, 21)] {
            let config = LnnConfig {
                form,
                width: 16,
                exponential: true,
                speed_limit,
                speed_chart,
                ..Default::default()
            };
            let shape =
                LnnShape::new(Coordinates::angles(2), config, Scaling::identity(2)).unwrap();
            let learner = LnnLearner {
                shape: &shape,
                loss,
                weights: &[0.8, 1.1],
                forces: forces(ForceTerms::friction(), 2),
                nominal: None,
                phase: false,
            };
            let error = gradient_error(&learner, loss, &samples(2, 37));
            let what = format!("{form:?} {speed_limit:?} {speed_chart:?} {loss:?}");
            assert!(error < 1e-7, "{what}: {error:e}");
            assert_step_solves(&learner, loss, &samples(2, count));
        }
    }
}

#[test]
fn the_gradients_of_networks_upon_a_robot_agree_with_differences() {
    let urdf = rigid::example("two_link_arm").unwrap();
    let robot = RigidBodies::from_urdf(urdf).unwrap();
    let (deep, weights) = (delan(2, DelanConfig::default()), [0.8, 1.2, 0.5, 0.6]);
    for loss in [
        Loss::TORQUE,
        Loss::ACCELERATION,
        Loss::TORQUE_ACCELERATION,
        Loss::TORQUE_POWER,
    ] {
        let learner = DelanLearner {
            shape: &deep,
            loss,
            weights: &weights,
            forces: forces(all_forces(Input::Gains), 2),
            nominal: Some(&robot),
            phase: false,
        };
        let error = gradient_error(&learner, loss, &samples(2, 37));
        assert!(error < 1e-7, "delan {loss:?}: {error:e}");
    }
    for (form, loss) in [
        (Form::Free, Loss::TORQUE),
        (Form::Convex, Loss::TORQUE),
        (Form::Convex, Loss::ACCELERATION),
    ] {
        let shape = shape(2, form);
        let learner = LnnLearner {
            shape: &shape,
            loss,
            weights: &weights[..2],
            forces: forces(ForceTerms::friction(), 2),
            nominal: Some(&robot),
            phase: false,
        };
        let error = gradient_error(&learner, loss, &samples(2, 37));
        assert!(error < 1e-7, "lnn {form:?} {loss:?}: {error:e}");
        assert_step_solves(&learner, loss, &samples(2, 21));
    }
}

#[test]
fn the_gradient_of_a_plain_network_agrees_with_differences() {
    let config = MlpConfig {
        width: 16,
        forced: true,
        ..Default::default()
    };
    let scaling = MlpScaling {
        inputs: Scaling::identity(3),
        qdd: vec![2.0; 3],
        tau: vec![0.5; 3],
    };
    let shape = MlpShape::new(Coordinates::angles(3), config, scaling).unwrap();
    let learner = MlpLearner {
        shape: &shape,
        loss: Loss::ACCELERATION,
        weights: &[0.8; 3],
        forces: forces(ForceTerms::default(), 3),
        nominal: None,
        phase: false,
    };
    let error = gradient_error(&learner, Loss::ACCELERATION, &samples(3, 37));
    assert!(error < 1e-7, "{error:e}");
}

/// Without momentum, one step of rate 1 is −Jᵀ (J Jᵀ + λ N)⁻¹ r; the residuals after a short step must change by
/// −rate · K (K + λ N)⁻¹ r, which for small damping is −rate · r.
pub(crate) fn assert_step_solves(learner: &dyn Learner<f64>, loss: Loss, samples: &Samples) {
    let mut parameters = parameters(learner);
    let numbers: Vec<usize> = (0..samples.len()).collect();
    let batch = Batch {
        samples,
        indices: &numbers,
    };
    let mut natural = Natural::new(parameters.len());
    let mut memory = NetworkMemory::new(learner, numbers.len());
    let mut problem = memory.problem(learner, loss, batch);
    let config = NaturalConfig {
        momentum: 0.0,
        longest: 1e9,
        ..Default::default()
    };
    let rate = 1e-5;
    let size = StepSize {
        rate,
        damping: 1e-12,
    };
    let before = natural.step(&mut problem, &config, size, &mut parameters);
    let before = before.mean();
    let after = problem.residuals(&parameters).loss.mean();
    let found = (after / before).ln() / (-2.0 * rate);
    assert!((found - 1.0).abs() < 2e-3, "{loss:?}: {found}");
}

#[test]
fn a_natural_step_shrinks_every_residual_by_its_rate() {
    for form in [Form::Free, Form::Convex] {
        for loss in [Loss::ACCELERATION, Loss::TORQUE] {
            let shape = shape(2, form);
            let weights = [0.8, 1.2];
            let learner = LnnLearner {
                nominal: None,
                phase: false,
                shape: &shape,
                loss,
                weights: &weights,
                forces: forces(ForceTerms::friction(), 2),
            };
            assert_step_solves(&learner, loss, &samples(2, 21));
        }
    }
    let config = MlpConfig {
        width: 16,
        forced: true,
        ..Default::default()
    };
    let scaling = MlpScaling {
        inputs: Scaling::identity(3),
        qdd: vec![2.0; 3],
        tau: vec![0.5; 3],
    };
    let shape = MlpShape::new(Coordinates::angles(3), config, scaling).unwrap();
    let learner = MlpLearner {
        shape: &shape,
        loss: Loss::ACCELERATION,
        weights: &[0.8; 3],
        forces: forces(ForceTerms::default(), 3),
        nominal: None,
        phase: false,
    };
    assert_step_solves(&learner, Loss::ACCELERATION, &samples(3, 21));
}

#[test]
fn a_checkpoint_that_contradicts_itself_is_refused() {
    let good = super::Checkpoint {
        step: 10,
        best: 0.5,
        best_step: 5,
        best_parameters: vec![1.0],
        ..super::Checkpoint::fresh(vec![0.0], 1)
    };
    assert!(good.clone().for_run(1, 1).is_ok());
    let later = super::Checkpoint {
        best_step: 11,
        ..good.clone()
    };
    let no_loss = super::Checkpoint {
        best: f64::NAN,
        ..good.clone()
    };
    let no_clock = super::Checkpoint {
        seconds: f64::NAN,
        ..good
    };
    for bad in [later, no_loss, no_clock] {
        assert!(bad.for_run(1, 1).is_err());
    }
}

#[test]
pub(crate) fn samples_without_an_acceleration_do_not_lower_the_loss() {
    let shape = shape(1, Form::Free);
    let weights = [1.0];
    let learner = LnnLearner {
        nominal: None,
        phase: false,
        shape: &shape,
        loss: Loss::ACCELERATION,
        weights: &weights,
        forces: forces(ForceTerms::default(), 1),
    };
    let learner: &dyn Learner<f64> = &learner;
    let samples = samples(1, 20);
    let numbers: Vec<usize> = (0..20).collect();
    let broken = vec![1e300; learner.parameters()];
    let mut batches = Batches::new(learner, 20);
    let value = batches.evaluate(
        learner,
        Loss::ACCELERATION,
        &broken,
        Batch {
            samples: &samples,
            indices: &numbers,
        },
        None,
    );
    assert_eq!((value.count, value.singular), (0, 20));
    assert!(value.mean().is_nan(), "no sample, no loss");
}
