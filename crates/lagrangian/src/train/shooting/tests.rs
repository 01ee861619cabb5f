#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::Shooting;
use super::normal::Normal;
use super::problem::Problem;
use crate::fit::{FitConfig, refine};
use crate::models::delan::DelanConfig;
use crate::models::hnn::HnnConfig;
use crate::models::lnn::LnnConfig;
use crate::models::{Family, Residuals};
use crate::train::rollout::tests::dataset;
use crate::train::{ForceTerms, TrainingTask};

fn families() -> Vec<Box<dyn Family>> {
    vec![
        Box::new(DelanConfig {
            width: 6,
            ..DelanConfig::default()
        }),
        Box::new(LnnConfig {
            width: 6,
            ..LnnConfig::default()
        }),
        Box::new(HnnConfig {
            width: 6,
            ..HnnConfig::default()
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

#[test]
fn the_reduced_gradient_is_that_of_the_best_starts() {
    let data = dataset();
    for family in families() {
        let config = config(family);
        let model = config.trainable(&data).unwrap();
        let learner = model.learner(Residuals::OfRates);
        let settings = Shooting {
            substeps: 2,
            ..Shooting::default()
        };
        let noise = [0.1, 0.2];
        let problem = Problem::new(
            &*learner,
            (&data, config.family.momenta()),
            &noise,
            &settings,
        );
        let theta = model.initialise(3);
        // χ² over the starts is least where its gradient by the parameters is the reduced one.
        let best = |theta: &[f64]| {
            let mut segments = problem.segments(theta, 7, &problem.recorded_states());
            let values = (0..30).map(|_| problem.improve_starts(theta, &mut segments));
            (values.last().unwrap(), segments)
        };
        let (_, segments) = best(&theta);
        let normal = Normal::of(&problem, &theta, &segments).unwrap();
        let size = normal.right.iter().map(|g| g * g).sum::<f64>().sqrt();
        let along: Vec<f64> = normal.right.iter().map(|g| g / size).collect();
        let moved = |step: f64| -> Vec<f64> {
            theta
                .iter()
                .zip(&along)
                .map(|(x, a)| x + step * a)
                .collect()
        };
        let found = (best(&moved(1e-5)).0 - best(&moved(-1e-5)).0) / 4e-5;
        assert!(
            (found - size).abs() < 1e-5 * size,
            "{}: {found} {size}",
            config.family.name()
        );
    }
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
    assert!(one.misfit.is_finite() && one.fit.steps > 0);
    assert_ne!(one.parameters, theta);
}

#[test]
fn a_chaotic_stretch_is_halved() {
    let data = dataset();
    let config = config(families().remove(0));
    let model = config.trainable(&data).unwrap();
    let learner = model.learner(Residuals::OfRates);
    let count = |amplification: f64| {
        let settings = Shooting {
            amplification,
            ..Shooting::default()
        };
        let problem = Problem::new(&*learner, (&data, None), &[1.0, 1.0], &settings);
        problem
            .segments(&model.initialise(1), 14, &problem.recorded_states())
            .len()
    };
    assert_eq!(2 * count(1e9), count(0.5));
}
