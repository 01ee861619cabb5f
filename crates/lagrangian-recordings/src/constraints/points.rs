//! Which coordinates are those of one point in space.

use std::collections::BTreeMap;

use lagrangian_motion::{Coordinates, Topology};
use serde::Serialize;

/// A point: its name, and its coordinates x, y or x, y, z.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Point {
    /// Its name, such as `p1`.
    pub name: String,
    /// The indices of its coordinates.
    pub axes: Vec<usize>,
}

impl Point {
    /// The points of coordinates that are named by them (`p1x`, `p1_y`, `x1`, `left.z`): each takes the place and the axis of its name.
    /// Angles and coordinates of other names belong to no point.
    #[must_use]
    pub fn named(coordinates: &Coordinates) -> Vec<Self> {
        let mut points: Vec<(String, BTreeMap<char, usize>)> = Vec::new();
        for (i, coordinate) in coordinates.0.iter().enumerate() {
            let named = place_and_axis(&coordinate.name);
            let Some((stem, axis)) = named.filter(|_| coordinate.topology == Topology::Line) else {
                continue;
            };
            let known = points.iter().position(|(own, _)| *own == stem);
            let at = known.unwrap_or_else(|| {
                points.push((stem, BTreeMap::new()));
                points.len() - 1
            });
            points[at].1.entry(axis).or_insert(i);
        }
        let several = points.into_iter().filter(|(_, axes)| axes.len() > 1);
        let point = |(name, axes): (String, BTreeMap<char, usize>)| Self {
            name,
            axes: axes.into_values().collect(),
        };
        several.map(point).collect()
    }

    /// A point of these coordinates, named by them.
    #[must_use]
    pub fn of(coordinates: &Coordinates, axes: Vec<usize>) -> Self {
        let names = axes.iter().filter_map(|i| coordinates.0.get(*i));
        let names: Vec<&str> = names.map(|own| &*own.name).collect();
        Self {
            name: format!("({})", names.join(", ")),
            axes,
        }
    }

    /// The points of coordinates in turn, so many for each.
    #[must_use]
    pub fn in_turn(coordinates: &Coordinates, axes: usize) -> Vec<Self> {
        let all: Vec<usize> = (0..coordinates.dof()).collect();
        let point = |(k, axes): (usize, &[usize])| Self {
            name: format!("p{}", k + 1),
            axes: axes.to_vec(),
        };
        all.chunks_exact(axes.max(1))
            .enumerate()
            .map(point)
            .collect()
    }
}

/// The name of a point and its axis, from the name of a coordinate.
fn place_and_axis(name: &str) -> Option<(String, char)> {
    let is_axis = |c: char| "xyzXYZ".contains(c);
    let trim = |stem: &str| {
        let stem = stem.trim_matches(['_', '.', '-', ' ']);
        let named = stem.chars().any(char::is_alphabetic);
        if named {
            stem.to_owned()
        } else {
            format!("p{stem}")
        }
    };
    let (first, last) = (name.chars().next()?, name.chars().next_back()?);
    match (is_axis(last), is_axis(first)) {
        (true, _) => Some((trim(&name[..name.len() - 1]), last.to_ascii_lowercase())),
        (_, true) => Some((trim(&name[1..]), first.to_ascii_lowercase())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lagrangian_motion::Coordinate;

    #[test]
    fn points_are_found_in_the_names_of_their_coordinates() {
        let of = |names: &[&str]| {
            let named = |name: &&str| Coordinate::new(*name, "m", Topology::Line);
            let points = Point::named(&Coordinates(names.iter().map(named).collect()));
            let shown = |own: Point| format!("{} {:?}", own.name, own.axes);
            points.into_iter().map(shown).collect::<Vec<_>>().join("; ")
        };
        assert_eq!(of(&["p1x", "p1y", "p2_x", "p2_y"]), "p1 [0, 1]; p2 [2, 3]");
        assert_eq!(
            of(&["x1", "y1", "z1", "x2", "y2", "z2"]),
            "p1 [0, 1, 2]; p2 [3, 4, 5]"
        );
        assert_eq!(of(&["x", "y", "theta"]), "p [0, 1]");
        assert_eq!(of(&["y1", "x1"]), "p1 [1, 0]");
        assert_eq!(of(&["q1", "q2", "x", "x"]), "");
    }
}
