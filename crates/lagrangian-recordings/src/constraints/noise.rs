//! The noise of positions: from differences of successive samples, or from the gap between the distances that stay and those that do not.

use super::points::Point;
use super::taubin::Cloud;
use super::{linear, square};
use lagrangian_motion::statistics::{deviation, sort_numbers, upper_median};

/// Motions of at least so many samples show their noise by themselves.
const LONG: usize = 24;
/// The smallest noise in parts of the largest deviation of a coordinate.
const EXACT: f64 = 1e-6;
/// Without that, what stays is at least so many times nearer than all else, and below this part of the motion.
const GAP: f64 = 5.0;
const SMALL: f64 = 0.05;

/// The noise of each coordinate, `[n]`; `None` where the data do not tell.
pub(super) fn of(
    motions: &[&[f64]],
    cloud: &Cloud,
    points: &[Point],
    is_line: impl Fn(usize) -> bool,
) -> Option<Vec<f64>> {
    let n = cloud.n;
    let deviations: Vec<f64> = (0..n)
        .map(|i| deviation(&mut cloud.states().map(|q| q[i])))
        .collect();
    let lines = (0..n).filter(|i| is_line(*i));
    let scale = lines.map(|i| deviations[i]).fold(0.0, f64::max);
    let long: Vec<&&[f64]> = motions.iter().filter(|own| own.len() >= LONG * n).collect();
    let least = EXACT * scale;
    if scale <= 0.0 {
        return None;
    }
    if long.is_empty() {
        let noise = gap(cloud, points, scale)?;
        return Some(vec![noise.max(least); n]);
    }
    let of = |i: usize| {
        let each = long.iter().flat_map(|own| {
            let x: Vec<f64> = own.iter().skip(i).step_by(n).copied().collect();
            x.windows(7).map(sixth).collect::<Vec<_>>()
        });
        // The deviation of a sixth difference is √924 times that of the noise.
        let mut sizes: Vec<f64> = each.collect();
        (1.4826 * upper_median(&mut sizes) / 924.0_f64.sqrt()).max(least)
    };
    Some((0..n).map(of).collect())
}

fn sixth(w: &[f64]) -> f64 {
    let sum = w[0] - 6.0 * w[1] + 15.0 * w[2] - 20.0 * w[3] + 15.0 * w[4] - 6.0 * w[5] + w[6];
    sum.abs()
}

/// The largest deviation of what stays: of coordinates, of points from circles, and of distances.
fn gap(cloud: &Cloud, points: &[Point], scale: f64) -> Option<f64> {
    let mut features = vec![];
    for (b, point) in points.iter().enumerate() {
        let mut circle = vec![square(&point.axes, None)];
        circle.extend(point.axes.iter().map(|i| linear(&[(*i, 1.0)])));
        features.push(circle);
        let others = points[..b]
            .iter()
            .filter(|own| own.axes.len() == point.axes.len());
        features.extend(others.map(|own| vec![square(&own.axes, Some(&point.axes))]));
    }
    let least = |own: &Vec<_>| {
        cloud
            .relations(own)
            .first()
            .map(|own| own.scatter.max(1e-9 * scale))
    };
    let mut all: Vec<f64> = features.iter().filter_map(least).collect();
    sort_numbers(&mut all);
    all.push(scale);
    let pairs = all.windows(2).filter(|w| w[0] < SMALL * scale);
    let widest = pairs.max_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])))?;
    (widest[1] > GAP * widest[0]).then_some(widest[0])
}
