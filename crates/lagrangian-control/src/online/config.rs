//! Settings of an online learner.

use serde::{Deserialize, Serialize};

use super::ReplayConfig;
use lagrangian::models::Family;
use lagrangian::train::{DataFacts, ForceTerms, NaturalConfig};
use lagrangian::{DelanConfig, Error, FitConfig, FitSpec, Loss, Optimizer, Result, TrainingTask};

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
    /// Learning rate, which begins again after old samples were discarded; a slow learner averages out noise.
    pub rate: Falling,
    /// Damping.
    pub damping: Falling,
    /// Number of samples before the first step, which set the scales.
    pub warm_up: usize,
    /// Length of the window over which accelerations are estimated, ticks; a robot of known kinematics has 10.
    pub window: usize,
    /// Memory of samples.
    pub replay: ReplayConfig,
    /// The changes of the robot after which old samples of a network are discarded.
    pub change: ChangeConfig,
    /// The first model is handed over once its loss on new samples is below this, in units of the mean square of the
    /// first torques: a wrong feed-forward is worse than no feed-forward. After that, every model that passes the guard is handed over.
    pub first_model_loss: f64,
    /// Seed of weights and batches.
    pub seed: u64,
}

/// A setting that falls from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Falling {
    /// Value of the first step.
    pub first: f64,
    /// Factor from step to step.
    pub decay: f64,
    /// Minimum value.
    pub last: f64,
}

impl Falling {
    /// The value after this one.
    pub(crate) fn after(&self, value: f64) -> f64 {
        (value * self.decay).max(self.last)
    }
}

/// Detection of changes of the robot, which contradict old samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChangeConfig {
    /// Old samples are discarded when the loss of the newest samples exceeds its usual value by this factor.
    pub factor: f64,
    /// They are discarded only if that loss also exceeds this, in units of the mean square of the first torques: a new
    /// region is learned in addition to the old ones, while a new load contradicts them.
    pub threshold: f64,
    /// Number of newest samples whose loss is compared, and which are kept.
    pub samples: usize,
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
            rate: Falling {
                first: 0.2,
                decay: 0.999,
                last: 0.05,
            },
            damping: Falling {
                first: 1e-1,
                decay: 0.99,
                last: 1e-3,
            },
            warm_up: 500,
            window: 40,
            replay: ReplayConfig::default(),
            change: ChangeConfig {
                factor: 300.0,
                threshold: 0.03,
                samples: 32,
            },
            first_model_loss: 0.1,
            seed: 0,
        }
    }
}

impl OnlineConfig {
    /// The usual settings for the family of a request, and its friction.
    ///
    /// # Errors
    /// As [`FitSpec::choose`].
    pub fn chosen(request: &FitSpec, seed: u64) -> Result<Self> {
        let chosen = request.choose(&DataFacts::default())?.config;
        Ok(Self {
            forces: chosen.training.forces,
            family: chosen.family,
            seed,
            ..Self::default()
        })
    }

    /// Checks the settings that [`Differentiator::new`](super::Differentiator::new), [`Replay::new`](super::Replay::new)
    /// and [`Stepper::new`](lagrangian::fit::Stepper::new) do not check.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let positive = [
            ("rate.first", self.rate.first),
            ("rate.last", self.rate.last),
            ("damping.first", self.damping.first),
            ("damping.last", self.damping.last),
            ("change.factor", self.change.factor),
            ("change.threshold", self.change.threshold),
            ("first_model_loss", self.first_model_loss),
        ];
        if let Some((name, x)) = positive.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return Err(Error::argument(name, x, "finite and above 0"));
        }
        for (name, Falling { decay, .. }) in
            [("rate.decay", self.rate), ("damping.decay", self.damping)]
        {
            if !(decay > 0.0 && decay <= 1.0) {
                return Err(Error::argument(name, decay, "above 0, at most 1"));
            }
        }
        if !(1..=1 << 20).contains(&self.warm_up) {
            return Err(Error::argument(
                "warm_up",
                self.warm_up,
                "between 1 and 1048576",
            ));
        }
        let samples = self.change.samples;
        if samples == 0 || samples > self.batch {
            return Err(Error::argument(
                "change.samples",
                samples,
                "at least 1, at most a batch",
            ));
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
