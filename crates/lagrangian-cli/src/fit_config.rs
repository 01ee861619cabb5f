//! From the flags of `lagrangian fit` to what the library is asked for.

use anyhow::Result;
use lagrangian::train::Request;
use lagrangian::{Budget, PrepareOptions, RobotConfig};

use crate::fit_args::{FitArgs, TrainingArgs};

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

    /// What is done with the recordings.
    pub(crate) fn prepare(&self) -> PrepareOptions {
        PrepareOptions {
            baseline: self.training.baseline as usize,
            validate_fraction: self.training.validate_fraction,
            delayed: !self.data.delay.is_empty(),
            ..self.estimate.prepare()
        }
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
