//! Names and spaces of the generalised coordinates.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// The space of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Topology {
    /// The real line.
    #[default]
    Line,
    /// The circle: q and q + 2π are the same configuration. The inputs of a network are cos q and sin q.
    Circle,
    /// A line on which nothing moves, q̇ = 0: a mass, a length, the strength of a field. It is an input of a network, has no
    /// equation of motion, and is omitted from losses (theory.md, equation 107).
    Parameter,
}

/// One generalised coordinate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Coordinate {
    /// Its name, e.g. `q1` or `theta1`.
    pub name: String,
    /// Its SI unit, e.g. `rad` or `m`.
    pub unit: String,
    /// Line, circle or parameter.
    #[serde(default)]
    pub topology: Topology,
}

impl Coordinate {
    /// A coordinate with this name and SI unit.
    pub fn new(name: impl Into<String>, unit: &str, topology: Topology) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            topology,
        }
    }
}

/// The generalised coordinates of a system, declared once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Coordinates(pub Vec<Coordinate>);

impl Coordinates {
    /// `q1 … qn` on the line, in metres.
    #[must_use]
    pub fn lines(n: usize) -> Self {
        Self::numbered(n, "m", Topology::Line)
    }

    /// `q1 … qn` on the circle, in radians.
    #[must_use]
    pub fn angles(n: usize) -> Self {
        Self::numbered(n, "rad", Topology::Circle)
    }

    fn numbered(n: usize, unit: &str, topology: Topology) -> Self {
        let coordinate = |i| Coordinate::new(format!("q{i}"), unit, topology);
        Self((1..=n).map(coordinate).collect())
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.0.len()
    }

    /// Whether coordinate `i` is an angle on the circle.
    #[must_use]
    pub fn is_circle(&self, i: usize) -> bool {
        self.0[i].topology == Topology::Circle
    }

    /// a − b of coordinate `i`, the shorter way round for an angle.
    #[must_use]
    pub fn difference(&self, i: usize, a: f64, b: f64) -> f64 {
        let difference = a - b;
        match self.is_circle(i) {
            true => difference - TAU * (difference / TAU).round(),
            false => difference,
        }
    }

    /// Whether coordinate `i` is a parameter, which never moves.
    #[must_use]
    pub fn is_parameter(&self, i: usize) -> bool {
        self.0[i].topology == Topology::Parameter
    }

    /// The indices of the parameters among the coordinates.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.dof()).filter(|&i| self.is_parameter(i))
    }

    /// Checks that all `rates` (`[m, n]`, velocities or accelerations) of parameters are 0.
    ///
    /// # Errors
    /// [`Error::Moves`](crate::Error::Moves), which names the coordinate.
    pub fn check_parameters(&self, what: &str, rates: &[f64]) -> crate::Result<()> {
        let n = self.dof();
        for i in self.parameters() {
            let column = rates.iter().skip(i).step_by(n);
            if let Some(sample) = column.clone().position(|&x| x != 0.0) {
                return Err(crate::Error::Moves {
                    name: self.0[i].name.clone(),
                    what: what.into(),
                    sample: sample + 1,
                });
            }
        }
        Ok(())
    }
}
