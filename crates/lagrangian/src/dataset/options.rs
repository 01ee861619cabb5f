//! Options of the preparation of recordings before a fit.

use lagrangian_recordings::EstimateOptions;

/// Options of the preparation of recordings before a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Whether the forces have been shifted in time.
    pub delayed: bool,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            smooth: false,
            low_pass: None,
            baseline: 1,
            validate_fraction: 0.2,
            delayed: false,
        }
    }
}

impl PrepareOptions {
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
