//! The choices of the training: optimiser, damping, batch and budget.

use serde_json::Value;

use super::DataFacts;
use crate::fit::SECONDS;
use crate::fit::settings::{DampingName, OptimizerName, TrainingSettings};
use crate::train::adam::AdamConfig;
use crate::train::loss::Loss;
use crate::train::natural::NaturalConfig;
use crate::train::spec::AutoSetting;
use crate::train::task::{Budget, Optimizer};
use lagrangian_motion::{Error, Result};

/// The longest step of weights whose products of four are the terms of a polynomial: with 1 one in three free Lagrangians of known laws
/// began with a mass matrix that changes its sign, and stayed there; with 0.2 one in sixty (ADR 0133).
const LONGEST_OF_POLYNOMIALS: f64 = 0.2;

/// The rows of a batch of the natural gradient: a step takes some 0.1 s for so many, and eight times as long for twice as many.
const MOST_ROWS: usize = 2048;

/// The choices of the training up to now, and the facts that further ones depend on.
pub(super) struct TrainingChoices {
    pub(super) asked: TrainingSettings,
    pub(super) loss: Loss,
    /// Whether the length of the fit is a time, not a number of steps.
    pub(super) timed: bool,
    pub(super) known: DataFacts,
    /// Whether the network is a polynomial.
    pub(super) polynomial: bool,
    pub(super) choices: Vec<AutoSetting>,
}

impl TrainingChoices {
    fn choose(&mut self, setting: &str, value: impl Into<Value>, reason: impl Into<String>) {
        self.choices.push(AutoSetting::new(setting, value, reason));
    }

    /// The optimiser. The natural gradient solves each batch with its noise, while Adam averages over many batches; the noise
    /// of states harms a rollout less than that of accelerations harms a balance (ADR 0042).
    pub(super) fn optimizer(&mut self) -> OptimizerName {
        if let Some(name) = self.asked.optimizer {
            return name;
        }
        if self.known.noisy() && self.loss != Loss::ROLLOUT {
            let reason = format!(
                "{}: Adam instead of the natural gradient, which would follow the noise",
                self.known.certainty()
            );
            self.choose("optimizer", "adam", reason);
            return OptimizerName::Adam;
        }
        let reason = "it is the fastest where noise does not dominate";
        self.choose("optimizer", "natural", reason);
        OptimizerName::Natural
    }

    /// Whether small batches with a damping that follows the loss are best, as for fits by time; fits by steps are best with
    /// large batches (ADR 0050).
    fn follows_the_loss(&self) -> bool {
        self.timed && self.loss != Loss::ROLLOUT
    }

    /// The optimiser of this name with its settings.
    pub(super) fn configured(&mut self, name: OptimizerName) -> Result<Optimizer> {
        match name {
            OptimizerName::Natural => {
                let default = match self.damping()? {
                    DampingName::Schedule => NaturalConfig::default(),
                    DampingName::Loss => NaturalConfig::following_the_loss(),
                    DampingName::Adaptive => NaturalConfig::adaptive(),
                };
                let rate = self.asked.learning_rate.unwrap_or(default.rate);
                let longest = match self.polynomial {
                    true => LONGEST_OF_POLYNOMIALS,
                    false => default.longest,
                };
                Ok(Optimizer::Natural(NaturalConfig {
                    rate,
                    longest,
                    ..default
                }))
            }
            OptimizerName::Adam => {
                let default = AdamConfig::default();
                Ok(Optimizer::Adam(AdamConfig {
                    rate: self.asked.learning_rate.unwrap_or(default.rate),
                    decay: self.asked.weight_decay.unwrap_or(default.decay),
                    ..default
                }))
            }
        }
    }

    fn damping(&mut self) -> Result<DampingName> {
        match self.asked.damping {
            Some(name) if self.loss == Loss::ROLLOUT && name != DampingName::Schedule => {
                Err(Error::setting(
                    "under the loss rollout the damping follows a schedule",
                    "omit `damping`, or choose another `loss`",
                ))
            }
            Some(name) => Ok(name),
            None if self.follows_the_loss() => {
                let reason =
                    "a fit with a time to use ends lowest where the damping falls with the loss";
                self.choose("damping", "loss", reason);
                Ok(DampingName::Loss)
            }
            None => {
                let reason = "a number of steps, or a loss of rollouts, is used best by a schedule";
                self.choose("damping", "schedule", reason);
                Ok(DampingName::Schedule)
            }
        }
    }

    /// The number of samples of a step.
    pub(super) fn batch(&mut self, optimizer: OptimizerName) -> usize {
        if let Some(batch) = self.asked.batch {
            return batch;
        }
        let (batch, reason) = match optimizer {
            OptimizerName::Natural if self.follows_the_loss() => (
                128,
                "small batches end lowest where a fit has a time to use",
            ),
            OptimizerName::Natural => match MOST_ROWS / self.known.dof.max(1) {
                large if large >= 256 => (256, "large batches use a number of steps best"),
                fewer => (
                    fewer.max(32),
                    "larger ones have more rows, one for each coordinate, than a step solves in a moment",
                ),
            },
            OptimizerName::Adam => (512, "Adam averages the noise over the samples of a batch"),
        };
        self.choose("batch", batch, reason);
        batch
    }

    /// The length of the fit.
    pub(super) fn budget(&mut self, given: Option<Budget>) -> Budget {
        given.unwrap_or_else(|| {
            self.choose("seconds", SECONDS, "neither steps nor seconds were given");
            Budget::Seconds(SECONDS)
        })
    }
}
