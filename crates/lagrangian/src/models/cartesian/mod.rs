//! Points in Cartesian coordinates, joined by rods, rails and skates: masses and forces, learned beside given constraints.
//!
//! | file | content |
//! |---|---|
//! | `fields.rs` | potentials under constraints that are no formula |
//! | `inertia.rs` | masses, and what the points of a rigid body share |
//! | `points.rs` | the Lagrangian of the points |
//! | `radial.rs` | forces along the line between two points, or to the origin |
//! | `start.rs` | which forces there are between points that nothing holds, and their masses, by rows that need no velocity |
//! | `system.rs` | accelerations under constraints, and how they change with state and parameters |
//! | `shooting.rs` | masses and coefficients by simulations whose starts are free, with standard errors |
//! | `search.rs` | which forces there are: a start by least squares, terms that are missing or nothing |
//! | `family.rs` | the data of the family, its saved form, its row of the table |

pub(crate) mod family;
mod fields;
mod inertia;
mod points;
mod radial;
mod search;
mod shooting;
mod start;
mod system;

use serde::{Deserialize, Serialize};

use lagrangian_motion::{Constraint, Error, Result};

pub use points::{PointTerm, Points};
pub use radial::{Radial, RadialLaw};

/// The settings of points that constraints join.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CartesianConfig {
    /// The constraints between the coordinates.
    pub constraints: Vec<Constraint>,
    /// The coordinates of each point, two or three; a coordinate of none is a point of its own.
    pub points: Vec<Vec<usize>>,
}

/// The largest number of coordinates.
const MOST_COORDINATES: usize = 64;

impl CartesianConfig {
    /// The points of `n` coordinates, with those that the settings omit.
    ///
    /// # Errors
    /// [`Error::Argument`] for points of other coordinates, or that share one; as [`Constraint::check`].
    pub(crate) fn all_points(&self, n: usize) -> Result<Vec<Vec<usize>>> {
        if n > MOST_COORDINATES {
            let must = "at most 64: choose the columns of fewer points";
            return Err(Error::argument("number of coordinates", n, must));
        }
        self.constraints.iter().try_for_each(|own| own.check(n))?;
        let mut points = self.points.clone();
        let mut used = vec![false; n];
        for at in points.iter().flatten() {
            if *at >= n || std::mem::replace(&mut used[*at], true) {
                let must = "of these coordinates, counted from 0, each of one point at most";
                return Err(Error::argument("points", at, must));
            }
        }
        if let Some(point) = points.iter().find(|own| !(1..=3).contains(&own.len())) {
            let must = "of one to three coordinates each";
            return Err(Error::argument("points", format!("{point:?}"), must));
        }
        points.extend((0..n).filter(|i| !used[*i]).map(|i| vec![i]));
        Ok(points)
    }
}
