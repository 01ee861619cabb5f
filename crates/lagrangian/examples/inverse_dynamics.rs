//! Which torque makes a system move as I want? The inverse dynamics of a Lagrangian learned from driven motions.
//!
//! `cargo run --release -p lagrangian --example inverse_dynamics`

use std::f64::consts::FRAC_PI_2;

use lagrangian::mechanics::{Dissipation, Mechanical, Quantities};
use lagrangian::rollout::times;
use lagrangian::train::ForceTerms;
use lagrangian::{
    Budget, Dataset, FitConfig, LnnConfig, Loss, Model, Result, RolloutOptions, TrainingTask,
    analytic, fit, rollout,
};

fn main() -> Result<()> {
    // A pendulum with viscous friction, driven by two tones at each of six frequencies.
    let pendulum = analytic::by_name("pendulum", &[("mass", 0.7), ("length", 0.5)])?;
    let truth = Mechanical::dissipative(pendulum.lagrangian(), Dissipation::viscous(vec![0.05]))?;
    let mut motions = Vec::new();
    for k in 1..=6 {
        let w = 0.7 * f64::from(k);
        let drive = move |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
            tau[0] = 2.5 * (w * t).sin() + 1.5 * (2.3 * w * t).cos();
        };
        let (times, options) = (times(8.0, 0.02)?, RolloutOptions::default());
        motions.push(rollout(&truth, &[0.0], &[0.0], &times, &drive, &options)?.trajectory);
    }
    let data = Dataset::new(truth.coordinates().clone(), &motions[..5], &motions[5..])?;

    let config = FitConfig {
        family: Box::new(LnnConfig {
            width: 32,
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            loss: Loss::TORQUE,
            forces: ForceTerms::friction(),
            budget: Budget::Steps(400),
            batch: 128,
            ..TrainingTask::default()
        },
    };
    let learned = fit(&data, &config, None, &mut ())?.model;

    // Swing up along q(t) = π sin²(πt/4): the torque at half the way, when it is fastest.
    let (q, qd, qdd) = ([FRAC_PI_2], [FRAC_PI_2.powi(2)], [0.0]);
    for (name, model) in [("true", &truth as &dyn Model), ("learned", &learned)] {
        let tau = model.inverse_dynamics(&q, &qd, &qdd)?;
        println!("{name} torque: {:.4} N·m", tau[0]);
    }
    Ok(())
}
