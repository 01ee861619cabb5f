//! The request of a fit, and the automatic settings where it names none.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::task::Budget;
use crate::dataset::PrepareOptions;
use lagrangian_mechanics::rigid::{self, RobotConfig};
use lagrangian_motion::Result;
use lagrangian_motion::settings::Values;

/// The request of a fit, as plain data: all that it depends on beside its recordings. Together they give equal bits wherever the
/// fit ends after a number of steps.
///
/// ```
/// use lagrangian::train::DataFacts;
/// use lagrangian::FitSpec;
/// use serde_json::json;
///
/// let mut spec = FitSpec::of("lnn");
/// spec.settings.insert("width".into(), json!(32));
/// let noisy = DataFacts { uncertainty: 0.03, ..DataFacts::default() };
/// let chosen = spec.choose(&noisy)?;
/// let form = chosen.choices.iter().find(|choice| choice.setting == "form");
/// assert_eq!(form.map(|choice| choice.value.clone()), Some(json!("convex")));
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitSpec {
    /// The name of the family; `None` for the first of the table, or for several that are tried,
    /// see [`FitConfig::candidates`](crate::FitConfig::candidates).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// The settings of the family.
    #[serde(skip_serializing_if = "Values::is_empty")]
    pub settings: Values,
    /// The settings of the training, see [`SETTINGS`](crate::fit::SETTINGS).
    #[serde(skip_serializing_if = "Values::is_empty")]
    pub training: Values,
    /// The settings of the rollout loss, see [`ROLLOUT_SETTINGS`](crate::fit::ROLLOUT_SETTINGS).
    #[serde(skip_serializing_if = "Values::is_empty")]
    pub rollout: Values,
    /// The number of steps after which the fit ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<usize>,
    /// The time after which it ends, s, where no number of steps is given; without both a minute, or 400 steps where several models of
    /// free motions are tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// The seed of weights, split and batches.
    pub seed: u64,
    /// The preparation of the recordings.
    #[serde(skip_serializing_if = "PrepareOptions::is_default")]
    pub prepare: PrepareOptions,
    /// The text of the URDF of a robot whose parameters are identified, or the name of an example.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// The text of the URDF of a nominal model, or the name of an example; a network learns the forces that it omits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<String>,
    /// The joints of the robot in the order of the data; empty for all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// Whether a named family is fitted as one of several that are tried for a free motion: without friction where it needs none, and
    /// refined by long rollouts where noise limits the accelerations.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refine: bool,
}

impl FitSpec {
    /// A request for a family, with nothing else given.
    #[must_use]
    pub fn of(family: &str) -> Self {
        Self {
            family: Some(family.into()),
            ..Self::default()
        }
    }

    /// The length of the fit, where one is given.
    #[must_use]
    pub fn budget(&self) -> Option<Budget> {
        let seconds = self.seconds.map(Budget::Seconds);
        self.steps.map(Budget::Steps).or(seconds)
    }

    /// The robot of a description, with the joints of the data.
    pub(crate) fn robot(&self, text: &str) -> Result<RobotConfig> {
        let text = rigid::example(text).unwrap_or(text);
        RobotConfig::new(text, self.joints.clone())
    }
}

/// The choice of a setting that was not given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AutoSetting {
    /// The name of the setting.
    pub setting: String,
    /// The chosen value.
    pub value: Value,
    /// The reason in plain words.
    pub reason: String,
}

impl AutoSetting {
    /// A choice with its reason.
    pub fn new(setting: &str, value: impl Into<Value>, reason: impl Into<String>) -> Self {
        Self {
            setting: setting.into(),
            value: value.into(),
            reason: reason.into(),
        }
    }
}

/// The name of the one setting of the training that a family chooses.
pub(crate) const LOSS: &str = "loss";
