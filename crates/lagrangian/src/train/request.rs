//! The request of a fit, and the automatic settings where it names none.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::task::Budget;
use lagrangian_mechanics::rigid::RobotConfig;
use lagrangian_motion::settings::Values;

/// A request for a fit, with the settings that a person gave.
///
/// ```
/// use lagrangian::train::{DataFacts, Request};
/// use serde_json::json;
///
/// let mut request = Request::of("lnn");
/// request.settings.insert("width".into(), json!(32));
/// let noisy = DataFacts { uncertainty: 0.03, ..DataFacts::default() };
/// let chosen = request.choose(&noisy)?;
/// let form = chosen.choices.iter().find(|choice| choice.setting == "form");
/// assert_eq!(form.map(|choice| choice.value.clone()), Some(json!("convex")));
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Request {
    /// The name of the family; `None` for the first of the table, or for several that are tried,
    /// see [`FitConfig::candidates`](crate::FitConfig::candidates).
    pub family: Option<String>,
    /// The settings of the family.
    pub settings: Values,
    /// The settings of the training, see [`SETTINGS`](crate::fit::SETTINGS).
    pub training: Values,
    /// The settings of the rollout loss, see [`ROLLOUT_SETTINGS`](crate::fit::ROLLOUT_SETTINGS).
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

impl Request {
    /// A request for a family, with nothing else given.
    #[must_use]
    pub fn of(family: &str) -> Self {
        Self {
            family: Some(family.into()),
            ..Self::default()
        }
    }
}

/// The name of the one setting of the training that a family chooses.
pub(crate) const LOSS: &str = "loss";
