//! Rules for the damping λ of the natural gradient.

use serde::{Deserialize, Serialize};

use super::NaturalConfig;

/// The rule for λ. Under any rule a step multiplies λ by √(mean |r|) of its batch, at most 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "name")]
pub enum DampingRule {
    /// λ falls geometrically from its first value to its last over the budget.
    #[default]
    Schedule,
    /// λ = `factor` · mean r² of the batch, at most that of the schedule (Fan, Yuan 2005, Computing 74).
    Loss {
        /// The ratio of λ to the loss.
        factor: f64,
    },
    /// λ begins at its first value; it is multiplied by `factor` < 1 where the loss of the batch falls by more than ¾ of what
    /// the quadratic model predicts, and divided by it where it falls by less than ¼ (Levenberg 1944, Marquardt 1963). Without
    /// a prediction (the rollout loss, fields, single steps) λ follows the schedule.
    Adaptive {
        /// The factor of a step.
        factor: f64,
    },
}

/// The smallest λ: below it J Jᵀ loses rank by rounding.
const LEAST: f64 = 1e-11;
/// The largest adaptive λ.
const LARGEST: f64 = 10.0;

impl DampingRule {
    /// λ after a step that lowered the loss by `gain` times the predicted decrease.
    pub(crate) fn adapted(self, damping: f64, gain: f64) -> f64 {
        let Self::Adaptive { factor } = self else {
            return damping;
        };
        let damping = if gain > 0.75 {
            damping * factor
        } else if gain < 0.25 || gain.is_nan() {
            damping / factor
        } else {
            damping
        };
        damping.clamp(LEAST, LARGEST)
    }

    /// λ on a batch whose mean r² is `mean_square`.
    pub(super) fn on_batch(self, damping: f64, mean_square: f64) -> f64 {
        match self {
            Self::Loss { factor } if mean_square.is_finite() => {
                damping.min((factor * mean_square).max(LEAST))
            }
            _ => damping,
        }
    }
}

impl NaturalConfig {
    /// The settings for [`DampingRule::Adaptive`]: best for the shortest fits, with a growing batch (ADR 0050).
    #[must_use]
    pub fn adaptive() -> Self {
        Self {
            damping_rule: DampingRule::Adaptive { factor: 0.8 },
            ..Self::default()
        }
    }

    /// The settings for [`DampingRule::Loss`]: best for fits by time, with 128 samples a step (ADR 0050).
    #[must_use]
    pub fn following_the_loss() -> Self {
        Self {
            damping_last: 1e-1,
            damping_rule: DampingRule::Loss { factor: 1.0 },
            ..Self::default()
        }
    }

    /// λ of a step at this part of the budget; `adapted` is the present value of an adaptive rule.
    pub(crate) fn damping(&self, share: f64, setbacks: i32, adapted: Option<f64>) -> f64 {
        match self.damping_rule {
            DampingRule::Adaptive { .. } => {
                adapted.unwrap_or(self.damping_first) * 10f64.powi(setbacks)
            }
            _ => self.scheduled(share, setbacks),
        }
    }

    /// λ by the schedule, under any rule.
    #[must_use]
    pub fn scheduled(&self, share: f64, setbacks: i32) -> f64 {
        let fall = (self.damping_last / self.damping_first).powf(share);
        self.damping_first * fall * 10f64.powi(setbacks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_falls_while_the_model_foresees_the_loss_and_rises_where_it_does_not() {
        let rule = DampingRule::Adaptive { factor: 0.5 };
        assert!((rule.adapted(1e-2, 0.9) - 5e-3).abs() < 1e-18);
        assert!((rule.adapted(1e-2, 0.5) - 1e-2).abs() < 1e-18);
        for poor in [0.1, -3.0, f64::NAN] {
            assert!((rule.adapted(1e-2, poor) - 2e-2).abs() < 1e-18);
        }
        assert!(rule.adapted(LEAST, 1.0) >= LEAST && rule.adapted(LARGEST, 0.0) <= LARGEST);
    }

    #[test]
    fn damping_that_follows_the_loss_is_never_above_the_schedule_nor_below_rounding() {
        let rule = DampingRule::Loss { factor: 1.0 };
        for (loss, expected) in [(5.0, 0.1), (1e-4, 1e-4), (0.0, LEAST), (f64::NAN, 0.1)] {
            assert!(
                (rule.on_batch(0.1, loss) - expected).abs() < 1e-18,
                "{loss}"
            );
        }
    }
}
