//! The ends of a path.

use std::f64::consts::TAU;

use lagrangian::{Coordinates, Error, Result};

/// Both ends of a path: configurations and the time between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// Configuration q at time 0, `[n]`.
    pub from: Vec<f64>,
    /// Configuration q at time T, `[n]`; angles are unwrapped, so that it contains the turns of the path.
    pub to: Vec<f64>,
    /// Time T between the ends, s.
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
        let (first, last) = ("the first end of the path", "the last end of the path");
        for (what, x) in [(first, from), (last, to)] {
            if x.len() != n || n == 0 {
                let remedy = "give one value per coordinate";
                return Err(Error::shape(what, x.len(), n.max(1), remedy));
            }
            Error::check_finite(what, x)?;
        }
        if !(duration.is_finite() && duration > 0.0) {
            let must = "a finite number of seconds above 0";
            return Err(Error::argument("time between the ends", duration, must));
        }
        let moved = |i: &usize| from[*i].to_bits() != to[*i].to_bits();
        if let Some(i) = coordinates.parameters().find(moved) {
            let found = format!("{} for the parameter '{}'", to[i], coordinates.0[i].name);
            let must = "that of the first end: a parameter does not move";
            return Err(Error::argument(last, found, must));
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

    /// These ends with additional whole turns, `[n]`; negative ones turn in the other direction.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates; [`Error::Argument`] for turns of a coordinate on the line.
    pub fn winding(mut self, coordinates: &Coordinates, turns: &[i32]) -> Result<Self> {
        let remedy = "give one whole number per coordinate, 0 for the shorter arc";
        Error::check_shape("turns", turns.len(), self.to.len(), remedy)?;
        for (i, (to, &turns)) in self.to.iter_mut().zip(turns).enumerate() {
            if turns != 0 && !coordinates.is_circle(i) {
                let name = &coordinates.0[i].name;
                let found = format!("{turns} for '{name}', which is not an angle");
                let must = "0 for coordinates on the line";
                return Err(Error::argument("turns", found, must));
            }
            *to += TAU * f64::from(turns);
        }
        Ok(self)
    }
}
