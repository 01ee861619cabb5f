//! The ends of a path.

use std::f64::consts::TAU;

use lagrangian::{Coordinates, Error, Result};

/// The two ends of a path: configurations and the time between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// The configuration q at time 0, `[n]`.
    pub from: Vec<f64>,
    /// The configuration q at time T, `[n]`; angles are unwrapped, so that it contains the turns of the path.
    pub to: Vec<f64>,
    /// The time T between the ends, s.
    pub duration: f64,
}

impl Boundary {
    /// The ends `from` and `to`; angles on the circle take the shorter arc.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates; [`Error::NotFinite`]; [`Error::Argument`] for a time that
    /// is not positive, or a parameter that moves.
    pub fn new(coordinates: &Coordinates, from: &[f64], to: &[f64], duration: f64) -> Result<Self> {
        let n = coordinates.dof();
        for (what, x) in [
            ("the first end of the path", from),
            ("the last end of the path", to),
        ] {
            if x.len() != n || n == 0 {
                return Err(Error::Shape {
                    what: what.into(),
                    found: x.len(),
                    expected: n.max(1),
                    remedy: "give one value per coordinate".into(),
                });
            }
            if let Some(index) = x.iter().position(|x| !x.is_finite()) {
                let what = what.into();
                return Err(Error::NotFinite { what, index });
            }
        }
        if !(duration.is_finite() && duration > 0.0) {
            return Err(Error::Argument {
                name: "time between the ends",
                value: duration.to_string(),
                must: "a finite number of seconds above 0",
            });
        }
        if let Some(i) = coordinates
            .parameters()
            .find(|&i| from[i].to_bits() != to[i].to_bits())
        {
            return Err(Error::Argument {
                name: "the last end of the path",
                value: format!("{} for the parameter '{}'", to[i], coordinates.0[i].name),
                must: "that of the first end: a parameter does not move",
            });
        }
        let shorter = |(i, (&a, &b)): (usize, (&f64, &f64))| match coordinates.is_circle(i) {
            true => a + (b - a) - TAU * ((b - a) / TAU).round(),
            false => b,
        };
        Ok(Self {
            from: from.to_vec(),
            to: from.iter().zip(to).enumerate().map(shorter).collect(),
            duration,
        })
    }

    /// The same ends with additional whole turns, `[n]`; negative ones turn in the other direction.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates; [`Error::Argument`] for turns of a coordinate on the line.
    pub fn winding(mut self, coordinates: &Coordinates, turns: &[i32]) -> Result<Self> {
        if turns.len() != self.to.len() {
            return Err(Error::Shape {
                what: "turns".into(),
                found: turns.len(),
                expected: self.to.len(),
                remedy: "give one whole number per coordinate, 0 for the shorter arc".into(),
            });
        }
        for (i, (to, &turns)) in self.to.iter_mut().zip(turns).enumerate() {
            if turns != 0 && !coordinates.is_circle(i) {
                return Err(Error::Argument {
                    name: "turns",
                    value: format!("{turns} for '{}', which is no angle", coordinates.0[i].name),
                    must: "0 for coordinates on the line",
                });
            }
            *to += TAU * f64::from(turns);
        }
        Ok(self)
    }

    /// Degrees of freedom.
    pub(crate) fn dof(&self) -> usize {
        self.from.len()
    }
}
