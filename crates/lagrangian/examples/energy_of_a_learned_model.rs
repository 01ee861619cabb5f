//! Does a learned Lagrangian keep the energy where a plain network, fitted to the same data, loses it?
//!
//! `cargo run --release -p lagrangian --example energy_of_a_learned_model`

use lagrangian::dataset::{random_starts, random_states};
use lagrangian::models::{Family, MlpConfig};
use lagrangian::rollout::{energy_test, free, rollout_many, times};
use lagrangian::{
    Budget, FitConfig, LnnConfig, Result, RolloutOptions, TrainingTask, analytic, fit,
};

fn main() -> Result<()> {
    let system = analytic::by_name("double-pendulum", &[])?;
    let data = random_states(&*system, 20_000, 1_000, 0)?;
    let starts = random_starts(&*system, 8, 1);
    let options = RolloutOptions {
        rtol: 1e-9,
        atol: 1e-9,
        ..RolloutOptions::default()
    };
    for family in [
        Box::<dyn Family>::from(LnnConfig::default()),
        Box::<dyn Family>::from(MlpConfig::default()),
    ] {
        let name = family.name();
        let config = FitConfig {
            family,
            training: TrainingTask {
                budget: Budget::Steps(100),
                ..TrainingTask::default()
            },
        };
        let fitted = fit(&data, &config, None, &mut ())?;
        let rollouts = rollout_many(&fitted.model, &starts, &times(20.0, 0.1)?, &free, &options)?;
        let energy = energy_test(&*system, &rollouts, 29.4);
        println!(
            "{name}: energy error after 20 s {:.4} % (mean of {} starts, worst {:.4} %), {:.0} s of training",
            energy.mean,
            starts.len(),
            energy.worst,
            fitted.seconds
        );
    }
    Ok(())
}
