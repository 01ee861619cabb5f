//! Figures of the action: varied paths, and what they do to S.

use super::{Axis, Figure, Role, Series};
use crate::Coordinates;
use crate::action::{Family, Path, varied};

/// Coordinate `i` of a path and of its neighbours q + ε η.
#[must_use]
pub fn varied_paths(
    coordinates: &Coordinates,
    i: usize,
    path: &Path,
    eta: &[f64],
    epsilon: &[f64],
) -> Figure {
    let column = |path: &Path| {
        path.q
            .iter()
            .skip(i)
            .step_by(path.dof.max(1))
            .copied()
            .collect()
    };
    let neighbour = |(k, e): (usize, &f64)| {
        let name = if k == 0 { "varied paths" } else { "" };
        Series::line(
            name,
            Role::Other(0),
            path.times(),
            column(&varied(path, eta, *e)),
        )
    };
    let mut series: Vec<Series> = epsilon.iter().enumerate().map(neighbour).collect();
    series.push(Series::line(
        "stationary",
        Role::Truth,
        path.times(),
        column(path),
    ));
    let coordinate = coordinates.0.get(i);
    let (name, unit) = coordinate.map_or(("", ""), |c| (&c.name, &c.unit));
    Figure {
        id: format!("varied-{}", i + 1),
        title: format!("The path and its neighbours, {name}"),
        caption: "All have the same ends in the same time; the motion is the one whose action is stationary.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear(name, unit),
        series,
    }
}

/// S(ε) − S(0) of several families over ε.
#[must_use]
pub fn action_of_families(families: &[(&str, Role, &Family)]) -> Figure {
    let line = |(name, role, family): &(&str, Role, &Family)| {
        Series::line(name, *role, family.epsilon.clone(), family.change.clone())
    };
    Figure {
        id: "families".into(),
        title: "Action of the varied paths".into(),
        caption: "Flat at ε = 0 along every variation: the path is stationary. Curved upwards along all of them, it is a \
                  minimum; downwards along one, a saddle."
            .into(),
        x: Axis::linear("size of the variation ε", ""),
        y: Axis::linear("S(ε) − S(0)", "J·s"),
        series: families.iter().map(line).collect(),
    }
}
