//! The columns: what is measured, and what counts as learned.

use super::contestants::Published;
use crate::harness::{Quantity, less};

/// The columns: key in JSON and in commands, heading, unit, the largest figure that counts, and what the figure is.
macro_rules! columns {
    ($($column:ident, $key:literal, $name:literal, $unit:literal, $threshold:expr, $meaning:literal;)*) => {
        /// A property that a family has or has not.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(super) enum Column {
            $($column),*
        }

        impl Column {
            pub(super) const ALL: [Self; 11] = [$(Self::$column),*];

            /// In the order of [`Column::ALL`].
            pub(super) const QUANTITIES: [Quantity; 11] = [$(less($key, $name, $unit)),*];

            /// What the figure is, and from where on it counts.
            pub(super) fn meaning(self) -> &'static str {
                match self {
                    $(Self::$column => $meaning),*
                }
            }

            /// The largest figure that counts.
            pub(super) fn threshold(self) -> Option<f64> {
                match self {
                    $(Self::$column => $threshold),*
                }
            }
        }
    };
}

columns! {
    Dynamics, "dynamics", "learns dynamics", "", Some(0.05),
        "error of q̈ on held-out motions of the double pendulum, relative, root mean square";
    Continuous, "continuous-time", "continuous time", "", Some(2.0),
        "largest error of motions with steps h/2, 2h and of any size over that with the step h of the data";
    Conservation, "conservation", "exact conservation", "", Some(0.01),
        "largest change of the true energy over 100 s, of its deviation in the data; counts only where the model's own \
         energy keeps to 1e-6";
    Coordinates, "coordinates", "arbitrary coordinates", "", Some(0.05),
        "largest error of q̈ of swings in three charts: their own, rotated and sheared, q = Q + 0.3 sin Q";
    Lagrangians, "lagrangians", "arbitrary Lagrangians", "", Some(0.05),
        "larger error of q̈ of the relativistic particle and of the charged one in a magnetic field; counts only for a \
         model that has an energy, and so a Lagrangian to learn";
    Accelerations, "no-accelerations", "without q̈", "", None,
        "whether a fit by the loss of this row accepts data without q̈ and ṗ";
    Torques, "no-torques", "without τ", "", None,
        "whether a fit accepts data without τ";
    Momenta, "no-momenta", "without p", "", None,
        "whether a fit accepts data without p";
    Noise, "noise", "5 % noise", "", Some(0.2),
        "error of q̈ where all that is learned from carries noise: 0.05 rad, and 5 % of velocities, accelerations, momenta and \
         their rates";
    Training, "training-time", "time to 5 %", "s", Some(60.0),
        "time until the error of q̈ is at 5 %";
    Call, "call-time", "one call", "µs", Some(100.0),
        "one evaluation of q̈ at one state, or of the flow for a model that moves in (q, p)";
}

impl Column {
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

    /// What is published of it.
    pub(super) fn published(self, row: &Published) -> Option<bool> {
        let known = PUBLISHED.contains(&self);
        known.then(|| row.properties.contains(&self))
    }
}

/// The properties of the table of Cranmer et al. 2020.
pub(super) const PUBLISHED: &[Column] = Column::ALL.split_at(5).0;

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
