//! The settings of a fit from a request and from what is known of the data.
//!
//! Settings that a request omits are chosen here, each with a reason, so that the same request gives the same model in a
//! command, a program or a script.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::adam::AdamConfig;
use super::fit::{Budget, FitConfig, Optimizer};
use super::forces::ForceTerms;
use super::loss::Loss;
use super::natural::NaturalConfig;
use super::rollout::RolloutLoss;
use super::settings::{DampingName, OptimizerName, ROLLOUT_SETTINGS, SETTINGS, TrainingSettings};
use crate::dataset::Dataset;
use crate::models::{Entry, FAMILIES, Family};
use crate::rigid::RobotConfig;
use crate::settings::{Setting, Values, is_absent};
use crate::trajectory::{Estimate, Source};
use crate::{Error, Result};

/// The length of a fit whose request gives neither steps nor seconds, s.
const SECONDS: f64 = 60.0;

/// Accelerations are noisy where their relative standard error exceeds this.
const NOISY: f64 = 0.005;

/// A request for a fit, with the settings that a person gave.
///
/// ```
/// use lagrangian::train::{Known, Request};
/// use serde_json::json;
///
/// let mut request = Request::of("lnn");
/// request.settings.insert("width".into(), json!(32));
/// let noisy = Known { uncertainty: 0.03, forced: false };
/// let chosen = request.choose(&noisy)?;
/// let form = chosen.choices.iter().find(|choice| choice.setting == "form");
/// assert_eq!(form.map(|choice| choice.value.clone()), Some(json!("convex")));
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// The name of the family.
    pub family: String,
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

/// The properties of data that choices depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// The relative standard error of the accelerations, that of the worst coordinate.
    pub uncertainty: f64,
    /// Whether forces are recorded.
    pub forced: bool,
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

impl Known {
    /// The properties of these data, from the estimates of their signals.
    #[must_use]
    pub fn of(dataset: &Dataset, estimates: &[Estimate]) -> Self {
        let error = |name: &str| match dataset.train.steps.is_empty() {
            true => standard_error(estimates, name),
            false => second_difference(dataset, estimates, name),
        };
        let names = dataset.coordinates.0.iter().map(|c| &*c.name);
        let scales = dataset.acceleration_scale();
        let parts = names.zip(&scales).map(|(name, scale)| error(name) / scale);
        Self {
            uncertainty: parts.fold(0.0, f64::max),
            forced: dataset.forced,
        }
    }

    /// Whether accelerations are noisy.
    #[must_use]
    pub fn noisy(&self) -> bool {
        self.uncertainty > NOISY
    }

    /// The uncertainty of the accelerations in words.
    #[must_use]
    pub fn certainty(&self) -> String {
        format!(
            "accelerations are uncertain by {:.1} %",
            100.0 * self.uncertainty
        )
    }
}

/// Standard error of the accelerations of a coordinate, root mean square over the trajectories.
fn standard_error(estimates: &[Estimate], name: &str) -> f64 {
    let own = estimates
        .iter()
        .filter(|e| e.signal == "qdd" && e.coordinate == name);
    let (sum, count) = own.fold((0.0, 0.0), |(s, c), e| {
        (s + e.standard_error.powi(2), c + 1.0)
    });
    if count > 0.0 {
        (sum / count).sqrt()
    } else {
        0.0
    }
}

