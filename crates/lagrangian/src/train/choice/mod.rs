//! The settings of a fit from a request and from what is known of the data.
//!
//! Settings that a request omits are chosen here, each with a reason, so that the same request gives the same model in a
//! command, a program or a script.

mod known;
mod training;

pub use known::Known;
use training::TrainingChoices;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::fit::{Budget, FORWARD, FitConfig};
use super::forces::ForceTerms;
use super::loss::Loss;
use super::rollout::RolloutLoss;
use super::settings::{ROLLOUT_SETTINGS, SETTINGS, TrainingSettings};
use crate::dataset::Dataset;
use crate::models::{Entry, FAMILIES, Family};
use crate::rigid::RobotConfig;
use crate::settings::{Setting, Values, is_absent};
use crate::trajectory::Estimate;
use crate::{Error, Result};

/// A request for a fit, with the settings that a person gave.
///
/// ```
/// use lagrangian::train::{Known, Request};
/// use serde_json::json;
///
/// let mut request = Request::of("lnn");
/// request.settings.insert("width".into(), json!(32));
/// let noisy = Known { uncertainty: 0.03, ..Known::default() };
/// let chosen = request.choose(&noisy)?;
/// let form = chosen.choices.iter().find(|choice| choice.setting == "form");
/// assert_eq!(form.map(|choice| choice.value.clone()), Some(json!("convex")));
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// The name of the family; `None` for the first of the table, or for several that are tried,
    /// see [`FitConfig::candidates`].
    pub family: Option<String>,
    /// The settings of the family.
    pub settings: Values,
    /// The settings of the training, see [`SETTINGS`].
    pub training: Values,
    /// The settings of the rollout loss, see [`ROLLOUT_SETTINGS`].
    pub rollout: Values,
    /// The length of the fit; `None` for a minute.
    pub budget: Option<Budget>,
    /// The seed of weights and batches.
    pub seed: u64,
    /// The nominal model, whose omissions a network learns.
    pub nominal: Option<RobotConfig>,
}

/// The choice of a setting that was not given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The name of the setting.
    pub setting: String,
    /// The chosen value.
    pub value: Value,
    /// The reason in plain words.
    pub reason: String,
}

/// All settings of a fit, with those that were chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The settings.
    pub config: FitConfig,
    /// The choices of those that were not given.
    pub choices: Vec<Choice>,
}

impl Choice {
    /// A choice with its reason.
    pub fn new(setting: &str, value: impl Into<Value>, reason: impl Into<String>) -> Self {
        Self {
            setting: setting.into(),
            value: value.into(),
            reason: reason.into(),
        }
    }
}

impl FitConfig {
    /// The settings of a fit to these data: those of the request, the others chosen from the data.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting that does not belong to the fit, [`Error::UnknownName`] for an unknown family.
    pub fn for_data(
        dataset: &Dataset,
        estimates: &[Estimate],
        request: &Request,
    ) -> Result<Chosen> {
        request.choose(&Known::of(dataset, estimates))
    }
}

impl Request {
    /// A request for a family, with nothing else given.
    #[must_use]
    pub fn of(family: &str) -> Self {
        Self {
            family: Some(family.into()),
            ..Self::default()
        }
    }

    /// The configuration of the family, with defaults for settings that depend on the data.
    ///
    /// # Errors
    /// As [`Request::choose`].
    pub fn family(&self) -> Result<Box<dyn Family>> {
        Ok(self.choose(&Known::default())?.config.family)
    }

    /// The loss of a fit to such data.
    ///
    /// # Errors
    /// As [`Request::choose`].
    pub fn loss(&self, known: &Known) -> Result<Loss> {
        Ok(self.choose(known)?.config.loss)
    }

