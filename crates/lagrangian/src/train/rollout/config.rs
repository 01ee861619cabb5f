//! Settings of the rollout loss.

use serde::{Deserialize, Serialize};

use super::step::evaluations;
use crate::dataset::Dataset;
use crate::integrate::Method;
use crate::train::{Loss, Optimizer};
use crate::{Error, Result};

/// What of a rollout is compared with the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Observe {
    /// Positions and velocities.
    #[default]
    States,
    /// Positions alone: the velocities of the recording were estimated.
    Positions,
}

/// Where a segment starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// At the recorded state.
    #[default]
    Recorded,
    /// At a state that is learned with the weights, near the recorded one: for noisy data.
    Free,
}

/// How the gradient of a rollout is taken under Adam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gradients {
    /// Backwards through the steps: that of the computed loss, to rounding.
    #[default]
    BackPropagation,
    /// By the adjoint equation, integrated backwards: that of the exact flow, up to the error of the method.
    Adjoint,
}

/// Settings of the rollout loss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RolloutLoss {
    /// Samples that are predicted from each start, k.
    pub horizon: usize,
    /// The method: rk4, stormer-verlet or implicit-midpoint.
    pub integrator: Method,
    /// Its steps from one sample to the next.
    pub substeps: usize,
    /// What is compared.
    pub observe: Observe,
    /// Where segments start.
    #[serde(alias = "starts")]
    pub start: Start,
    /// Weight of the gap between the end of a segment and the start of the next, where starts are free (multiple
    /// shooting); 0: none.
    pub continuity: f64,
    /// Part of the budget in which the horizon grows from 1 to k; 0: at once.
    pub growth: f64,
    /// Part of the budget in which the accelerations are fitted first; 0: none. They must be known.
    pub warm_start: f64,
    /// How gradients are taken under Adam.
    pub gradients: Gradients,
}

impl Default for RolloutLoss {
    fn default() -> Self {
        Self {
            horizon: 5,
            integrator: Method::Rk4,
            substeps: 1,
            observe: Observe::default(),
            start: Start::default(),
            continuity: 0.0,
            growth: 0.5,
            warm_start: 0.0,
            gradients: Gradients::default(),
        }
    }
}

/// Evaluations of one segment at most.
const MOST_EVALUATIONS: usize = 4096;

impl RolloutLoss {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Evaluations of f in one segment of `horizon` samples.
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
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let longest = dataset.train_times.longest();
        if longest == 0 {
            let must = "with data from trajectories: these samples have no times";
            return argument("loss", Loss::ROLLOUT.name().into(), must);
        }
        if dataset.coordinates.parameters().next().is_some() {
            let must = "acceleration or torque where a coordinate is a parameter: a rollout does not hold it";
            return argument("loss", Loss::ROLLOUT.name().into(), must);
        }
        if self.horizon == 0 {
            return argument("horizon", "0".into(), "at least 1");
        }
        if self.horizon >= longest {
            let must = "shorter than the longest trajectory: take a smaller `horizon`";
            let value = format!("{} where the longest has {longest} samples", self.horizon);
            return argument("horizon", value, must);
        }
        if self.substeps == 0 {
            return argument("substeps", "0".into(), "at least 1");
        }
        if self.substeps > MOST_EVALUATIONS {
            let must = "at most 4096: take fewer `substeps`";
            return argument("substeps", self.substeps.to_string(), must);
        }
        if !matches!(
            self.integrator,
            Method::Rk4 | Method::StormerVerlet | Method::ImplicitMidpoint
        ) {
            let must = "rk4, stormer-verlet or implicit-midpoint";
            return argument("integrator", self.integrator.name().into(), must);
        }
        for (name, part) in [("growth", self.growth), ("warm_start", self.warm_start)] {
            if !(0.0..=0.9).contains(&part) {
                return argument(name, part.to_string(), "a part of the budget, 0 to 0.9");
            }
        }
        if !(self.continuity.is_finite() && self.continuity >= 0.0) {
            let value = self.continuity.to_string();
            return argument("continuity", value, "finite and not negative");
        }
        if self.continuity > 0.0 && self.start == Start::Recorded {
            let must =
                "0 where starts are recorded: only free starts can move together (`starts` free)";
            return argument("continuity", self.continuity.to_string(), must);
        }
        if self.gradients == Gradients::Adjoint && !matches!(optimizer, Optimizer::Adam(_)) {
            let must = "back-propagation under the natural gradient: the adjoint is for Adam";
            return argument("gradients", "adjoint".into(), must);
        }
        if self.gradients == Gradients::Adjoint && self.integrator != Method::Rk4 {
            let must = "back-propagation for this integrator: the adjoint is integrated by rk4";
            return argument("gradients", "adjoint".into(), must);
        }
        let held = dataset.validation_times.longest();
        if held > 0 && self.horizon >= held {
            let must = "shorter than the longest held-back trajectory: take a smaller `horizon`, or hold back more (`validate_fraction`)";
            let value = format!("{} where the longest has {held} samples", self.horizon);
            return argument("horizon", value, must);
        }
        if self.evaluations(self.horizon) > MOST_EVALUATIONS {
            let value = format!("{} evaluations a segment", self.evaluations(self.horizon));
            let must = "at most 4096: take a smaller `horizon` or fewer `substeps`";
            return argument("horizon", value, must);
        }
        let rows = self.evaluations(self.horizon) * SEGMENTS * dataset.coordinates.dof();
        if matches!(optimizer, Optimizer::Natural(_)) && rows > 8192 {
            let value = format!("{} ({rows} accelerations in a batch)", self.horizon);
            let must = "at most 8192 accelerations under the natural gradient: take a smaller `horizon`, `integrator` implicit-midpoint, or `optimizer` adam";
            return argument("horizon", value, must);
        }
        Ok(())
    }
}

/// Segments of a block: the least that a batch has.
pub(super) const SEGMENTS: usize = 8;
