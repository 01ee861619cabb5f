//! Directions in configuration space: translations and rotations.

use serde::Serialize;

use lagrangian::constraints::Point;
use lagrangian::trajectory::Topology;
use lagrangian::{Coordinates, Error, Result};

/// A direction ξ(q) = A q + b in the space of configurations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Symmetry {
    /// Name of the charge, for example `angular momentum`.
    pub name: String,
    /// Matrix A, row-major `[n, n]`.
    pub matrix: Vec<f64>,
    /// Translation b, `[n]`.
    pub shift: Vec<f64>,
}

impl Symmetry {
    /// Translation of these coordinates by an equal amount.
    #[must_use]
    pub fn translation(name: &str, n: usize, of: &[usize]) -> Self {
        let shift = (0..n).map(|i| f64::from(u8::from(of.contains(&i))));
        Self {
            name: name.into(),
            matrix: vec![0.0; n * n],
            shift: shift.collect(),
        }
    }

    /// Rotation of these pairs (x, y) of coordinates about the origin: δx = −y, δy = x.
    #[must_use]
    pub fn rotation(name: &str, n: usize, of: &[(usize, usize)]) -> Self {
        let mut matrix = vec![0.0; n * n];
        for &(x, y) in of {
            (matrix[x * n + y], matrix[y * n + x]) = (-1.0, 1.0);
        }
        Self {
            name: name.into(),
            matrix,
            shift: vec![0.0; n],
        }
    }

    pub(super) fn validate(&self, n: usize) -> Result<()> {
        let what = format!("the direction of '{}'", self.name);
        let remedy = "give A for each pair of coordinates, and b for each";
        Error::check_shape(&what, self.matrix.len(), n * n, remedy)?;
        Error::check_shape(&what, self.shift.len(), n, remedy)
    }

    /// A q, `[n]`.
    pub(super) fn turned(&self, q: &[f64]) -> impl Iterator<Item = f64> {
        self.matrix
            .chunks_exact(q.len().max(1))
            .map(move |row| row.iter().zip(q).map(|(a, q)| a * q).sum())
    }

    /// ξ(q), `[n]`.
    pub(super) fn at(&self, q: &[f64]) -> Vec<f64> {
        let turned = self.turned(q);
        turned.zip(&self.shift).map(|(a, b)| a + b).collect()
    }
}

/// Candidates for symmetries: the translation of each coordinate, the translations of all points along each axis, and the
/// rotations of all points.
///
/// A point is the list of its two or three Cartesian coordinates.
///
/// # Errors
/// [`Error::Argument`] for points of other or different sizes, for points that share coordinates, and for coordinates
/// that are angles or do not exist.
pub fn candidates(coordinates: &Coordinates, points: &[Vec<usize>]) -> Result<Vec<Symmetry>> {
    let n = coordinates.dof();
    check(coordinates, points)?;
    let one = |i: usize| {
        let name = format!("momentum of {}", coordinates.0[i].name);
        Symmetry::translation(&name, n, &[i])
    };
    let moving = (0..n).filter(|&i| !coordinates.is_parameter(i));
    let mut all: Vec<Symmetry> = moving.map(one).collect();
    let axes = points.first().map_or(0, Vec::len);
    const NAMES: [&str; 3] = ["x", "y", "z"];
    if points.len() > 1 {
        for (axis, name) in NAMES[..axes].iter().enumerate() {
            let of: Vec<usize> = points.iter().map(|point| point[axis]).collect();
            let name = format!("total momentum along {name}");
            all.push(Symmetry::translation(&name, n, &of));
        }
    }
    let turns: &[(usize, usize, &str)] = match axes {
        2 => &[(0, 1, "angular momentum")],
        3 => &[
            (1, 2, "angular momentum about x"),
            (2, 0, "angular momentum about y"),
            (0, 1, "angular momentum about z"),
        ],
        _ => &[],
    };
    for &(x, y, name) in turns {
        let of: Vec<_> = points.iter().map(|point| (point[x], point[y])).collect();
        all.push(Symmetry::rotation(name, n, &of));
    }
    Ok(all)
}

fn check(coordinates: &Coordinates, points: &[Vec<usize>]) -> Result<()> {
    let wrong = |value: String, must| Err(Error::argument("points", value, must));
    let mut seen = Vec::new();
    for point in points {
        if !(2..=3).contains(&point.len()) || point.len() != points[0].len() {
            let must = "two or three Cartesian coordinates each, the same number for all points";
            return wrong(format!("one of {} coordinates", point.len()), must);
        }
        for i in point {
            let coordinate = coordinates.0.get(*i);
            let name = coordinate.map_or("?", |c| &c.name);
            if coordinate.is_none_or(|c| c.topology != Topology::Line) {
                let must = "Cartesian coordinates of the model, no angles";
                return wrong(format!("'{name}'"), must);
            }
            if seen.contains(&i) {
                return wrong(format!("'{name}' twice"), "points that share no coordinate");
            }
            seen.push(i);
        }
    }
    Ok(())
}

/// Points by the names of their coordinates: `x1, y1, x2, y2` or `x, y, z`. Empty if the names do not form points
/// of two or three coordinates.
#[must_use]
pub fn points_by_name(coordinates: &Coordinates) -> Vec<Vec<usize>> {
    let points: Vec<Vec<usize>> = Point::named(coordinates)
        .into_iter()
        .map(|own| own.axes)
        .collect();
    match check(coordinates, &points) {
        Ok(()) => points,
        Err(_) => Vec::new(),
    }
}
