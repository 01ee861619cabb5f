//! The parameters of a system: names, units, defaults and domains.

use lagrangian_motion::{Error, Result};

/// The values that a parameter may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// Finite and > 0.
    Positive,
    /// Finite and ≥ 0.
    NotNegative,
    /// Finite.
    Finite,
    /// A whole number from 1 to 32.
    Count,
    /// 2 or 3.
    PlanarOrSpatial,
}

/// One parameter of a system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name of the parameter.
    pub name: &'static str,
    /// SI unit; empty for pure numbers.
    pub unit: &'static str,
    /// Default value.
    pub value: f64,
    /// Values that the parameter may take.
    pub domain: Domain,
}

impl Parameter {
    const fn new(name: &'static str, unit: &'static str, value: f64, domain: Domain) -> Self {
        Self {
            name,
            unit,
            value,
            domain,
        }
    }

    /// A parameter above 0.
    #[must_use]
    pub const fn positive(name: &'static str, unit: &'static str, value: f64) -> Self {
        Self::new(name, unit, value, Domain::Positive)
    }

    /// A parameter that may be 0 or above.
    #[must_use]
    pub const fn not_negative(name: &'static str, unit: &'static str, value: f64) -> Self {
        Self::new(name, unit, value, Domain::NotNegative)
    }

    /// A parameter that may be any finite number.
    #[must_use]
    pub const fn finite(name: &'static str, unit: &'static str, value: f64) -> Self {
        Self::new(name, unit, value, Domain::Finite)
    }

    /// A whole number of bodies or links, from 1 to 32.
    #[must_use]
    pub const fn count(name: &'static str, value: f64) -> Self {
        Self::new(name, "", value, Domain::Count)
    }

    /// The number of dimensions of space, 2 or 3.
    #[must_use]
    pub const fn planar_or_spatial(name: &'static str) -> Self {
        Self::new(name, "", 2.0, Domain::PlanarOrSpatial)
    }

    /// Checks that a value is in the domain.
    ///
    /// # Errors
    /// [`Error::Argument`] for a value outside the domain.
    pub fn check(&self, value: f64) -> Result<()> {
        let whole = value.fract() == 0.0;
        let (fits, must) = match self.domain {
            Domain::Positive => (value.is_finite() && value > 0.0, "a finite number above 0"),
            Domain::NotNegative => (
                value.is_finite() && value >= 0.0,
                "a finite number, 0 or above",
            ),
            Domain::Finite => (value.is_finite(), "a finite number"),
            Domain::Count => (
                whole && (1.0..=32.0).contains(&value),
                "a whole number from 1 to 32",
            ),
            Domain::PlanarOrSpatial => (whole && (2.0..=3.0).contains(&value), "2 or 3"),
        };
        if fits {
            return Ok(());
        }
        Err(Error::argument(self.name, value, must))
    }
}
