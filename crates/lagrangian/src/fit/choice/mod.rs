//! The settings of a fit from a request and from properties of the data.
//!
//! Settings that a request omits are chosen here, each with a reason, so that the same request gives the same model in a
//! command, a program or a script.

mod spec;
mod training;

use training::TrainingChoices;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::settings::{ROLLOUT_SETTINGS, SETTINGS, TrainingSettings};
use crate::dataset::Dataset;
use crate::fit::FitConfig;
use crate::models::settings::{ACTIVATION, POLYNOMIAL};
use crate::models::{Abilities, Entry, FAMILIES, Family};
use crate::train::forces::{ForceTerms, Input};
use crate::train::known::DataFacts;
use crate::train::loss::Loss;
use crate::train::rollout::RolloutLoss;
use crate::train::spec::{AutoSetting, FitSpec, LOSS};
use crate::train::task::{FORWARD, TrainingTask};
use lagrangian_motion::settings::{Need, Setting, Values, is_absent};
use lagrangian_motion::{Error, Result};
use lagrangian_recordings::Estimate;

/// All settings of a fit, with those that were chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolvedConfig {
    /// The name among several that are tried: that of the family, with what distinguishes it from others of the family.
    pub name: String,
    /// Its part among several that are tried.
    pub part: Part,
    /// The settings.
    pub config: FitConfig,
    /// The settings that the request omitted, with the chosen values.
    pub choices: Vec<AutoSetting>,
    /// The standard deviations of the noise of positions, `[n]`, and of velocities too where they were measured, `[2n]`, where long
    /// rollouts can average it; else empty.
    pub noise: Vec<f64>,
}

/// The part of a model among several that are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// It is fitted first: alone, or among those that learn torques.
    First,
    /// It learns accelerations, beside models of torques.
    Beside,
    /// It learns accelerations, and is tried where torques remain unexplained.
    Instead,
    /// It is tried before all others, and kept where it is the law.
    Law,
}

impl FitConfig {
    /// The settings of a fit to these data: those of the request, the others chosen from the data.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting that does not belong to the fit, [`Error::UnknownName`] for an unknown family.
    pub fn for_data(
        dataset: &Dataset,
        estimates: &[Estimate],
        spec: &FitSpec,
    ) -> Result<ResolvedConfig> {
        spec.choose(&DataFacts::of(dataset, estimates))
    }
}

impl FitSpec {
    /// The configuration of the family, with defaults for settings that depend on the data.
    ///
    /// # Errors
    /// As [`FitSpec::choose`].
    pub fn family(&self) -> Result<Box<dyn Family>> {
        Ok(self
            .checked()?
            .complete(&DataFacts::default())?
            .config
            .family)
    }

    /// The loss of a fit to such data.
    ///
    /// # Errors
    /// As [`FitSpec::choose`].
    pub fn loss(&self, known: &DataFacts) -> Result<Loss> {
        Ok(self.checked()?.complete(known)?.config.loss)
    }

    /// All settings of a fit to data with these properties.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting that does not belong to the fit or changes nothing of it, [`Error::UnknownName`] for an
    /// unknown family.
    pub fn choose(&self, known: &DataFacts) -> Result<ResolvedConfig> {
        let own = self.checked()?;
        let chosen = own.complete(known)?;
        own.refuse_idle(&chosen, known)?;
        Ok(chosen)
    }

