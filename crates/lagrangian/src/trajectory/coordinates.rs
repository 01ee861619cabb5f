//! What the generalised coordinates are called and which space they live in.

use serde::{Deserialize, Serialize};

/// The space that one coordinate lives in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Topology {
    /// The real line.
    #[default]
    Line,
    /// The circle: q and q + 2π are the same configuration. A network sees cos q and sin q.
    Circle,
}

/// One generalised coordinate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Coordinate {
    /// Its name, e.g. `q1` or `theta1`.
    pub name: String,
    /// Its SI unit, e.g. `rad` or `m`.
    pub unit: String,
    /// Line or circle.
    #[serde(default)]
    pub topology: Topology,
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
        let coordinate = |i| Coordinate {
            name: format!("q{i}"),
            unit: unit.into(),
            topology,
        };
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
}
