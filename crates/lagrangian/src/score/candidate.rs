//! A model that was tried beside others.

use serde::{Deserialize, Serialize};

/// A model that was tried.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CandidateResult {
    /// The family of the model.
    pub family: String,
    /// Its name among those that were tried, with what distinguishes it from others of its family.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The squared error of its torques over their variance, mean over the joints, on held-out samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_nmse: Option<f64>,
    /// The squared error of its accelerations over their mean square, mean over the coordinates, on held-out samples by their weight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration_nmse: Option<f64>,
    /// The duration of its fit, s.
    pub seconds: f64,
    /// The reason for a missing model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl CandidateResult {
    /// The name of the model, and its held-out error, of torques or else of accelerations.
    #[must_use]
    pub fn shown(&self) -> (&str, Option<f64>) {
        let name = match &*self.name {
            "" => &*self.family,
            name => name,
        };
        (name, self.torque_nmse.or(self.acceleration_nmse))
    }
    /// The names of the models and their errors, with this number of decimals.
    pub(crate) fn list(tried: &[Self], decimals: usize) -> String {
        let own = |own: &Self| match own.shown() {
            (name, Some(error)) => format!("{name} {error:.decimals$e}"),
            (name, None) => format!("{name} failed"),
        };
        tried.iter().map(own).collect::<Vec<_>>().join(", ")
    }
}