    /// The family that is fitted, where the request fits a single one.
    fn entry(&self) -> Result<&'static Entry> {
        let first = match self.has_robot() {
            true => Entry::by_robot(),
            false => FAMILIES.first(),
        };
        Entry::by_name(
            self.family
                .as_deref()
                .or(first.map(|f| f.name))
                .unwrap_or_default(),
        )
    }

    /// All settings of a fit to data with these properties, also where some change nothing.
    pub(crate) fn complete(&self, known: &DataFacts) -> Result<ResolvedConfig> {
        let entry = self.entry()?;
        self.refuse_foreign(entry)?;
        refuse_misfits(&self.settings, entry.settings)?;
        let training: TrainingSettings = read("the training", &self.training, SETTINGS)?;
        let given = Self {
            settings: present(&self.settings),
            ..self.clone()
        };
        let mut choices = (entry.choose)(known, &given)?;
        choices.retain(|choice| match choice.setting.as_str() {
            LOSS => training.loss.is_none(),
            setting => self.settings.get(setting).is_none_or(Value::is_null),
        });
        let mut settings = given.settings;
        let of_family = choices.iter().filter(|choice| choice.setting != LOSS);
        settings.extend(of_family.map(|choice| (choice.setting.clone(), choice.value.clone())));
        let forces = ForceTerms::take(&mut settings)?;
        let loss = loss(&training, &mut choices)?;
        let nominal = self.nominal.as_deref().map(|text| self.robot(text));
        let mut training = TrainingChoices {
            asked: training,
            loss,
            timed: self.steps.is_none(),
            known: *known,
            polynomial: is_polynomial(&settings),
            choices,
        };
        let family = (entry.read)(Value::Object(settings)).map_err(|e| setting_error(&e))?;
        let name = training.optimizer();
        let (optimizer, batch) = (training.configured(name)?, training.batch(name));
        let budget = training.budget(self.budget());
        let (asked, mut choices) = (training.asked, training.choices);
        if family.abilities().solved {
            choices.retain(|choice| !DESCENT.contains(&choice.setting.as_str()));
        }
        Ok(ResolvedConfig {
            part: Part::First,
            name: entry.name.into(),
            noise: Vec::new(),
            config: FitConfig {
                family,
                training: TrainingTask {
                    loss,
                    rollout: self.rollout(loss)?,
                    optimizer,
                    budget,
                    batch,
                    batch_first: asked.batch_first,
                    forward: asked.forward.unwrap_or(FORWARD),
                    seed: self.seed,
                    forces,
                    nominal: nominal.transpose()?,
                    patience: asked.patience,
                    ..TrainingTask::default()
                },
            },
            choices,
        })
    }

    /// Refuses settings that the family does not have.
    fn refuse_foreign(&self, entry: &Entry) -> Result<()> {
        let given = present(&self.settings);
        match given.keys().find(|name| !entry.has(name)) {
            Some(name) => Err(foreign(name, entry.name)),
            None => Ok(()),
        }
    }

    /// Refuses settings that change nothing of the fit.
    fn refuse_idle(&self, chosen: &ResolvedConfig, known: &DataFacts) -> Result<()> {
        let mut given = present(&self.settings);
        given.extend(present(&self.training));
        let value = |name: &str| {
            let choice = || chosen.choices.iter().find(|choice| choice.setting == name);
            given.get(name).or_else(|| Some(&choice()?.value))
        };
        let family = chosen.config.family.name();
        let Abilities {
            solved,
            drives,
            cyclic,
            ..
        } = chosen.config.family.abilities();
        if self.keeps_cyclic() && !cyclic {
            return Err(Error::setting(
                format!(
                    "`cyclic` changes nothing: {family} has no function that could be kept from a coordinate"
                ),
                "omit it, or take another `family`",
            ));
        }
        let rows = self.entry()?.settings.iter().chain(SETTINGS);
        for Setting { name, needs, .. } in rows.filter(|row| given.contains_key(row.name)) {
            let of_descent =
                DESCENT.contains(name) || needs.is_some_and(|n| n.setting == OPTIMIZER);
            if solved && of_descent {
                return Err(Error::setting(
                    format!("`{name}` changes nothing: {family} is solved for at once"),
                    "omit it, or take another `family`",
                ));
            }
            // Drives are added to bodies that were solved for from torques too.
            let met = |need: &Need| (solved && known.forced) || need.is_met(value(need.setting));
            if let Some(need) = needs.filter(|need| !met(need)) {
                return Err(Error::setting(
                    format!("`{name}` changes nothing without {}", need.words()),
                    format!("omit it, or give {}", need.words()),
                ));
            }
        }
        let torques = chosen.config.forces.input == Input::Torque;
        if given.contains_key(FORWARD_WEIGHT) && !(drives && torques && self.nominal.is_none()) {
            return Err(Error::setting(
                format!(
                    "`{FORWARD_WEIGHT}` changes nothing: this fit of {family} adds no inertia of drives"
                ),
                "omit it, or take `family` delan without a nominal model, `gains` and `input-matrix`",
            ));
        }
        Ok(())
    }

    /// The settings of the rollout loss; refuses them under any other loss.
    fn rollout(&self, loss: Loss) -> Result<RolloutLoss> {
        let given = present(&self.rollout);
        match given.keys().next() {
            Some(name) if loss != Loss::ROLLOUT => Err(Error::setting(
                format!("`{name}` is not a setting of the loss {}", loss.name()),
                "omit it, or take `loss` rollout",
            )),
            _ => read("the rollout loss", &self.rollout, ROLLOUT_SETTINGS),
        }
    }
}

