//! Points that constraints join, as marks and lines.

use lagrangian::constraints::Constraint;
use lagrangian::models::Linkage;

/// A mark of a drawing.
pub(super) struct Mark {
    of: Of,
    /// The mark that it is joined to by a line, an earlier one or itself.
    pub(super) joined: usize,
}

/// The place of a mark.
enum Of {
    /// The centre of a circle, which does not move.
    Centre([f64; 3]),
    /// A point, by its coordinates.
    Point(Vec<usize>),
}

impl Mark {
    /// The place in space, with 0 for an axis that a point does not have.
    pub(super) fn place(&self, q: &[f64]) -> [f64; 3] {
        let mut place = [0.0; 3];
        match &self.of {
            Of::Centre(centre) => place = *centre,
            Of::Point(axes) => (place.iter_mut().zip(axes)).for_each(|(x, i)| *x = q[*i]),
        }
        place
    }
}

/// The centres of circles, the points, and of points that are joined to several others a mark for each further line.
pub(super) fn marks(linkage: Linkage<'_>) -> Vec<Mark> {
    let Joints { centres, rods } = joints(linkage);
    let count = centres.len();
    let mut marks: Vec<Mark> = Vec::new();
    for (joined, (centre, _)) in centres.iter().enumerate() {
        let of = Of::Centre(*centre);
        marks.push(Mark { of, joined });
    }
    let point = |p: usize, joined: usize| {
        let of = Of::Point(linkage.points[p].clone());
        Mark { of, joined }
    };
    for p in 0..linkage.points.len() {
        let centre = centres.iter().position(|(_, of)| *of == p);
        marks.push(point(p, centre.unwrap_or(count + p)));
    }
    for (a, b) in rods {
        match marks[count + b].joined == count + b {
            true => marks[count + b].joined = count + a,
            false => marks.push(point(b, count + a)),
        }
    }
    marks
}

/// What joins points.
#[derive(Default)]
struct Joints {
    /// The centres of circles and spheres, each with its point.
    centres: Vec<([f64; 3], usize)>,
    /// The pairs of points at one distance.
    rods: Vec<(usize, usize)>,
}

fn joints(
    Linkage {
        points,
        constraints,
    }: Linkage<'_>,
) -> Joints {
    let mut joints = Joints::default();
    let positions = constraints.iter().filter(|own| own.constant.is_some());
    for own in positions {
        let touches = |p: &usize| {
            let mut products = own.products.iter();
            products.any(|(j, _, _)| points[*p].contains(j))
        };
        let touched: Vec<usize> = (0..points.len()).filter(touches).collect();
        match *touched {
            [a, b] => joints.rods.push((a, b)),
            [p] => joints
                .centres
                .extend(centre(own, &points[p]).map(|of| (of, p))),
            _ => {}
        }
    }
    joints
}

/// The centre of the circle or sphere that a constraint on one point is; `None` for another curve.
fn centre(own: &Constraint, axes: &[usize]) -> Option<[f64; 3]> {
    let first = own.square(*axes.first()?);
    let round = axes
        .iter()
        .all(|i| (own.square(*i) - first).abs() < 1e-9 * first.abs());
    let mut centre = [0.0; 3];
    (centre.iter_mut().zip(axes)).for_each(|(x, i)| *x = -own.slope(*i) / first);
    round.then_some(centre)
}
