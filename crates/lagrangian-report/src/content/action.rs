//! Figures of the action: varied paths, and the effect of the variations on S.

use lagrangian::Coordinates;

use super::coordinate::{column, label};
use super::{Axis, Figure, Role, Series};

/// A path q(t) on a grid of times and the neighbours q + ε η that are drawn beside it.
#[derive(Debug, Clone, Copy)]
pub struct VariedPath<'a> {
    /// Times of the nodes, s, `[N + 1]`.
    pub t: &'a [f64],
    /// The nodes of the path, `[N + 1, n]`.
    pub q: &'a [f64],
    /// The variation η at the nodes, `[N + 1, n]`.
    pub eta: &'a [f64],
    /// The sizes ε of the variations, one for each neighbour.
    pub epsilon: &'a [f64],
}

/// Coordinate `i` of a path and of its neighbours q + ε η.
#[must_use]
pub fn varied_paths(coordinates: &Coordinates, i: usize, path: &VariedPath) -> Figure {
    let n = coordinates.dof();
    let (stationary, eta) = (column(path.q, i, n), column(path.eta, i, n));
    let line = |name: &str, role, q| Series::line(name, role, path.t.to_vec(), q);
    let neighbour = |(k, e): (usize, &f64)| {
        let name = if k == 0 { "varied paths" } else { "" };
        let pairs = stationary.iter().zip(&eta);
        line(
            name,
            Role::Other(0),
            pairs.map(|(q, eta)| q + e * eta).collect(),
        )
    };
    let mut series: Vec<Series> = path.epsilon.iter().enumerate().map(neighbour).collect();
    series.push(line("stationary", Role::Truth, stationary.clone()));
    let (name, unit) = label(coordinates, i);
    Figure {
        id: format!("varied-{}", i + 1),
        title: format!("The path and its neighbours, {name}"),
        caption: "All have the same ends in the same time; the motion is the one whose action is stationary.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear(&name, &unit),
        series,
    }
}

/// S(q + ε η) − S(q) in a unit, over ε along several variations.
#[must_use]
pub fn action_of_families(series: Vec<Series>, unit: &str) -> Figure {
    Figure {
        id: "families".into(),
        title: "Action of the varied paths".into(),
        caption: "Flat at ε = 0 along every variation: the path is stationary. Curved upwards along all of them, it is a \
                  minimum; downwards along one, a saddle."
            .into(),
        x: Axis::linear("size of the variation ε", ""),
        y: Axis::linear("S(ε) − S(0)", unit),
        series,
    }
}