/// Whether a network of these settings is a polynomial.
fn is_polynomial(settings: &Values) -> bool {
    let activation = settings.get(ACTIVATION.name);
    activation.is_some_and(|own| own == POLYNOMIAL)
}

/// The values that were given.
pub(crate) fn present(values: &Values) -> Values {
    let given = values.iter().filter(|(_, value)| !is_absent(value));
    given.map(|(k, v)| (k.clone(), v.clone())).collect()
}

/// Refuses values that are not of the kind of their setting.
fn refuse_misfits(values: &Values, table: &[Setting]) -> Result<()> {
    let known = table.iter().filter_map(|s| Some((s, values.get(s.name)?)));
    let mut given = known.filter(|(_, value)| !is_absent(value));
    given.try_for_each(|(setting, value)| setting.check(value))
}

/// Reads the values of a table.
fn read<T: DeserializeOwned>(what: &str, values: &Values, table: &[Setting]) -> Result<T> {
    refuse_misfits(values, table)?;
    serde_json::from_value(Value::Object(present(values))).map_err(|e| {
        Error::setting(
            format!("a setting of {what} cannot be read ({e})"),
            format!(
                "give values of {}",
                table.iter().map(|s| s.name).collect::<Vec<_>>().join(", ")
            ),
        )
    })
}

fn setting_error(error: &serde_json::Error) -> Error {
    Error::setting(error.to_string(), "correct the setting, or omit it")
}

/// The loss that was given, or that the family chose, or the one that fits every recording.
fn loss(training: &TrainingSettings, choices: &mut Vec<AutoSetting>) -> Result<Loss> {
    if let Some(loss) = training.loss {
        return Ok(loss);
    }
    let chosen = choices.iter().find(|choice| choice.setting == LOSS);
    if let Some(name) = chosen.and_then(|choice| choice.value.as_str()) {
        return name.parse();
    }
    let reason = "accelerations are known of every recording, measured or estimated";
    choices.push(AutoSetting::new(LOSS, Loss::ACCELERATION.name(), reason));
    Ok(Loss::ACCELERATION)
}

/// An error that names the families that have a setting, for one that does not.
pub(crate) fn foreign(name: &str, family: &str) -> Error {
    let others = FAMILIES.iter().filter(|other| other.has(name));
    let others: Vec<&str> = others.map(|other| other.name).collect();
    let remedy = match others.is_empty() {
        true => "omit it".into(),
        false => format!("omit it, or take `family` {}", others.join(" or ")),
    };
    Error::setting(format!("`{name}` is not a setting of {family}"), remedy)
}

const OPTIMIZER: &str = "optimizer";

/// The setting of the inertia that is added to drives.
const FORWARD_WEIGHT: &str = "forward";

/// The settings that a family with a closed form does not use.
const DESCENT: &[&str] = &[LOSS, OPTIMIZER, "damping", "batch", "seconds"];
