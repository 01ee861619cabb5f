//! Options of the preparation of recordings before a fit.

use lagrangian_recordings::EstimateOptions;
use serde::{Deserialize, Serialize};

/// Options of the preparation of recordings before a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PrepareOptions {
    /// Replace measured q and q̇ by their local polynomials.
    pub smooth: bool,
    /// The cut-off of a low-pass of all signals, Hz; 0 for none, `None` for the one that the check suggests where noise spoils
    /// the accelerations.
    pub low_pass: Option<f64>,
    /// The distance of the neighbours of a loss of positions, in samples.
    pub baseline: usize,
    /// The part of the trajectories that is held back where no others are given to validate on.
    pub validate_fraction: f64,
    /// The delays of the forces, s: one for all coordinates, one for each, or none.
    pub delay: Vec<f64>,
    /// The names of the cyclic coordinates, on which no network may depend; `find` for those that the data show, `none` for none. Where it
    /// is empty they are found if several families are tried, and none otherwise.
    pub cyclic: Vec<String>,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            smooth: false,
            low_pass: None,
            baseline: 1,
            validate_fraction: 0.2,
            delay: Vec::new(),
            cyclic: Vec::new(),
        }
    }
}

impl PrepareOptions {
    /// Whether nothing was given.
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The options by which signals that were not measured are estimated.
    #[must_use]
    pub fn estimates(&self) -> EstimateOptions {
        EstimateOptions {
            smooth: self.smooth,
            low_pass: self.low_pass.filter(|hertz| *hertz > 0.0),
            momenta: false,
            ..EstimateOptions::default()
        }
    }
}