/// Standard error of the second divided difference of three positions, from the noise of the positions.
fn second_difference(dataset: &Dataset, estimates: &[Estimate], name: &str) -> f64 {
    let steps = &dataset.train.steps;
    let step = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    let own = estimates
        .iter()
        .filter(|e| e.signal == "qdd" && e.coordinate == name && e.source == Source::Q);
    let noise = own.map(|e| e.noise).fold(0.0, f64::max);
    6.0_f64.sqrt() * noise / (step * step)
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
            family: family.into(),
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
        let entry = Entry::by_name(&self.family)?;
        self.refuse_foreign(entry)?;
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
        let mut training = Trained {
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
        let Trained { asked, choices, .. } = training;
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

/// Reads the values of a table.
fn read<T: DeserializeOwned>(what: &str, values: &Values, table: &[Setting]) -> Result<T> {
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

/// The choices of the training so far, and what further ones depend on.
struct Trained {
    asked: TrainingSettings,
    loss: Loss,
    /// Whether the fit has a time to use, not a number of steps.
    timed: bool,
    known: Known,
    choices: Vec<Choice>,
}

impl Trained {
    fn choose(&mut self, setting: &str, value: impl Into<Value>, reason: impl Into<String>) {
        self.choices.push(Choice::new(setting, value, reason));
    }

    /// The natural gradient solves each batch for itself, noise and all; Adam averages over many. Noise of states does
    /// no harm to a rollout that noise of accelerations does to a balance (ADR 0042).
    fn optimizer(&mut self) -> OptimizerName {
        if let Some(name) = self.asked.optimizer {
            return name;
        }
        if self.known.noisy() && self.loss != Loss::ROLLOUT {
            let reason = format!(
                "{}: Adam instead of the natural gradient, which would follow the noise",
                self.known.certainty()
            );
            self.choose("optimizer", "adam", reason);
            return OptimizerName::Adam;
        }
        let reason = "it is the fastest where noise does not dominate";
        self.choose("optimizer", "natural", reason);
        OptimizerName::Natural
    }

    /// Whether the fit has a time to use and squares that λ can follow: then small batches, damped by the loss, are the
    /// best; a number of steps is used best by large ones (docs/adr/0050).
    fn follows_the_loss(&self) -> bool {
        self.timed && self.loss != Loss::ROLLOUT
    }

    fn configured(&mut self, name: OptimizerName) -> Result<Optimizer> {
        match name {
            OptimizerName::Natural => {
                let default = match self.damping()? {
                    DampingName::Schedule => NaturalConfig::default(),
                    DampingName::Loss => NaturalConfig::following_the_loss(),
                    DampingName::Adaptive => NaturalConfig::adaptive(),
                };
                let rate = self.asked.learning_rate.unwrap_or(default.rate);
                Ok(Optimizer::Natural(NaturalConfig { rate, ..default }))
            }
            OptimizerName::Adam => {
                if self.asked.damping.is_some() {
                    return Err(Error::setting(
                        "`damping` is a setting of the natural gradient, and this fit is one by Adam",
                        "omit it, or take `optimizer` natural",
                    ));
                }
                let default = AdamConfig::default();
                Ok(Optimizer::Adam(AdamConfig {
                    rate: self.asked.learning_rate.unwrap_or(default.rate),
                    decay: self.asked.weight_decay.unwrap_or(default.decay),
                    ..default
                }))
            }
        }
    }

    fn damping(&mut self) -> Result<DampingName> {
        match self.asked.damping {
            Some(name) if self.loss == Loss::ROLLOUT && name != DampingName::Schedule => {
                Err(Error::setting(
                    "under the loss rollout the damping follows a schedule",
                    "omit `damping`, or choose another `loss`",
                ))
            }
            Some(name) => Ok(name),
            None if self.follows_the_loss() => {
                let reason =
                    "a fit with a time to use ends lowest where the damping falls with the loss";
                self.choose("damping", "loss", reason);
                Ok(DampingName::Loss)
            }
            None => {
                let reason = "a number of steps, or a loss of rollouts, is used best by a schedule";
                self.choose("damping", "schedule", reason);
                Ok(DampingName::Schedule)
            }
        }
    }

    fn batch(&mut self, optimizer: OptimizerName) -> usize {
        if let Some(batch) = self.asked.batch {
            return batch;
        }
        let (batch, reason) = match optimizer {
            OptimizerName::Natural if self.follows_the_loss() => (
                128,
                "small batches end lowest where a fit has a time to use",
            ),
            OptimizerName::Natural => (256, "large batches use a number of steps best"),
            OptimizerName::Adam => (512, "Adam averages the noise over the samples of a batch"),
        };
        self.choose("batch", batch, reason);
        batch
    }

    fn budget(&mut self, given: Option<Budget>) -> Budget {
        given.unwrap_or_else(|| {
            self.choose("seconds", SECONDS, "neither steps nor seconds were given");
            Budget::Seconds(SECONDS)
        })
    }
}
