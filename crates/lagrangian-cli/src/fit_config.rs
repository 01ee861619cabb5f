//! From the flags of `lagrangian fit` to the request of a fit.

use anyhow::Result;
use lagrangian::{FitSpec, PrepareOptions};

use crate::fit_args::FitArgs;
use crate::robot::Robot;

impl FitArgs {
    /// The request of the fit, with the robot once it was read; settings that are not given are chosen from the data.
    pub(crate) fn spec(&self, robot: Option<&Robot>) -> Result<FitSpec> {
        self.robot.refuse_needless_joints()?;
        let training = &self.training;
        let text = robot.map(|robot| robot.text.clone());
        Ok(FitSpec {
            family: self.model.model.clone(),
            settings: self.model.settings.values.clone(),
            training: training.settings.values.clone(),
            rollout: self.rollout.values.clone(),
            steps: training.steps.map(whole),
            seconds: training.seconds,
            seed: training.seed,
            prepare: PrepareOptions {
                baseline: training.baseline as usize,
                validate_fraction: training.validate_fraction,
                delay: self.data.delays(),
                cyclic: self.model.cyclic.clone(),
                ..self.estimate.prepare()
            },
            urdf: self.robot.urdf.as_ref().and(text.clone()),
            nominal: self.robot.nominal.as_ref().and(text),
            joints: self.robot.joints.clone(),
            refine: false,
        })
    }
}

fn whole(steps: u64) -> usize {
    usize::try_from(steps).unwrap_or(usize::MAX)
}
