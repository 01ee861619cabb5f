//! The settings of the natural gradient.

use serde::{Deserialize, Serialize};

use super::DampingRule;

/// The settings of the natural gradient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NaturalConfig {
    /// The rate η at the start; the schedule scales it.
    pub rate: f64,
    /// The momentum μ.
    pub momentum: f64,
    /// The damping λ at the start; every step multiplies it by √(mean |r| of its batch), at most 1.
    pub damping_first: f64,
    /// The damping λ at the end; it falls geometrically.
    pub damping_last: f64,
    /// The rule that the damping follows.
    pub damping_rule: DampingRule,
    /// The largest norm of a step η φ; longer steps are scaled down to it.
    pub longest: f64,
}

impl Default for NaturalConfig {
    fn default() -> Self {
        Self {
            rate: 0.5,
            momentum: 0.9,
            damping_first: 1e-1,
            damping_last: 1e-7,
            damping_rule: DampingRule::Schedule,
            longest: 1.0,
        }
    }
}
