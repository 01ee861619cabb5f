//! Learning a Lagrangian from motions, and the accuracy of the result.
//!
//! `cargo run --release -p lagrangian --example fit_pendulum`

use std::f64::consts::TAU;

use lagrangian::TrainingTask;
use lagrangian::rollout::{free, times};
use lagrangian::{
    Budget, Dataset, FitConfig, Result, RolloutOptions, analytic, fit, rollout, score, split,
};

fn main() -> Result<()> {
    // Ten motions of four seconds, fifty samples a second, of a pendulum of half a metre.
    let pendulum = analytic::by_name("pendulum", &[("length", 0.5)])?;
    let options = RolloutOptions::default();
    let clock = times(4.0, 0.02)?;
    let mut motions = Vec::new();
    for k in 0..10 {
        let (q0, qd0) = ([0.3 * f64::from(k)], [f64::from(k)]);
        motions.push(rollout(&*pendulum, &q0, &qd0, &clock, &free, &options)?.trajectory);
    }
    let (train, validation) = split(motions, 0.2, 0)?;
    let data = Dataset::new(pendulum.coordinates().clone(), &train, &validation)?;

    let config = FitConfig {
        training: TrainingTask {
            budget: Budget::Steps(300),
            batch: 128,
            ..TrainingTask::default()
        },
        ..FitConfig::default()
    };
    let fitted = fit(&data, &config, None, &mut ())?;
    println!("fitted in {:.1} s", fitted.seconds);
    if let Some(error) = score(&fitted.model, &validation, &options)?.acceleration {
        println!("error of q̈: {:.0e} of its variance", error.nmse[0]);
    }

    // A small swing: its period is 2π √(l/g).
    let (start, clock) = ([0.02], times(10.0, 0.001)?);
    let swing = rollout(&fitted.model, &start, &[0.0], &clock, &free, &options)?.trajectory;
    let falls = |k: &usize| swing.q[k - 1] > 0.0 && swing.q[*k] <= 0.0;
    let passes: Vec<f64> = (1..swing.len()).filter(falls).map(|k| swing.t[k]).collect();
    let period = (passes[passes.len() - 1] - passes[0]) / (passes.len() - 1) as f64;
    let truth = TAU * f64::sqrt(0.5 / 9.8);
    println!("period of a small swing: {period:.4} s, of the true one {truth:.4} s");
    Ok(())
}
