//! Which settings of a fit its data and its family allow.

use super::fit::{Budget, FitConfig, Optimizer, Precision};
use super::forces::ForceTerms;
use super::learner::Loss;
use crate::dataset::Dataset;
use crate::models::{Family, Template};
use crate::rigid::RigidBodies;
use crate::{Error, Result};

/// Parameters that are trained at most: some ten arrays of that length stay within a few gigabytes.
const MAX_PARAMETERS: usize = 1 << 26;

impl FitConfig {
    /// Checks all settings against the data, as [`fit`](fn@super::fit) does before it begins.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self, dataset: &Dataset) -> Result<()> {
        match self.family {
            Family::Rigid(ref rigid) => {
                self.nominal(dataset, &self.family)?;
                if let Some(robot) = &rigid.robot {
                    robot.bodies(&dataset.coordinates)?;
                }
                self.check(dataset)
            }
            _ => self.template(dataset).map(drop),
        }
    }

    /// The robot that is known, as the data see it.
    pub(crate) fn nominal(
        &self,
        dataset: &Dataset,
        family: &Family,
    ) -> Result<Option<RigidBodies>> {
        let Some(robot) = &self.nominal else {
            return Ok(None);
        };
        if !matches!(family, Family::Lnn(_) | Family::Delan(_)) {
            return Err(Error::Argument {
                name: "nominal model",
                value: format!("one beneath the family {}", family.name()),
                must: "beneath a Lagrangian network (--model lnn or delan); rigid takes the robot itself (--urdf)",
            });
        }
        robot.bodies(&dataset.coordinates).map(Some)
    }

    pub(super) fn template(&self, dataset: &Dataset) -> Result<Template> {
        self.check(dataset)?;
        let template = self.family.template(dataset, self)?;
        let parameters = template.parameters();
        if parameters <= MAX_PARAMETERS {
            return Ok(template);
        }
        Err(Error::Argument {
            name: "number of parameters",
            value: parameters.to_string(),
            must: "at most 67108864: take a smaller --width or fewer --layers",
        })
    }

    fn check(&self, dataset: &Dataset) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if dataset.train.is_empty() {
            return argument("training samples", "none".into(), "at least one");
        }
        if self.batch == 0 || self.batch > 1 << 20 {
            return argument("batch", self.batch.to_string(), "between 1 and 1048576");
        }
        if let Some(first) = self.batch_first
            && !(1..=self.batch).contains(&first)
        {
            let must = "between 1 and the samples of a later step (--batch)";
            return argument("first batch", first.to_string(), must);
        }
        if self.batch_first.is_some() && self.loss == Loss::Rollout {
            let must = "left away under the rollout loss, whose horizon grows instead";
            return argument("first batch", "given".into(), must);
        }
        if matches!(self.optimizer, Optimizer::Natural(_))
            && self.batch * self.residuals(dataset.train.n) > 8192
        {
            let must =
                "at most 8192 residuals under the natural gradient: take a smaller batch, or Adam";
            return argument(
                "batch",
                format!(
                    "{} ({} residuals)",
                    self.batch,
                    self.batch * self.residuals(dataset.train.n)
                ),
                must,
            );
        }
        self.budget.check(self.validate_every)?;
        self.check_family(dataset)
    }

    /// Residuals of a sample of `n` coordinates.
    fn residuals(&self, n: usize) -> usize {
        match self.family {
            Family::Hnn(_) => 2 * n,
            _ => self.loss.residuals(n),
        }
    }

    /// What this family cannot be fitted to.
    fn check_family(&self, dataset: &Dataset) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let hnn = match &self.family {
            Family::Hnn(hnn) => Some(hnn),
            _ => None,
        };
        match hnn {
            Some(_)
                if !matches!(
                    self.loss,
                    Loss::Acceleration | Loss::AccelerationL1 | Loss::Rollout
                ) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "left away (or acceleration-l1 for absolute errors, or rollout): a Hamiltonian network is fitted to (q̇, ṗ), or to motions in (q, p)",
                )
            }
            Some(_) if self.loss == Loss::Rollout && self.forces != ForceTerms::default() => {
                argument(
                    "forces",
                    "under the rollout loss of a Hamiltonian network".into(),
                    "left away, or learned without --loss rollout",
                )
            }
            Some(hnn) if !hnn.momenta.canonical() && dataset.forced => argument(
                "momenta",
                "velocities, with forces in the data".into(),
                "recorded, or p = m q̇ with --masses: a force changes p, not q̇",
            ),
            Some(hnn) if !hnn.momenta.canonical() && self.forces != ForceTerms::default() => {
                argument(
                    "forces",
                    "beside velocities in the place of momenta".into(),
                    "left away, or momenta recorded or p = m q̇ with --masses",
                )
            }
            _ if self.loss.needs_forces() && !dataset.forced => argument(
                "loss",
                "torque".into(),
                "acceleration: the data hold no force τ",
            ),
            _ if matches!(self.family, Family::NeuralOde(_))
                && !matches!(self.loss, Loss::Rollout | Loss::Acceleration) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "rollout or acceleration: a neural ODE has no inverse dynamics (--model mlp has)",
                )
            }
            _ if self.loss == Loss::Rollout && self.nominal.is_some() => argument(
                "loss",
                "rollout".into(),
                "acceleration or torque upon a nominal model: a rollout has no gradient through a robot's description",
            ),
            _ if self.loss == Loss::Rollout && self.precision == Precision::F32 => {
                argument("precision", "f32".into(), "f64 under the rollout loss")
            }
            _ if self.loss.rule().is_some() && dataset.train.steps.is_empty() => argument(
                "loss",
                self.loss.name().into(),
                "acceleration or torque: the samples are not three neighbouring positions (Dataset::of_positions)",
            ),
            _ if self.loss.rule().is_none() && !dataset.train.steps.is_empty() => argument(
                "loss",
                self.loss.name().into(),
                "positions (--loss positions): the samples are neighbouring positions without velocities",
            ),
            _ if self.loss.rule().is_some()
                && !matches!(self.family, Family::Lnn(_) | Family::Delan(_)) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "acceleration or torque, of estimated derivatives: only a Lagrangian network (lnn, delan, vin) is fitted to positions alone",
                )
            }
            _ if self.loss.rule().is_some() && self.nominal.is_some() => argument(
                "nominal model",
                format!("one under the loss {}", self.loss.name()),
                "left away, or fitted with --loss torque or acceleration",
            ),
            _ if self.forces.rotor && !matches!(self.family, Family::Delan(_)) => argument(
                "forces",
                "rotor".into(),
                "without rotor inertias: only a deep Lagrangian network (delan) keeps them apart from M",
            ),
            _ if matches!(self.loss, Loss::TorqueAcceleration | Loss::TorquePower)
                && !matches!(self.family, Family::Delan(_)) =>
            {
                argument(
                    "loss",
                    self.loss.name().into(),
                    "torque or acceleration: only deep Lagrangian networks (delan) are fitted to more at once",
                )
            }
            _ if self.loss == Loss::Rollout => {
                self.rollout
                    .validate(dataset, &self.optimizer, &self.family)
            }
            _ => Ok(()),
        }
    }
}

impl Budget {
    /// Refuses a budget of nothing, and looks at the validation data that never come.
    pub(crate) fn check(self, validate_every: usize) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if validate_every == 0 {
            return argument("validate_every", "0".into(), "at least 1");
        }
        match self {
            Self::Steps(0) => argument("steps", "0".into(), "at least 1"),
            Self::Seconds(s) if !(s.is_finite() && s > 0.0) => {
                argument("seconds", s.to_string(), "finite and positive")
            }
            _ => Ok(()),
        }
    }
}
