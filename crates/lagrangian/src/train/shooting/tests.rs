#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use super::Shooting;
use super::normal::Normal;
use super::path::Course;
use super::problem::Problem;
use crate::fit::{FitConfig, refine};
use crate::models::delan::DelanConfig;
use crate::models::lnn::{Form, LnnConfig};
use crate::models::mlp::MlpConfig;
use crate::models::neural_ode::{NeuralOdeConfig, Order};
use crate::models::{Family, Residuals};
use crate::train::observer::{Ending, Observer, Progress};
use crate::train::rollout::Recorded;
use crate::train::rollout::tests::dataset;
use crate::train::{ForceTerms, TrainingTask};

fn families() -> Vec<Box<dyn Family>> {
    let lnn = |form, width| LnnConfig {
        form,
        width,
        ..LnnConfig::default()
    };
    vec![
        Box::new(DelanConfig {
            width: 6,
            ..DelanConfig::default()
        }),
        Box::new(lnn(Form::Free, 6)),
        Box::new(lnn(Form::Convex, 16)),
        Box::new(MlpConfig {
            width: 6,
            ..MlpConfig::default()
        }),
    ]
}

fn config(family: Box<dyn Family>) -> FitConfig {
    let forces = ForceTerms {
        viscous: true,
        ..ForceTerms::default()
    };
    FitConfig {
        family,
        training: TrainingTask {
            forces,
            ..TrainingTask::default()
        },
    }
}

/// Compares the reduced gradient of a family with central differences of χ² at the best starts, which is stationary in them.
fn agrees_with_differences(family: Box<dyn Family>, noise: &[f64], held: bool) {
    let data = dataset();
    let config = config(family);
    let model = config.trainable(&data).unwrap();
    let learner = model.learner(Residuals::OfRates);
    let mut problem = Problem::new(&*learner, Recorded::train(&data, None), noise);
    problem.course = Course { substeps: 2, held };
    let theta = model.initialise(3);
    let best = |theta: &[f64]| {
        let mut segments = problem.segments(theta, 7, &problem.recorded_states());
        let values = (0..300).map(|_| problem.improve_starts(theta, &mut segments));
        (values.last().unwrap(), segments)
    };
    let (_, segments) = best(&theta);
    let normal = Normal::of(&problem, &theta, &segments).unwrap();
    let size = normal.right.iter().map(|g| g * g).sum::<f64>().sqrt();
    let moved = |step: f64| -> Vec<f64> {
        let pairs = theta.iter().zip(&normal.right);
        pairs.map(|(x, g)| x + step * g / size).collect()
    };
    let found = (best(&moved(1e-5)).0 - best(&moved(-1e-5)).0) / 4e-5;
    let name = config.family.name();
    assert!((found - size).abs() < 1e-5 * size, "{name}: {found} {size}");
}

#[test]
fn the_gradient_from_positions_is_that_of_the_best_starts() {
    for family in families() {
        agrees_with_differences(family, &[0.1, 0.2], true);
    }
}

#[test]
fn the_gradient_from_positions_and_velocities_is_that_of_the_best_starts() {
    for family in families() {
        agrees_with_differences(family, &[0.1, 0.2, 0.4, 0.3], false);
    }
}

#[test]
fn a_family_of_first_order_is_not_refined() {
    let config = config(Box::new(NeuralOdeConfig {
        order: Order::First,
        ..NeuralOdeConfig::default()
    }));
    let data = dataset();
    let theta = config.trainable(&data).unwrap().initialise(1);
    let given = (&*theta, &[0.1, 0.1][..]);
    let refused = refine(&data, &config, given, &Shooting::default(), &mut ());
    assert!(refused.unwrap_err().to_string().contains("accelerations"));
}

#[test]
fn a_refinement_ends_when_its_observer_or_its_time_asks_for_it() {
    struct Ends;
    impl Observer for Ends {
        fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
            ControlFlow::Continue(())
        }
        fn stage(&mut self, what: &str, _: f64) -> ControlFlow<()> {
            assert_eq!(what, "refining by rollouts, horizon 15");
            ControlFlow::Break(())
        }
    }
    let data = dataset();
    let config = config(families().remove(0));
    let theta = config.trainable(&data).unwrap().initialise(1);
    let brief = Shooting {
        seconds: 0.0,
        ..Shooting::default()
    };
    let given = (&*theta, &[0.05, 0.05][..]);
    let interrupted = refine(&data, &config, given, &Shooting::default(), &mut Ends).unwrap();
    let timed = refine(&data, &config, given, &brief, &mut ()).unwrap();
    assert_eq!(interrupted.ending, Ending::Interrupted);
    assert_eq!(timed.ending, Ending::Finished);
    assert_eq!(interrupted.parameters, theta);
    assert_eq!(timed.parameters, theta);
}

#[test]
fn a_refinement_lowers_the_misfit_to_the_same_bits_on_any_number_of_threads() {
    let data = dataset();
    let config = config(families().remove(0));
    let theta = config.trainable(&data).unwrap().initialise(1);
    let settings = Shooting {
        horizons: vec![5, 14],
        steps: 3,
        ..Shooting::default()
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            refine(&data, &config, (&theta, &[0.05, 0.05]), &settings, &mut ()).unwrap()
        })
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.parameters, three.parameters);
    assert!(one.best.is_finite() && one.steps > 0);
    assert_ne!(one.parameters, theta);
}

#[test]
fn a_chaotic_stretch_is_halved() {
    let data = dataset();
    let config = config(families().remove(0));
    let model = config.trainable(&data).unwrap();
    let learner = model.learner(Residuals::OfRates);
    let count = |noise: f64| {
        let noise = [noise; 2];
        let problem = Problem::new(&*learner, Recorded::train(&data, None), &noise);
        let theta = model.initialise(1);
        problem
            .segments(&theta, 14, &problem.recorded_states())
            .len()
    };
    assert_eq!(2 * count(1e-9), count(10.0));
}
