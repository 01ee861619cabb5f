//! Settings of an online learner.

use serde::{Deserialize, Serialize};

use super::ReplayConfig;
use lagrangian::models::Family;
use lagrangian::train::{ForceTerms, NaturalConfig};
use lagrangian::{DelanConfig, Error, FitConfig, Loss, Optimizer, Result, TrainingTask};

/// Settings of an online learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineConfig {
    /// Family of the model, which is fitted to torques.
    pub family: Box<dyn Family>,
    /// Friction and actuation that are learned together with the model.
    pub forces: ForceTerms,
    /// Number of samples of a step.
    pub batch: usize,
    /// Learning rate of the first step, and of the first step after old samples were discarded.
    pub rate: f64,
    /// Factor of the learning rate from step to step.
    pub rate_decay: f64,
    /// Minimum learning rate: a slow learner averages out noise.
    pub rate_last: f64,
    /// Damping of the first step.
    pub damping_first: f64,
    /// Factor of the damping from step to step.
    pub damping_decay: f64,
    /// Minimum damping.
    pub damping_last: f64,
    /// Number of samples before the first step, which set the scales.
    pub warm_up: usize,
    /// Length of the window over which accelerations are estimated, ticks.
    pub window: usize,
    /// Memory of samples.
    pub replay: ReplayConfig,
    /// Old samples are discarded when the loss of the newest samples exceeds its usual value by this factor.
    pub change_factor: f64,
    /// They are discarded only if that loss also exceeds this, in units of the mean square of the first torques: a new
    /// region is learned in addition to the old ones, while a new load contradicts them.
    pub change_threshold: f64,
    /// Number of newest samples whose loss is compared, and which are kept.
    pub change_samples: usize,
    /// The first model is handed over once its loss on new samples is below this, in units of the mean square of the
    /// first torques: a wrong feed-forward is worse than no feed-forward. After that, every model that passes the guard is handed over.
    pub first_model_loss: f64,
    /// Seed of weights and batches.
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

    /// Settings of the fit.
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
