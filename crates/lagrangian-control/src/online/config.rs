//! Settings of an online learner.

use serde::{Deserialize, Serialize};

use super::ReplayConfig;
use lagrangian::TrainingTask;
use lagrangian::train::NaturalConfig;
use lagrangian::{DelanConfig, Error, Family, FitConfig, ForceTerms, Loss, Optimizer, Result};

/// Settings of an online learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineConfig {
    /// The family of the model, which is fitted to torques.
    pub family: Box<dyn Family>,
    /// The friction and actuation that are learned beside the model.
    pub forces: ForceTerms,
    /// The number of samples of a step.
    pub batch: usize,
    /// The rate of the first step, and of the first step after old samples were discarded.
    pub rate: f64,
    /// The factor of the rate from step to step.
    pub rate_decay: f64,
    /// The smallest rate: a slow learner averages noise out.
    pub rate_last: f64,
    /// The damping of the first step.
    pub damping_first: f64,
    /// The factor of the damping from step to step.
    pub damping_decay: f64,
    /// The smallest damping.
    pub damping_last: f64,
    /// The number of samples before the first step: they set the scales.
    pub warm_up: usize,
    /// The length of the window over which accelerations are estimated, ticks.
    pub window: usize,
    /// The memory of samples.
    pub replay: ReplayConfig,
    /// Old samples are discarded where the loss of the newest samples exceeds its usual value by this factor.
    pub change_factor: f64,
    /// They are discarded only where that loss also exceeds this, in units of the mean square of the first torques: a new
    /// region is learned beside the old ones, while a new load contradicts them.
    pub change_threshold: f64,
    /// The number of newest samples whose loss is compared, and which are kept.
    pub change_samples: usize,
    /// The first model is handed over once its loss on new samples is below this, in units of the mean square of the
    /// first torques: a wrong feed-forward is worse than none. After that, every model that passes the guard is handed over.
    pub first_model_loss: f64,
    /// The seed of weights and batches.
    pub seed: u64,
}

impl Default for OnlineConfig {
    fn default() -> Self {
        Self {
            family: Box::new(DelanConfig {
                width: 24,
                ..DelanConfig::default()
            }),
            forces: ForceTerms::default(),
            batch: 64,
            rate: 0.2,
            rate_decay: 0.999,
            rate_last: 0.05,
            damping_first: 1e-1,
            damping_decay: 0.99,
            damping_last: 1e-3,
            warm_up: 500,
            window: 40,
            replay: ReplayConfig::default(),
            change_factor: 300.0,
            change_threshold: 0.03,
            change_samples: 32,
            first_model_loss: 0.1,
            seed: 0,
        }
    }
}

impl OnlineConfig {
    /// Checks the settings that [`Differentiator::new`](super::Differentiator::new), [`Replay::new`](super::Replay::new)
    /// and [`Stepper::new`](lagrangian::fit::Stepper::new) do not check.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let positive = [
            ("rate", self.rate),
            ("rate_last", self.rate_last),
            ("damping_first", self.damping_first),
            ("damping_last", self.damping_last),
            ("change_factor", self.change_factor),
            ("change_threshold", self.change_threshold),
            ("first_model_loss", self.first_model_loss),
        ];
        if let Some((name, x)) = positive.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return argument(name, x.to_string(), "finite and above 0");
        }
        if !(self.damping_decay > 0.0 && self.damping_decay <= 1.0) {
            return argument(
                "damping_decay",
                self.damping_decay.to_string(),
                "above 0, at most 1",
            );
        }
        if !(1..=1 << 20).contains(&self.warm_up) {
            return argument("warm_up", self.warm_up.to_string(), "between 1 and 1048576");
        }
        if self.change_samples == 0 || self.change_samples > self.batch {
            return argument(
                "change_samples",
                self.change_samples.to_string(),
                "at least 1, at most a batch",
            );
        }
        Ok(())
    }

    /// The settings of the fit.
    pub(crate) fn fit(&self) -> FitConfig {
        FitConfig {
            family: self.family.clone(),
            training: TrainingTask {
                loss: Loss::TORQUE,
                optimizer: Optimizer::Natural(NaturalConfig::default()),
                batch: self.batch,
                forces: self.forces,
                seed: self.seed,
                ..TrainingTask::default()
            },
        }
    }
}
