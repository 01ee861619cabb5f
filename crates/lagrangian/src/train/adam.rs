//! First-order descent with adaptive moments.
//!
//! | symbol | meaning |
//! |---|---|
//! | m, v | running means of the gradient and of its square |
//! | β₁, β₂ | their decay rates |
//!
//! m ← β₁ m + (1 − β₁) g, v ← β₂ v + (1 − β₂) g², θ ← θ − η (m̂ / (√v̂ + ε) + w θ), with m̂, v̂ corrected for their
//! start (Kingma, Ba 2015; the decay w decoupled as in Loshchilov, Hutter 2019).

use serde::{Deserialize, Serialize};

use super::problem::{Differentiable, GradientSize, LossValue, StepAt};
use nets::simd::{AdamRule, AdamStep, dispatch};

/// The precision in which a network is evaluated while it is trained with Adam; all else is in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    F32,
    /// Double precision.
    #[default]
    F64,
}

/// The settings of Adam with decoupled weight decay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamConfig {
    /// The rate η at the start; the schedule scales it.
    pub rate: f64,
    /// The decay rate β₁ of the first moment.
    pub beta1: f64,
    /// The decay rate β₂ of the second moment.
    pub beta2: f64,
    /// The ε that keeps a step finite.
    pub epsilon: f64,
    /// The decoupled weight decay w.
    pub decay: f64,
    /// The largest norm of a gradient; larger ones are scaled down to it.
    pub clip: f64,
    /// The precision of the kernels.
    pub precision: Precision,
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
            precision: Precision::default(),
        }
    }
}

impl AdamConfig {
    /// The rule for step `step`, which counts from 0, at `rate`, for a gradient with this sum of squares; `None` where
    /// that is not finite.
    pub(crate) fn rule(&self, rate: f64, step: usize, squares: f64) -> Option<AdamRule> {
        let norm = squares.sqrt();
        let power = i32::try_from(step + 1).unwrap_or(i32::MAX);
        let correction = |memory: f64| 1.0 / (1.0 - memory.powi(power));
        norm.is_finite().then(|| AdamRule {
            memory: [self.beta1, self.beta2],
            corrections: [correction(self.beta1), correction(self.beta2)],
            epsilon: self.epsilon,
            rate,
            decay: self.decay,
            shorten: if norm > self.clip {
                self.clip / norm
            } else {
                1.0
            },
        })
    }
}

impl AdamConfig {
    /// One step at `rate`; returns the loss before it. A gradient that is not finite is ignored.
    pub(crate) fn step(
        &self,
        problem: &mut dyn Differentiable,
        at: &StepAt<'_>,
        rate: f64,
    ) -> LossValue {
        let GradientSize { loss, squares } = problem.gradient(at);
        if let Some(rule) = self.rule(rate, at.step, squares) {
            problem.descend(&rule);
        }
        loss
    }
}

/// The moments of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    pub(crate) first: Vec<f64>,
    pub(crate) second: Vec<f64>,
}

impl Adam {
    /// Zero moments of `parameters` parameters, as before the first step.
    pub(crate) fn zeros(parameters: usize) -> Self {
        Self {
            first: vec![0.0; parameters],
            second: vec![0.0; parameters],
        }
    }

    /// One step by a rule against `gradient`.
    pub(crate) fn apply(&mut self, rule: AdamRule, gradient: &[f64], parameters: &mut [f64]) {
        dispatch(AdamStep {
            gradient,
            first: &mut self.first,
            second: &mut self.second,
            weights: parameters,
            rounded: None,
            rule,
            lowest: f64::NEG_INFINITY,
        });
    }
}
