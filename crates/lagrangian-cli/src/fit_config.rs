//! From the flags of `lagrangian fit` to what the library is asked for.

use anyhow::Result;
use lagrangian::models::Momenta;
use lagrangian::train::{Known, Request};
use lagrangian::{Budget, Loss, RobotConfig};

use crate::fit_args::{FitArgs, TrainingArgs};

/// What a fit needs of the data, whatever they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Whether recorded momenta are fitted, and so their rates are needed.
    pub(crate) momenta: bool,
    /// Samples that are predicted from each start; 0 where nothing is.
    pub(crate) horizon: usize,
    /// Whether positions alone are compared.
    pub(crate) positions: bool,
}

impl FitArgs {
    /// What the library is asked for; what is not given it chooses from the data.
    pub(crate) fn request(&self, robot: Option<RobotConfig>) -> Result<Request> {
        let mut request = Request {
            family: self.model.model.clone(),
            settings: self.model.settings.values.clone(),
            training: self.training.settings.values.clone(),
            rollout: self.rollout.values.clone(),
            budget: self.training.budget(),
            seed: self.training.seed,
            nominal: None,
        };
        self.robot.apply(robot, &mut request)?;
        Ok(request)
    }

    /// What the fit needs of the data.
    ///
    /// # Errors
    /// For a setting that does not belong to the fit, so that none is ignored.
    pub(crate) fn needs(&self) -> Result<Needs> {
        let config = self.request(None)?.choose(&Known::default())?.config;
        let rolls_out = config.loss == Loss::ROLLOUT;
        Ok(Needs {
            momenta: config.family.momenta() == Some(&Momenta::Recorded),
            horizon: if rolls_out { config.rollout.horizon } else { 0 },
            positions: config.loss.rule().is_some(),
        })
    }
}

impl TrainingArgs {
    /// How long, where that was given.
    fn budget(&self) -> Option<Budget> {
        let steps = |steps| Budget::Steps(usize::try_from(steps).unwrap_or(usize::MAX));
        let seconds = self.seconds.map(Budget::Seconds);
        self.steps.map(steps).or(seconds)
    }
}
