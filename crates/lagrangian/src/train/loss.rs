//! Losses: a target, a norm of its errors, and a weighting of the samples.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use lagrangian_mechanics::integrate::Rule;
use lagrangian_motion::{Error, Result};

/// A loss that training minimises.
///
/// ```
/// use lagrangian::Loss;
/// use lagrangian::train::Norm;
///
/// let robust: Loss = "torque-l1".parse()?;
/// assert_eq!(robust, Loss { norm: Norm::Absolute, ..Loss::TORQUE });
/// assert_eq!(robust.name(), "torque-l1");
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// The quantity that is compared with the data.
    pub target: Target,
    /// The norm of an error.
    pub norm: Norm,
    /// The weighting of the samples.
    pub weighting: Weighting,
}

/// The quantity that a loss compares with the data, each coordinate in units of its deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Accelerations q̈.
    Acceleration,
    /// Forces τ, which must be recorded; no inverse of M is needed.
    Torque,
    /// Forces and accelerations, for a model of both inverse and forward dynamics.
    TorqueAcceleration,
    /// Forces τ and the power τ·q̇ in units of its deviation, so that the balance of energy weighs as much as a
    /// coordinate.
    TorquePower,
    /// States after some steps of an integrator, see [`RolloutLoss`](super::RolloutLoss).
    Rollout,
    /// The last of three neighbouring positions, by the discrete Euler–Lagrange equation of this rule: no velocities are
    /// needed.
    Positions(Rule),
}

/// The norm of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The square of the error.
    Squared,
    /// The absolute value of the error, for which outliers weigh little (Cranmer et al. 2020).
    Absolute,
}

/// The weighting of the samples of a loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// All samples weigh the same.
    Uniform,
    /// Slow motion counts as much as fast motion: each sample is divided by √(⅒ + mean over the coordinates of (q̈ in units of
    /// its deviation)²).
    Relative,
}

/// A loss that can be chosen by its name.
#[derive(Debug, Clone, Copy)]
pub struct NamedLoss {
    /// The name on the command line and in files.
    pub name: &'static str,
    /// The loss.
    pub loss: Loss,
    /// A description in one line.
    pub about: &'static str,
}

const fn named(name: &'static str, loss: Loss, about: &'static str) -> NamedLoss {
    NamedLoss { name, loss, about }
}

impl Default for Loss {
    fn default() -> Self {
        Self::ACCELERATION
    }
}

impl Loss {
    /// Squared errors of q̈.
    pub const ACCELERATION: Self = Self::squared(Target::Acceleration);
    /// Squared errors of q̈ relative to its size.
    pub const ACCELERATION_RELATIVE: Self = Self {
        weighting: Weighting::Relative,
        ..Self::ACCELERATION
    };
    /// Absolute errors of q̈.
    pub const ACCELERATION_L1: Self = Self {
        norm: Norm::Absolute,
        ..Self::ACCELERATION
    };
    /// Squared errors of τ.
    pub const TORQUE: Self = Self::squared(Target::Torque);
    /// Absolute errors of τ.
    pub const TORQUE_L1: Self = Self {
        norm: Norm::Absolute,
        ..Self::TORQUE
    };
    /// Squared errors of τ and of q̈.
    pub const TORQUE_ACCELERATION: Self = Self::squared(Target::TorqueAcceleration);
    /// Squared errors of τ and of the power τ·q̇.
    pub const TORQUE_POWER: Self = Self::squared(Target::TorquePower);
    /// Squared errors of states after some steps of an integrator.
    pub const ROLLOUT: Self = Self::squared(Target::Rollout);
    /// Squared errors of positions by the midpoint rule.
    pub const POSITIONS: Self = Self::squared(Target::Positions(Rule::Midpoint));
    /// Squared errors of positions by the trapezoidal rule, which is Störmer–Verlet where M is constant.
    pub const POSITIONS_TRAPEZOIDAL: Self = Self::squared(Target::Positions(Rule::Trapezoidal));

