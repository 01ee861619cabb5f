//! Angles of lines between two points, for recordings that hold positions in a plane.

use std::fmt::{self, Display};
use std::str::FromStr;

use lagrangian_motion::error::shortened;
use lagrangian_motion::{Error, Result};

/// A coordinate θ = atan2(y − y₀, x − x₀): the angle of a point from the x axis, about another point.
///
/// ```
/// let angle: lagrangian_recordings::Polar = "theta2=x2,y2@x1,y1".parse()?;
/// assert_eq!(angle.name, "theta2");
/// assert_eq!(angle.about, ["x1", "y1"]);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Polar {
    /// The name of the coordinate.
    pub name: String,
    /// The columns of the point, x and y.
    pub point: [String; 2],
    /// The columns of the point that it turns about, or numbers in the same unit.
    pub about: [String; 2],
}

impl Polar {
    /// Whether a column of this name belongs to one of its points.
    pub(super) fn reads(&self, name: &str) -> bool {
        self.point.iter().chain(&self.about).any(|own| own == name)
    }
}

impl FromStr for Polar {
    type Err = Error;

    /// Reads `name=x,y@x0,y0`; without `@x0,y0` the point turns about the origin.
    fn from_str(text: &str) -> Result<Self> {
        let pair = |text: &str| -> Option<[String; 2]> {
            let (x, y) = text.split_once(',')?;
            let names = [x.trim().to_owned(), y.trim().to_owned()];
            let whole = names
                .iter()
                .all(|n| !n.is_empty() && !n.contains([',', '@']));
            whole.then_some(names)
        };
        let parse = || {
            let (name, points) = text.split_once('=')?;
            let (point, about) = points.split_once('@').unwrap_or((points, "0,0"));
            let name = Some(name.trim().to_owned()).filter(|name| !name.is_empty())?;
            let (point, about) = (pair(point)?, pair(about)?);
            Some(Self { name, point, about })
        };
        parse().ok_or_else(|| {
            Error::layout(format_args!(
                "'{}' is not an angle of two points: write it as theta=x,y@x0,y0, with columns, or numbers after the @",
                shortened(text)
            ))
        })
    }
}

impl Display for Polar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (point, about) = (self.point.join(","), self.about.join(","));
        write!(f, "{}={point}@{about}", self.name)
    }
}

/// Indices of the points of an angle among the numbers of a row.
#[derive(Debug, Clone)]
pub(super) struct Points {
    /// Index of the angle, which holds x before.
    pub(super) at: usize,
    pub(super) y: usize,
    pub(super) about: [Place; 2],
}

/// A column, by its index, or a number.
#[derive(Debug, Clone, Copy)]
pub(super) enum Place {
    At(usize),
    Number(f64),
}

impl Points {
    /// The angle in a row that still holds x at its index.
    pub(super) fn angle(&self, values: &[f64]) -> f64 {
        let [x, y] = self.about.map(|place| match place {
            Place::At(k) => values[k],
            Place::Number(x) => x,
        });
        (values[self.y] - y).atan2(values[self.at] - x)
    }
}
