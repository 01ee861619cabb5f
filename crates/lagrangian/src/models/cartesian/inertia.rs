//! The inertia of points: of each its mass, and what points of one rigid body share.

use serde::{Deserialize, Serialize};

use crate::models::formula::Style;
use lagrangian_motion::Constraint;
use lagrangian_motion::solve::{Regularity, SymmetricSolver};

/// A part of the kinetic energy of a rigid body that is of two of its points: μ u·v, or turned, μ (u × v) in a plane, u and v their velocities.
///
/// A body's kinetic energy is of second order in the velocities of its points: that of a uniform bar of mass m between two points is
/// m/6 (u² + u·v + v²), and one whose centre is beside the line between them has a turned part (theory.md, 130o).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shared {
    /// Both points.
    pub(super) points: [usize; 2],
    /// Whether it is that of the quarter turn.
    #[serde(default)]
    pub(super) turned: bool,
}

impl Shared {
    /// The parts of the bodies that rods make of points; turned ones in a plane alone.
    pub(super) fn of_rods(points: &[Vec<usize>], constraints: &[Constraint]) -> Vec<Self> {
        let rods = constraints.iter().filter_map(|own| rod(points, own));
        let rods: Vec<[usize; 2]> = rods.collect();
        let all = |turned: bool| {
            rods.iter().map(move |of| Self {
                points: *of,
                turned,
            })
        };
        let flat = |own: &Self| points[own.points[0]].len() == 2;
        all(false).chain(all(true).filter(flat)).collect()
    }

    /// The pairs of coordinates whose velocities it multiplies, with their signs.
    pub(super) fn entries(
        self,
        points: &[Vec<usize>],
    ) -> impl Iterator<Item = (usize, usize, f64)> {
        let [a, b] = self.points.map(|at| &points[at]);
        let turn = usize::from(self.turned);
        let count = a.len().min(b.len());
        (0..count).map(move |k| {
            let sign = if turn * k == 0 { 1.0 } else { -1.0 };
            (a[k], b[(k + turn) % count], sign)
        })
    }

    /// Whether it is of two of these points; turned in a plane.
    pub(super) fn is_right(self, points: &[Vec<usize>]) -> bool {
        let [a, b] = self.points.map(|at| points.get(at).map(Vec::len));
        self.points[0] != self.points[1] && a.is_some() && a == b && (!self.turned || a == Some(2))
    }

    /// The sum of products of velocities, by the names of coordinates.
    pub(super) fn written(
        self,
        points: &[Vec<usize>],
        name: impl Fn(usize) -> String,
        style: Style,
    ) -> String {
        let mut text = String::new();
        for (i, j, sign) in self.entries(points) {
            text += match (text.is_empty(), sign < 0.0) {
                (true, _) => "",
                (false, true) => " - ",
                (false, false) => " + ",
            };
            let [first, second] = [i, j].map(|at| style.rate(&name(at)));
            let space = if style == Style::Text { " " } else { "\\," };
            text += &format!("{first}{space}{second}");
        }
        format!("({text})")
    }
}

/// The points that a relation keeps at one distance.
fn rod(points: &[Vec<usize>], own: &Constraint) -> Option<[usize; 2]> {
    own.constant?;
    let touches = |p: &usize| {
        let mut products = own.products.iter();
        products.any(|(j, _, _)| points[*p].contains(j))
    };
    let touched: Vec<usize> = (0..points.len()).filter(touches).collect();
    let touched: [usize; 2] = touched.try_into().ok()?;
    let [a, b] = touched.map(|at| points[at].len());
    (a == b && a > 1).then_some(touched)
}

/// Adds `factor` times the momentum of the inertia `k`, of points and then of what they share, at velocities.
pub(super) fn add_momentum(
    (points, shared): (&[Vec<usize>], &[Shared]),
    k: usize,
    factor: f64,
    velocities: &[f64],
    out: &mut [f64],
) {
    match points.get(k) {
        Some(point) => point
            .iter()
            .for_each(|i| out[*i] += factor * velocities[*i]),
        None => {
            for (i, j, sign) in shared[k - points.len()].entries(points) {
                out[i] += factor * sign * velocities[j];
                out[j] += factor * sign * velocities[i];
            }
        }
    }
}

/// The mass matrix, `[n, n]`, of the inertias of points and of what they share.
pub(super) fn mass_matrix(
    n: usize,
    (points, shared): (&[Vec<usize>], &[Shared]),
    inertias: &[f64],
) -> Vec<f64> {
    let mut matrix = vec![0.0; n * n];
    let mut unit = vec![0.0; n];
    for (i, row) in matrix.chunks_exact_mut(n.max(1)).enumerate() {
        unit[i] = 1.0;
        for (k, own) in inertias.iter().enumerate() {
            add_momentum((points, shared), k, *own, &unit, row);
        }
        unit[i] = 0.0;
    }
    matrix
}

/// The inverse of a mass matrix, `[n, n]`; `None` where it is not positive definite.
pub(super) fn inverse_of(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut inverse = vec![0.0; n * n];
    let found = SymmetricSolver::new(n).invert(matrix, &mut inverse);
    (found == Regularity::Definite).then_some(inverse)
}
