//! Position and velocity of a system at one instant.

/// Generalised coordinates and velocities at one instant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    /// Generalised coordinates q, `[n]`.
    pub q: Vec<f64>,
    /// Generalised velocities q̇, `[n]`.
    pub qd: Vec<f64>,
}

impl State {
    /// The state (q, q̇).
    #[must_use]
    pub fn new(q: Vec<f64>, qd: Vec<f64>) -> Self {
        Self { q, qd }
    }
}
