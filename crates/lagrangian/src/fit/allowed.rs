//! Checks of the settings of a fit against its data and its family.

use serde_json::Value;

use super::settings::SETTINGS;
use crate::dataset::Dataset;
use crate::fit::FitConfig;
use crate::models::{Abilities, Entry, Plan, Training};
use crate::train::adam::{AdamConfig, Precision};
use crate::train::forces::Input;
use crate::train::loss::Loss;
use crate::train::nominal;
use crate::train::task::Optimizer;
use lagrangian_motion::settings::{Kind, Values};
use lagrangian_motion::{Error, Result};

/// The largest number of parameters: some ten arrays of that length take a few gigabytes.
const MAX_PARAMETERS: usize = 1 << 26;

/// The largest number of samples of a batch.
const MAX_BATCH: usize = 1 << 20;

/// The largest number of residuals of a batch under the natural gradient, which solves a dense system of that size.
const MAX_RESIDUALS: usize = 8192;

/// Refuses a setting.
fn refuse(name: &'static str, value: impl Into<String>, must: &'static str) -> Result<()> {
    let value = value.into();
    Err(Error::Argument { name, value, must })
}

impl FitConfig {
    /// Checks all settings against the data, as [`fit`](fn@super::fit) does before it begins.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self, dataset: &Dataset) -> Result<()> {
        self.plan(dataset).map(drop)
    }

    /// The model that this fit trains, without its parameters.
    ///
    /// # Errors
    /// As [`FitConfig::validate`]; [`Error::Argument`] for a family that is solved for at once.
    pub fn trainable(&self, dataset: &Dataset) -> Result<Training> {
        match self.plan(dataset)? {
            Plan::Train(model) => Ok(model),
            Plan::Solve(_) => Err(Error::argument(
                "family",
                self.family.name(),
                "a network: what is solved for at once has no steps",
            )),
        }
    }

    /// The plan of the fit, after all checks.
    pub(super) fn plan(&self, dataset: &Dataset) -> Result<Plan> {
        self.check_sizes(dataset)?;
        self.budget.check(self.validate_every)?;
        self.check_loss(dataset)?;
        self.check_combinations(dataset)?;
        self.check_bounds()?;
        self.family.check(dataset, &self.training)?;
        if let Some(nominal) = self
            .nominal(dataset)?
            .filter(|_| self.forces.input == Input::Torque)
        {
            nominal::check_unit(&nominal, dataset)?;
        }
        if self.loss == Loss::ROLLOUT {
            self.rollout.validate(dataset, &self.optimizer)?;
        }
        let plan = self.family.prepare(dataset, &self.training)?;
        if let Plan::Train(model) = &plan
            && model.parameters() > MAX_PARAMETERS
        {
            let parameters = model.parameters().to_string();
            let must = "at most 67108864: take a smaller width or fewer layers";
            refuse("number of parameters", parameters, must)?;
        }
        Ok(plan)
    }

    fn check_sizes(&self, dataset: &Dataset) -> Result<()> {
        if dataset.train.is_empty() {
            return refuse("training samples", "none", "at least one");
        }
        if self.batch == 0 || self.batch > MAX_BATCH {
            let must = "between 1 and 1048576";
            return refuse("batch", self.batch.to_string(), must);
        }
        if let Some(first) = self.batch_first
            && !(1..=self.batch).contains(&first)
        {
            let must = "between 1 and the samples of a later step (`batch`)";
            return refuse("first batch", first.to_string(), must);
        }
        let residuals = self.batch * self.residuals(dataset.train.n);
        let solved = self.family.abilities().solved;
        if !solved && matches!(self.optimizer, Optimizer::Natural(_)) && residuals > MAX_RESIDUALS {
            let value = format!("{} ({residuals} residuals)", self.batch);
            let must =
                "at most 8192 residuals under the natural gradient: take a smaller batch, or Adam";
            return refuse("batch", value, must);
        }
        Ok(())
    }

    /// Residuals of a sample of `n` coordinates.
    fn residuals(&self, n: usize) -> usize {
        self.family.abilities().rates * self.loss.residuals(n)
    }

    /// Refuses a loss that the data or the family do not allow.
    fn check_loss(&self, dataset: &Dataset) -> Result<()> {
        let Abilities { losses, remedy, .. } = self.family.abilities();
        let name = self.loss.name();
        if self.loss.needs_forces() && !dataset.forced {
            let must = "acceleration: the data hold no force τ";
            return refuse("loss", name, must);
        }
        if self.loss.rule().is_some() && dataset.train.steps.is_empty() {
            let must = "acceleration or torque: the samples are not three neighbouring positions";
            return refuse("loss", name, must);
        }
        if self.loss.rule().is_none() && !dataset.train.steps.is_empty() {
            let must = "positions: the samples are neighbouring positions without velocities";
            return refuse("loss", name, must);
        }
        if !losses.contains(&self.loss) {
            return refuse("loss", name, remedy);
        }
        Ok(())
    }

    /// Refuses numbers outside the bounds of the tables of settings, also those that no request gave.
    fn check_bounds(&self) -> Result<()> {
        let mut values = match self.family.settings()? {
            Value::Object(values) => values,
            _ => Values::new(),
        };
        let rate = match &self.optimizer {
            Optimizer::Natural(natural) => natural.rate,
            Optimizer::Adam(adam) => {
                values.insert("weight_decay".into(), adam.decay.into());
                adam.rate
            }
        };
        values.insert("learning_rate".into(), rate.into());
        values.insert("forward".into(), self.forward.into());
        values.insert("patience".into(), self.patience.into());
        let own = Entry::by_name(self.family.name()).map_or(&[][..], |entry| entry.settings);
        let numbers = own
            .iter()
            .chain(SETTINGS)
            .filter(|row| matches!(row.kind, Kind::Integer { .. } | Kind::Number(_)));
        let mut given = numbers.filter_map(|row| Some((row, values.get(row.name)?)));
        given.try_for_each(|(row, value)| match value {
            Value::Null => Ok(()),
            value => row.check(value),
        })
    }

    /// Refuses settings that exclude each other.
    fn check_combinations(&self, dataset: &Dataset) -> Result<()> {
        if !dataset.forced && self.forces.of_recorded() {
            let must = "others than load, directional, quadratic, gains and input-matrix: the data hold no force τ";
            return refuse("forces", "of recorded forces", must);
        }
        let able = self.family.abilities();
        let rollout = self.loss == Loss::ROLLOUT;
        if self.batch_first.is_some() && rollout {
            let must = "omitted under the rollout loss, whose horizon grows instead";
            return refuse("first batch", "given", must);
        }
        if self.nominal.is_some() && !able.nominal {
            let value = format!("one beneath the family {}", self.family.name());
            let must = "beneath a Lagrangian network, lnn or delan; the family rigid takes the robot itself";
            return refuse("nominal model", value, must);
        }
        if self.nominal.is_some() && rollout {
            let must = "acceleration or torque with a nominal model: a rollout has no gradient through a robot's description";
            return refuse("loss", "rollout", must);
        }
        if self.nominal.is_some() && self.loss.rule().is_some() {
            let value = format!("one under the loss {}", self.loss.name());
            let must = "omitted, or fitted under the loss torque or acceleration";
            return refuse("nominal model", value, must);
        }
        let single = |adam: &AdamConfig| adam.precision == Precision::F32;
        if rollout && matches!(&self.optimizer, Optimizer::Adam(adam) if single(adam)) {
            return refuse("precision", "f32", "f64 under the rollout loss");
        }
        if self.forces.rotor && !able.rotor {
            let must = "without rotor inertias: only a deep Lagrangian network (delan) keeps them apart from M";
            return refuse("forces", "rotor", must);
        }
        Ok(())
    }
}
