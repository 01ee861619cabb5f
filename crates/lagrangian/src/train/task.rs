//! The task of a fit: its loss, its optimiser, its length.

use serde::{Deserialize, Serialize};

use super::adam::AdamConfig;
use super::forces::ForceTerms;
use super::loss::Loss;
use super::natural::NaturalConfig;
use super::rollout::RolloutLoss;
use crate::dataset::Dataset;
use lagrangian_mechanics::rigid::{RigidBodies, RobotConfig};
use lagrangian_motion::{Error, Result};

/// The optimiser of the weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Optimizer {
    /// The natural gradient in the space of samples, for batches of up to some thousands of residuals.
    Natural(NaturalConfig),
    /// Adam with decoupled weight decay, for the largest networks and batches.
    Adam(AdamConfig),
}

impl Default for Optimizer {
    fn default() -> Self {
        Self::Natural(NaturalConfig::default())
    }
}

/// The default weight of the accelerations after a fit of torques.
pub(crate) const FORWARD: f64 = 1.5e-4;

/// The length of a run, which the schedules follow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After this number of steps; the same seed gives the same bits.
    Steps(usize),
    /// After this number of seconds; the result depends on the machine and is not reproducible to the bit.
    Seconds(f64),
}

/// The task of a fit beside its family of models: the loss, the optimiser, the length of the run, and the forces that are learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingTask {
    /// The loss that is minimised.
    pub loss: Loss,
    /// The settings of the rollout loss, for a fit under it.
    #[serde(skip_serializing_if = "RolloutLoss::is_default")]
    pub rollout: RolloutLoss,
    /// The optimiser.
    pub optimizer: Optimizer,
    /// The length of the fit.
    pub budget: Budget,
    /// The number of samples of a step.
    pub batch: usize,
    /// The number of samples of the first step, which grows geometrically to `batch` with the part of the budget that is
    /// used; `None` for `batch` samples in all steps. Small batches are better at first (ADR 0050).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batch_first: Option<usize>,
    /// The seed of weights and batches.
    pub seed: u64,
    /// The forces that are learned beside the Lagrangian; of a chain of rigid links only friction is identified.
    pub forces: ForceTerms,
    /// The nominal model. A Lagrangian network then learns the forces that its description omits (theory.md, 48), and the losses are
    /// in units of those. `DeLaN` can only add inertia to the nominal model, a free network can also remove some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<RobotConfig>,
    /// The weight λ of the accelerations after a fit of torques: inertia is added to the drives where it lowers
    /// Σ nMSE(τ) + λ Σ nMSE(q̈). 0 adds none.
    pub forward: f64,
    /// The number of steps between two validations.
    pub validate_every: usize,
    /// The number of validations without improvement after which the run stops; `None` for no such end.
    pub patience: Option<usize>,
}

impl Default for TrainingTask {
    fn default() -> Self {
        Self {
            loss: Loss::default(),
            rollout: RolloutLoss::default(),
            optimizer: Optimizer::default(),
            budget: Budget::Steps(1000),
            batch: 256,
            batch_first: None,
            seed: 0,
            forces: ForceTerms::default(),
            nominal: None,
            forward: FORWARD,
            validate_every: 25,
            patience: None,
        }
    }
}

impl TrainingTask {
    /// The nominal model in the coordinates of the data.
    pub(crate) fn nominal(&self, dataset: &Dataset) -> Result<Option<RigidBodies>> {
        let robot = self.nominal.as_ref();
        robot.map(|r| r.bodies(&dataset.coordinates)).transpose()
    }
}

impl Budget {
    /// Refuses an empty budget, and an interval of 0 between validations.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first of them.
    pub fn check(self, validate_every: usize) -> Result<()> {
        if validate_every == 0 {
            return Err(Error::argument("validate_every", "0", "at least 1"));
        }
        match self {
            Self::Steps(0) => Err(Error::argument("steps", "0", "at least 1")),
            Self::Seconds(s) if !(s.is_finite() && s > 0.0) => Err(Error::argument(
                "seconds",
                s.to_string(),
                "finite and positive",
            )),
            _ => Ok(()),
        }
    }
}