    /// The losses of accelerations and of torques, one of them at a time, and that of rollouts.
    pub(crate) const SINGLE: &'static [Self] = &[
        Self::ACCELERATION,
        Self::ACCELERATION_RELATIVE,
        Self::ACCELERATION_L1,
        Self::TORQUE,
        Self::TORQUE_L1,
        Self::ROLLOUT,
    ];

    /// All losses that can be chosen.
    pub const ALL: [NamedLoss; 10] = [
        named(
            "acceleration",
            Self::ACCELERATION,
            "mean squared error of q̈",
        ),
        named(
            "acceleration-relative",
            Self::ACCELERATION_RELATIVE,
            "mean squared error of q̈ relative to its size, so that slow motion counts as much as fast",
        ),
        named(
            "acceleration-l1",
            Self::ACCELERATION_L1,
            "mean absolute error of q̈",
        ),
        named(
            "torque",
            Self::TORQUE,
            "mean squared error of τ; needs no inverse of the mass matrix",
        ),
        named(
            "torque-l1",
            Self::TORQUE_L1,
            "mean absolute error of τ: outliers weigh little",
        ),
        named(
            "torque-acceleration",
            Self::TORQUE_ACCELERATION,
            "squares of both (delan)",
        ),
        named(
            "torque-power",
            Self::TORQUE_POWER,
            "squared errors of τ and of the power τ·q̇ (delan)",
        ),
        named(
            "positions",
            Self::POSITIONS,
            "mean squared error of the last of three neighbouring positions, by the discrete action of the midpoint rule: no velocities are needed (lnn, delan, vin)",
        ),
        named(
            "positions-trapezoidal",
            Self::POSITIONS_TRAPEZOIDAL,
            "the same by the trapezoidal rule, which is Störmer–Verlet where M is constant",
        ),
        named(
            "rollout",
            Self::ROLLOUT,
            "mean squared error of states after some steps of an integrator; needs no accelerations",
        ),
    ];

    const fn squared(target: Target) -> Self {
        Self {
            target,
            norm: Norm::Squared,
            weighting: Weighting::Uniform,
        }
    }

    /// The name on the command line and in files; `other` for a combination without a name.
    #[must_use]
    pub fn name(self) -> &'static str {
        let entry = Self::ALL.into_iter().find(|entry| entry.loss == self);
        entry.map_or("other", |entry| entry.name)
    }

    /// Whether the loss compares forces, which must then be recorded.
    #[must_use]
    pub fn needs_forces(self) -> bool {
        matches!(
            self.target,
            Target::Torque | Target::TorqueAcceleration | Target::TorquePower
        )
    }

    /// The rule that discretises the action, for a loss of positions alone.
    #[must_use]
    pub fn rule(self) -> Option<Rule> {
        match self.target {
            Target::Positions(rule) => Some(rule),
            _ => None,
        }
    }

    /// Whether the loss compares accelerations, for which M is inverted.
    #[must_use]
    pub fn inverts(self) -> bool {
        !self.needs_forces() || self.target == Target::TorqueAcceleration
    }

    /// Residuals of a sample of `n` coordinates.
    pub(crate) fn residuals(self, n: usize) -> usize {
        match self.target {
            Target::TorqueAcceleration => 2 * n,
            Target::TorquePower => n + 1,
            _ => n,
        }
    }

    /// The weight of a sample with accelerations `qdd`, given the weights of the coordinates.
    pub(crate) fn sample_weight(self, qdd: &[f64], weights: &[f64]) -> f64 {
        if self.weighting == Weighting::Uniform {
            return 1.0;
        }
        let squares: f64 = qdd.iter().zip(weights).map(|(a, w)| (a * w).powi(2)).sum();
        let moving = weights.iter().filter(|w| **w != 0.0).count().max(1);
        1.0 / (0.1 + squares / moving as f64).sqrt()
    }

    /// Whether absolute values are minimised.
    pub(crate) fn is_absolute(self) -> bool {
        self.norm == Norm::Absolute
    }

    /// The value of one residual.
    pub(crate) fn of(self, r: f64) -> f64 {
        if self.is_absolute() { r.abs() } else { r * r }
    }

    /// The derivative of that value.
    pub(crate) fn slope(self, r: f64) -> f64 {
        if self.is_absolute() {
            r.signum()
        } else {
            2.0 * r
        }
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Loss {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let entry = Self::ALL.into_iter().find(|entry| entry.name == name);
        entry
            .map(|entry| entry.loss)
            .ok_or_else(|| Error::UnknownName {
                kind: "loss",
                name: name.into(),
                known: Self::ALL.map(|entry| entry.name).join(", "),
            })
    }
}

impl Serialize for Loss {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Loss {
    fn deserialize<D: serde::Deserializer<'de>>(
        deserializer: D,
    ) -> std::result::Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        name.parse().map_err(serde::de::Error::custom)
    }
}