    /// All settings of a fit to data with these properties.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting that does not belong to the fit, [`Error::UnknownName`] for an unknown family.
    pub fn choose(&self, known: &Known) -> Result<Chosen> {
        let family = self.family.as_deref();
        let entry = Entry::by_name(family.unwrap_or(FAMILIES[0].name))?;
        self.refuse_foreign(entry)?;
        refuse_misfits(&self.settings, entry.settings)?;
        let training: TrainingSettings = read("the training", &self.training, SETTINGS)?;
        let given = Self {
            settings: present(&self.settings),
            ..self.clone()
        };
        let mut choices = (entry.choose)(known, &given)?;
        let mut settings = given.settings;
        let forces = ForceTerms::take(&mut settings)?;
        choices.retain(|choice| match choice.setting.as_str() {
            LOSS => training.loss.is_none(),
            setting => !settings.contains_key(setting),
        });
        for choice in choices.iter().filter(|choice| choice.setting != LOSS) {
            settings.insert(choice.setting.clone(), choice.value.clone());
        }
        let loss = loss(&training, &mut choices)?;
        let family = (entry.read)(Value::Object(settings)).map_err(|e| setting_error(&e))?;
        let rollout = self.rollout(loss)?;
        let mut training = TrainingChoices {
            asked: training,
            loss,
            timed: !matches!(self.budget, Some(Budget::Steps(_))),
            known: *known,
            choices,
        };
        let name = training.optimizer();
        let optimizer = training.configured(name)?;
        let batch = training.batch(name);
        let budget = training.budget(self.budget);
        let TrainingChoices { asked, choices, .. } = training;
        let solved = family.abilities().solved;
        Ok(Chosen {
            config: FitConfig {
                family,
                loss,
                rollout,
                optimizer,
                budget,
                batch,
                batch_first: asked.batch_first,
                forward: asked.forward.unwrap_or(FORWARD),
                seed: self.seed,
                forces,
                nominal: self.nominal.clone(),
                patience: asked.patience,
                ..FitConfig::default()
            },
            choices: choices
                .into_iter()
                .filter(|choice| !(solved && is_of_descent(choice)))
                .collect(),
        })
    }

    /// Refuses settings that the family does not have.
    fn refuse_foreign(&self, entry: &Entry) -> Result<()> {
        let own = |entry: &Entry, name: &str| entry.settings.iter().any(|s| s.name == name);
        let given = present(&self.settings);
        let Some(name) = given.keys().find(|name| !own(entry, name)) else {
            return Ok(());
        };
        let others = FAMILIES.iter().filter(|other| own(other, name));
        let others: Vec<&str> = others.map(|other| other.name).collect();
        let remedy = match others.is_empty() {
            true => "omit it".into(),
            false => format!("omit it, or take `family` {}", others.join(" or ")),
        };
        Err(Error::setting(
            format!("`{name}` is no setting of {}", entry.name),
            remedy,
        ))
    }

    /// The settings of the rollout loss; refuses them under any other loss.
    fn rollout(&self, loss: Loss) -> Result<RolloutLoss> {
        let given = present(&self.rollout);
        match given.keys().next() {
            Some(name) if loss != Loss::ROLLOUT => Err(Error::setting(
                format!("`{name}` is no setting of the loss {}", loss.name()),
                "omit it, or take `loss` rollout",
            )),
            _ => read("the rollout loss", &self.rollout, ROLLOUT_SETTINGS),
        }
    }
}

/// The values that were given.
fn present(values: &Values) -> Values {
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

/// The name of the one setting of the training that a family chooses.
pub(crate) const LOSS: &str = "loss";

/// The loss that was given, or that the family chose, or the one that fits every recording.
fn loss(training: &TrainingSettings, choices: &mut Vec<Choice>) -> Result<Loss> {
    if let Some(loss) = training.loss {
        return Ok(loss);
    }
    let chosen = choices.iter().find(|choice| choice.setting == LOSS);
    if let Some(name) = chosen.and_then(|choice| choice.value.as_str()) {
        return name.parse();
    }
    let reason = "accelerations are known of every recording, measured or estimated";
    choices.push(Choice::new(LOSS, Loss::ACCELERATION.name(), reason));
    Ok(Loss::ACCELERATION)
}

/// Whether the choice is of no use to a family with a closed form.
fn is_of_descent(choice: &Choice) -> bool {
    [LOSS, "optimizer", "damping", "batch", "seconds"].contains(&choice.setting.as_str())
}
