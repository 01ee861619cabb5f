//! Points in Cartesian coordinates, joined by rods, rails and skates: masses and forces, learned beside given constraints.
//!
//! | file | content |
//! |---|---|
//! | `fields.rs` | potentials under constraints that are no formula |
//! | `inertia.rs` | masses, and what the points of a rigid body share |
//! | `points.rs` | the Lagrangian of the points |
//! | `radial.rs` | forces along the line between two points, or to the origin |
//! | `sources.rs` | sources of forces at places that are found |
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
mod sources;
mod start;
mod system;

use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use lagrangian_motion::{Constraint, Error, Result};

pub use points::{PointTerm, Points};
pub use radial::{Radial, RadialLaw};

/// The settings of points that constraints join.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CartesianConfig {
    /// The constraints between the coordinates; `None` for those that the data show.
    #[serde(deserialize_with = "read_constraints")]
    pub constraints: Option<Vec<Constraint>>,
    /// The coordinates of each point, two or three; a coordinate of none is a point of its own.
    pub points: Vec<Vec<usize>>,
}

/// What is found beside a constraint.
const FOUND_BESIDE: [&str; 5] = ["kind", "points", "length", "scatter", "noise"];

/// `"find"` or nothing, `"none"`, a list of constraints, or what `lagrangian constraints --json` prints, whole or its list.
fn read_constraints<'de, D: Deserializer<'de>>(
    from: D,
) -> std::result::Result<Option<Vec<Constraint>>, D::Error> {
    let own = |value: Value| serde_json::from_value::<Constraint>(value);
    let mut value = Value::deserialize(from)?;
    for name in ["structure", "constraints"] {
        if let Some(inner) = value.get_mut(name) {
            value = inner.take();
        }
    }
    match value {
        Value::Null => Ok(None),
        Value::String(name) if name == "find" => Ok(None),
        Value::String(name) if name == "none" => Ok(Some(Vec::new())),
        Value::Array(all) => {
            let each = all.into_iter().map(|mut each| {
                if let Some(inner) = each.get_mut("constraint") {
                    return own(inner.take());
                }
                // In Python what was found beside a constraint is among its entries.
                if let Some(entries) = each.as_object_mut() {
                    FOUND_BESIDE
                        .iter()
                        .for_each(|name| drop(entries.remove(*name)));
                }
                own(each)
            });
            let all: serde_json::Result<_> = each.collect();
            all.map(Some).map_err(serde::de::Error::custom)
        }
        _ => Err(serde::de::Error::custom(
            "constraints are `find`, `none`, or a list as `lagrangian constraints --json` prints it",
        )),
    }
}

/// The largest number of coordinates.
const MOST_COORDINATES: usize = 64;

impl CartesianConfig {
    /// The constraints that are given.
    pub(crate) fn known(&self) -> &[Constraint] {
        self.constraints.as_deref().unwrap_or_default()
    }

    /// The points of `n` coordinates, with those that the settings omit.
    ///
    /// # Errors
    /// [`Error::Argument`] for points of other coordinates, or that share one; as [`Constraint::check`].
    pub(crate) fn all_points(&self, n: usize) -> Result<Vec<Vec<usize>>> {
        if n > MOST_COORDINATES {
            let must = "at most 64: choose the columns of fewer points";
            return Err(Error::argument("number of coordinates", n, must));
        }
        self.known().iter().try_for_each(|own| own.check(n))?;
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
