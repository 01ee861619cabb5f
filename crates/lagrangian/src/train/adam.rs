//! First-order descent with adaptive moments.
//!
//! | symbol | meaning |
//! |---|---|
//! | m, v | running means of the gradient and of its square |
//! | β₁, β₂ | their memories |
//!
//! m ← β₁ m + (1 − β₁) g, v ← β₂ v + (1 − β₂) g², θ ← θ − η (m̂ / (√v̂ + ε) + w θ), with m̂, v̂ corrected for their
//! start (Kingma, Ba 2015; the decay w decoupled as in Loshchilov, Hutter 2019).

use serde::{Deserialize, Serialize};

use crate::mlp::simd::{AdamStep, dispatch};

/// Settings of Adam(W).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamConfig {
    /// Largest rate η; the schedule scales it.
    pub rate: f64,
    /// Memory β₁ of the gradient.
    pub beta1: f64,
    /// Memory β₂ of its square.
    pub beta2: f64,
    /// ε, which keeps the step finite.
    pub epsilon: f64,
    /// Decoupled weight decay w.
    pub decay: f64,
    /// Longest gradient; longer ones are shortened to it.
    pub clip: f64,
}

impl Default for AdamConfig {
    fn default() -> Self {
        Self {
            rate: 3e-3,
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            decay: 0.0,
            clip: 1.0,
        }
    }
}

/// The moments of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    pub(crate) first: Vec<f64>,
    pub(crate) second: Vec<f64>,
}

impl Adam {
    /// One step against `gradient` at `rate`; `step` counts from 0. A gradient that is not finite is ignored.
    pub(crate) fn step(
        &mut self,
        config: &AdamConfig,
        rate: f64,
        step: usize,
        gradient: &[f64],
        parameters: &mut [f64],
    ) {
        let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        if !norm.is_finite() {
            return;
        }
        let shorten = if norm > config.clip {
            config.clip / norm
        } else {
            1.0
        };
        let power = i32::try_from(step + 1).unwrap_or(i32::MAX);
        let (c1, c2) = (
            1.0 - config.beta1.powi(power),
            1.0 - config.beta2.powi(power),
        );
        dispatch(AdamStep {
            gradient,
            first: &mut self.first,
            second: &mut self.second,
            parameters,
            memory: [config.beta1, config.beta2],
            corrections: [1.0 / c1, 1.0 / c2],
            epsilon: config.epsilon,
            rate,
            decay: config.decay,
            shorten,
        });
    }
}
