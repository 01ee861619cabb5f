//! Points that constraints join, as marks and lines.

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
    let (mut centres, mut rods) = (Vec::new(), Vec::new());
    let curved = linkage
        .constraints
        .iter()
        .filter(|own| own.constant.is_some() && !own.products.is_empty());
    for own in curved {
        let touches = |p: &usize| {
            own.products
                .iter()
                .any(|(j, _, _)| linkage.points[*p].contains(j))
        };
        let touched: Vec<usize> = (0..linkage.points.len()).filter(touches).collect();
        match *touched {
            [a, b] => rods.push((a, b)),
            [p] => {
                let square = |i: &usize| {
                    own.products
                        .iter()
                        .find(|(j, k, _)| j == i && k == i)
                        .map_or(0.0, |own| own.2)
                };
                let slope = |i: &usize| {
                    own.slopes
                        .iter()
                        .filter(|(j, _)| j == i)
                        .map(|(_, b)| b)
                        .sum::<f64>()
                };
                let axes = &linkage.points[p];
                let round = axes
                    .iter()
                    .all(|i| (square(i) - square(&axes[0])).abs() < 1e-9 * square(i).abs());
                let mut centre = [0.0; 3];
                (centre.iter_mut().zip(axes)).for_each(|(x, i)| *x = -slope(i) / square(i));
                if round {
                    centres.push((centre, p));
                }
            }
            _ => {}
        }
    }
    let count = centres.len();
    let mut marks: Vec<Mark> = Vec::new();
    for (k, (centre, _)) in centres.iter().enumerate() {
        marks.push(Mark {
            of: Of::Centre(*centre),
            joined: k,
        });
    }
    let point = |p: usize, joined: usize| Mark {
        of: Of::Point(linkage.points[p].clone()),
        joined,
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
