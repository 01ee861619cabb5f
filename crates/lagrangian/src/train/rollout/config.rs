//! The settings of the rollout loss.

use serde::{Deserialize, Serialize};

use super::step::evaluations;
use crate::dataset::Dataset;
use crate::train::{Loss, Optimizer};
use lagrangian_mechanics::integrate::Method;
use lagrangian_motion::{Error, Result};

/// The part of a rollout that is compared with the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Observe {
    /// Positions and velocities.
    #[default]
    States,
    /// Positions alone, for recordings whose velocities are estimates.
    Positions,
}

/// The initial state of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// The recorded state.
    #[default]
    Recorded,
    /// A state near the recorded one that is learned with the weights, for noisy data.
    Free,
}

/// The settings of the rollout loss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RolloutLoss {
    /// The number k of samples that are predicted from each start.
    pub horizon: usize,
    /// The integrator: rk4, stormer-verlet or implicit-midpoint.
    pub integrator: Method,
    /// The number of its steps from one sample to the next.
    pub substeps: usize,
    /// The part of a rollout that is compared with the recording.
    pub observe: Observe,
    /// The initial states of segments.
    #[serde(alias = "starts")]
    pub start: Start,
    /// The part of the budget in which the horizon grows from 1 to k; 0 for a horizon of k from the start.
    pub growth: f64,
    /// The part of the budget in which known accelerations are fitted first; 0 to skip that fit.
    pub warm_start: f64,
}

impl Default for RolloutLoss {
    fn default() -> Self {
        Self {
            horizon: 5,
            integrator: Method::Rk4,
            substeps: 1,
            observe: Observe::default(),
            start: Start::default(),
            growth: 0.5,
            warm_start: 0.0,
        }
    }
}

/// The largest number of evaluations in one segment.
const MOST_EVALUATIONS: usize = 4096;

/// The largest number of accelerations in the smallest batch under the natural gradient.
const MOST_ROWS: usize = 8192;

impl RolloutLoss {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The number of evaluations of f in one segment of `horizon` samples.
    pub(super) fn evaluations(&self, horizon: usize) -> usize {
        horizon
            .saturating_mul(self.substeps)
            .saturating_mul(evaluations(self.integrator))
    }

    /// Checks the settings against the data.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self, dataset: &Dataset, optimizer: &Optimizer) -> Result<()> {
        rollouts_exist(dataset)?;
        self.validate_integrator()?;
        self.validate_schedule()?;
        self.validate_horizon(dataset)?;
        self.validate_cost(dataset.coordinates.dof(), optimizer)
    }

    fn validate_integrator(&self) -> Result<()> {
        if self.substeps == 0 {
            return refuse("substeps", "0", "at least 1");
        }
        if self.substeps > MOST_EVALUATIONS {
            let must = "at most 4096: take fewer `substeps`";
            return refuse("substeps", self.substeps.to_string(), must);
        }
        match self.integrator {
            Method::Rk4 | Method::StormerVerlet | Method::ImplicitMidpoint => Ok(()),
            other => {
                let must = "rk4, stormer-verlet or implicit-midpoint";
                refuse("integrator", other.name(), must)
            }
        }
    }

    fn validate_schedule(&self) -> Result<()> {
        for (name, part) in [("growth", self.growth), ("warm_start", self.warm_start)] {
            if !(0.0..=0.9).contains(&part) {
                return refuse(name, part.to_string(), "a part of the budget, 0 to 0.9");
            }
        }
        Ok(())
    }

    /// Checks that the horizon fits into the longest trajectory of each part of the data.
    fn validate_horizon(&self, dataset: &Dataset) -> Result<()> {
        if self.horizon == 0 {
            return refuse("horizon", "0", "at least 1");
        }
        let value = |longest| format!("{} where the longest has {longest} samples", self.horizon);
        let longest = dataset.train_times.longest();
        if self.horizon >= longest {
            let must = "shorter than the longest trajectory: take a smaller `horizon`";
            return refuse("horizon", value(longest), must);
        }
        let longest = dataset.validation_times.longest();
        if longest > 0 && self.horizon >= longest {
            let must = "shorter than the longest trajectory of the validation set: take a smaller `horizon` or a larger \
                        `validate_fraction`";
            return refuse("horizon", value(longest), must);
        }
        Ok(())
    }

    /// Checks that memory and time of a batch stay bounded.
    fn validate_cost(&self, dof: usize, optimizer: &Optimizer) -> Result<()> {
        let evaluations = self.evaluations(self.horizon);
        if evaluations > MOST_EVALUATIONS {
            let value = format!("{} ({evaluations} evaluations in a segment)", self.horizon);
            let must =
                "such that there are at most 4096: take a smaller `horizon` or fewer `substeps`";
            return refuse("horizon", value, must);
        }
        let rows = evaluations * SEGMENTS * dof;
        if matches!(optimizer, Optimizer::Natural(_)) && rows > MOST_ROWS {
            let value = format!("{} ({rows} accelerations in a batch)", self.horizon);
            let must = "such that there are at most 8192 under the natural gradient: take a smaller `horizon`, \
                        `integrator` implicit-midpoint, or `optimizer` adam";
            return refuse("horizon", value, must);
        }
        Ok(())
    }
}

/// Checks that samples have times, and that no coordinate is a parameter.
fn rollouts_exist(dataset: &Dataset) -> Result<()> {
    if dataset.train_times.longest() == 0 {
        let must = "with data from trajectories: these samples have no times";
        return refuse("loss", Loss::ROLLOUT.name(), must);
    }
    if dataset.coordinates.parameters().next().is_some() {
        let must =
            "acceleration or torque where a coordinate is a parameter: a rollout does not hold it";
        return refuse("loss", Loss::ROLLOUT.name(), must);
    }
    Ok(())
}

fn refuse(name: &'static str, value: impl Into<String>, must: &'static str) -> Result<()> {
    let value = value.into();
    Err(Error::Argument { name, value, must })
}

/// The number of segments of a block, which is the smallest of a batch.
pub(super) const SEGMENTS: usize = 8;
