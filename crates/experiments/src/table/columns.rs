//! The columns: what is measured, and what counts as learned.

use super::contestants::Published;
use crate::harness::{Quantity, less};

/// A property that a family has or has not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Column {
    Dynamics,
    Continuous,
    Conservation,
    Coordinates,
    Lagrangians,
    Accelerations,
    Torques,
    Momenta,
    Noise,
    Training,
    Call,
}

impl Column {
    pub(super) const ALL: [Self; 11] = [
        Self::Dynamics,
        Self::Continuous,
        Self::Conservation,
        Self::Coordinates,
        Self::Lagrangians,
        Self::Accelerations,
        Self::Torques,
        Self::Momenta,
        Self::Noise,
        Self::Training,
        Self::Call,
    ];

    /// Its name in JSON and in commands, its heading and its unit, in the order of [`Column::ALL`].
    #[rustfmt::skip]
    pub(super) const QUANTITIES: [Quantity; 11] = [
        less("dynamics", "learns dynamics", ""),
        less("continuous-time", "continuous time", ""),
        less("conservation", "exact conservation", ""),
        less("coordinates", "arbitrary coordinates", ""),
        less("lagrangians", "arbitrary Lagrangians", ""),
        less("no-accelerations", "without q̈", ""),
        less("no-torques", "without τ", ""),
        less("no-momenta", "without p", ""),
        less("noise", "5 % noise", ""),
        less("training-time", "time to 5 %", "s"),
        less("call-time", "one call", "µs"),
    ];

    fn quantity(self) -> &'static Quantity {
        &Self::QUANTITIES[self as usize]
    }

    pub(super) fn key(self) -> &'static str {
        self.quantity().key
    }

    /// Its heading.
    pub(super) fn name(self) -> &'static str {
        self.quantity().name
    }

    pub(super) fn unit(self) -> &'static str {
        self.quantity().unit
    }

    /// What the figure is, and from where on it counts.
    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Dynamics => {
                "error of q̈ on held-out motions of the double pendulum, relative, root mean square"
            }
            Self::Continuous => {
                "largest error of motions with steps h/2, 2h and of any size over that with the step h of the data"
            }
            Self::Conservation => {
                "largest change of the true energy over 100 s, of its deviation in the data; counts only where the model's own \
                 energy keeps to 1e-6"
            }
            Self::Coordinates => {
                "largest error of q̈ of swings in three charts: their own, rotated and sheared, q = Q + 0.3 sin Q"
            }
            Self::Lagrangians => {
                "larger error of q̈ of the relativistic particle and of the charged one in a magnetic field; counts only for a \
                 model that has an energy, and so a Lagrangian to learn"
            }
            Self::Accelerations => {
                "whether a fit by the loss of this row accepts data without q̈ and ṗ"
            }
            Self::Torques => "whether a fit accepts data without τ",
            Self::Momenta => "whether a fit accepts data without p",
            Self::Noise => {
                "error of q̈ where all that is learned from carries noise: 0.05 rad, and 5 % of velocities, accelerations, momenta and \
                 their rates"
            }
            Self::Training => "time until the error of q̈ is at 5 %",
            Self::Call => {
                "one evaluation of q̈ at one state, or of the flow for a model that moves in (q, p)"
            }
        }
    }

    /// The largest figure that counts.
    pub(super) fn threshold(self) -> Option<f64> {
        match self {
            Self::Dynamics | Self::Coordinates | Self::Lagrangians => Some(0.05),
            Self::Conservation => Some(0.01),
            Self::Continuous => Some(2.0),
            Self::Noise => Some(0.2),
            Self::Training => Some(60.0),
            Self::Call => Some(100.0),
            Self::Accelerations | Self::Torques | Self::Momenta => None,
        }
    }

    /// What is published of it.
    pub(super) fn published(self, row: &Published) -> Option<bool> {
        match self {
            Self::Dynamics => Some(row.dynamics),
            Self::Continuous => Some(row.continuous),
            Self::Conservation => Some(row.conservation),
            Self::Coordinates => Some(row.coordinates),
            Self::Lagrangians => Some(row.lagrangians),
            _ => None,
        }
    }
}

/// The largest change of a model's own energy that counts as none.
pub(super) const OWN_ENERGY: f64 = 1e-6;

/// What one seed found for one cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Measured {
    /// None where nothing could be measured; the note says why.
    pub(super) value: Option<f64>,
    /// Whether more than the threshold forbids a tick.
    pub(super) spoiled: bool,
    /// Whether a fit accepted the data, in columns that have no figure.
    pub(super) accepted: Option<bool>,
    /// More figures, by name.
    pub(super) figures: Vec<(&'static str, f64)>,
    /// Error of q̈ over the steps of the fit.
    pub(super) history: Vec<(usize, f64)>,
    pub(super) note: Option<String>,
}

impl Measured {
    pub(super) fn value(value: f64) -> Self {
        Self {
            value: value.is_finite().then_some(value),
            ..Self::default()
        }
    }

    /// Nothing, and why.
    pub(super) fn refused(reason: &dyn std::fmt::Display) -> Self {
        Self {
            note: Some(reason.to_string()),
            ..Self::default()
        }
    }

    /// Whether it counts, by the threshold of its column.
    pub(super) fn tick(&self, column: Column) -> bool {
        let below = |threshold| self.value.is_some_and(|x| x <= threshold);
        let counts = column.threshold().is_none_or(below);
        self.accepted.unwrap_or(counts) && !self.spoiled
    }
}
