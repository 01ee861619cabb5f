//! The flags of `lagrangian fit --loss rollout`.

use anyhow::Result;
use clap::{Args, ValueEnum};
use lagrangian::integrate::Method;
use lagrangian::train::{self, Observe, RolloutLoss, Start};
use serde::{Deserialize, Serialize};

use crate::failure::mistake;
use crate::values::fraction;

#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Rollout loss")]
pub(crate) struct RolloutArgs {
    /// Samples that are predicted from each start [default: 5]
    #[arg(long, value_name = "SAMPLES", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) horizon: Option<u32>,

    /// Method that a model is trained through [default: rk4]
    #[arg(long, value_enum)]
    pub(crate) integrator: Option<StepName>,

    /// Its steps from one sample to the next [default: 1]
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) substeps: Option<u32>,

    /// What of a rollout is compared with the data [default: states]
    #[arg(long, value_enum)]
    pub(crate) observe: Option<ObserveName>,

    /// Start each segment at the recorded state, or at one that is learned with the weights (noisy data) [default:
    /// recorded]
    #[arg(long, value_enum)]
    pub(crate) starts: Option<StartName>,

    /// Part of the fit in which the horizon grows from 1 [default: 0.5]
    #[arg(long, value_name = "PART", value_parser = fraction)]
    pub(crate) growth: Option<f64>,

    /// Part of the fit in which accelerations are fitted first [default: 0]
    #[arg(long, value_name = "PART", value_parser = fraction)]
    pub(crate) warm_start: Option<f64>,
}

impl RolloutArgs {
    /// Settings of the loss.
    pub(crate) fn settings(&self) -> RolloutLoss {
        let default = RolloutLoss::default();
        RolloutLoss {
            horizon: self.horizon.map_or(default.horizon, |k| k as usize),
            integrator: self.integrator.map_or(default.integrator, Method::from),
            substeps: self.substeps.map_or(default.substeps, |k| k as usize),
            observe: self.observe.map_or(default.observe, |name| match name {
                ObserveName::States => Observe::States,
                ObserveName::Positions => Observe::Positions,
            }),
            start: self.starts.map_or(default.start, |name| match name {
                StartName::Recorded => Start::Recorded,
                StartName::Free => Start::Free,
            }),
            growth: self.growth.unwrap_or(default.growth),
            warm_start: self.warm_start.unwrap_or(default.warm_start),
        }
    }

    /// Refuses these flags under any other loss, so that none is ignored.
    ///
    /// # Errors
    /// For the first of them.
    pub(crate) fn require(&self, loss: train::Loss) -> Result<()> {
        let flags = [
            ("--horizon", self.horizon.is_some()),
            ("--integrator", self.integrator.is_some()),
            ("--substeps", self.substeps.is_some()),
            ("--observe", self.observe.is_some()),
            ("--starts", self.starts.is_some()),
            ("--growth", self.growth.is_some()),
            ("--warm-start", self.warm_start.is_some()),
        ];
        match flags.iter().find(|(_, given)| *given) {
            Some((flag, _)) if loss != train::Loss::ROLLOUT => Err(mistake(
                format!("{flag}: not for --loss {}", loss.name()),
                "omit it, or take --loss rollout",
            )),
            _ => Ok(()),
        }
    }
}

/// A method that a model can be trained through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum StepName {
    /// The classical Runge–Kutta method
    Rk4,
    /// The leapfrog
    #[value(alias = "leapfrog")]
    StormerVerlet,
    /// The implicit midpoint rule: one evaluation a step
    ImplicitMidpoint,
}

impl From<StepName> for Method {
    fn from(name: StepName) -> Self {
        match name {
            StepName::Rk4 => Self::Rk4,
            StepName::StormerVerlet => Self::StormerVerlet,
            StepName::ImplicitMidpoint => Self::ImplicitMidpoint,
        }
    }
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ObserveName {
    /// Positions and velocities
    States,
    /// Positions alone
    Positions,
}

/// Where segments start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum StartName {
    /// At the recorded state
    Recorded,
    /// At a learned one near it
    Free,
}
