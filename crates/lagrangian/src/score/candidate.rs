//! A model that was tried beside others.

use serde::{Deserialize, Serialize};

/// A model that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateResult {
    /// The family of the model.
    pub family: String,
    /// The squared error of its torques over their variance, mean over the joints, on held-out samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_nmse: Option<f64>,
    /// The duration of its fit, s.
    pub seconds: f64,
    /// The reason for a missing model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}
