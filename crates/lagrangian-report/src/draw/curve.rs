//! Reduction of points in the unit square to the few that a picture needs.

/// A point in the unit square, y upwards; NaN for a gap.
pub(super) type Point = (f64, f64);

/// The visible stretches of a curve: cut at gaps and at the edges of the unit square, and simplified with deviations of
/// at most `tolerance` (a fraction of the width and one of the height).
pub(super) fn stretches(points: &[Point], tolerance: Point) -> Vec<Vec<Point>> {
    let mut all: Vec<Vec<Point>> = Vec::new();
    for pair in points.windows(2) {
        let Some((from, to)) = inside(pair[0], pair[1]) else {
            continue;
        };
        match all.last_mut() {
            Some(open) if open.last() == Some(&from) => open.push(to),
            _ => all.push(vec![from, to]),
        }
    }
    all.iter()
        .map(|stretch| simplified(stretch, tolerance))
        .collect()
}

/// The part of a segment in the unit square (Liang and Barsky 1984).
fn inside(from: Point, to: Point) -> Option<(Point, Point)> {
    if ![from.0, from.1, to.0, to.1].iter().all(|x| x.is_finite()) {
        return None;
    }
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut start, mut end) = (0.0, 1.0);
    for (step, distance) in [
        (-dx, from.0),
        (dx, 1.0 - from.0),
        (-dy, from.1),
        (dy, 1.0 - from.1),
    ] {
        if step < 0.0 {
            start = f64::max(start, distance / step);
        } else if step > 0.0 {
            end = f64::min(end, distance / step);
        } else if distance < 0.0 {
            return None;
        }
    }
    // OK because uncut ends keep their exact bits, by which stretches are joined.
    let at = |part: f64| (from.0 + part * dx, from.1 + part * dy);
    let first = if start > 0.0 { at(start) } else { from };
    let last = if end < 1.0 { at(end) } else { to };
    (start <= end).then_some((first, last))
}

/// Simplification by Douglas and Peucker 1973, in stretches of bounded length so that the cost stays linear.
fn simplified(points: &[Point], tolerance: Point) -> Vec<Point> {
    const STRETCH: usize = 512;
    let mut keep = vec![false; points.len()];
    let last = points.len() - 1;
    let mut open: Vec<(usize, usize)> = (0..last)
        .step_by(STRETCH)
        .map(|start| (start, (start + STRETCH).min(last)))
        .collect();
    while let Some((start, end)) = open.pop() {
        keep[start] = true;
        keep[end] = true;
        let strays = |k: usize| distance(points[k], points[start], points[end], tolerance);
        let Some(worst) = (start + 1..end).max_by(|&a, &b| strays(a).total_cmp(&strays(b))) else {
            continue;
        };
        if strays(worst) > 1.0 {
            open.extend([(start, worst), (worst, end)]);
        }
    }
    points
        .iter()
        .zip(keep)
        .filter_map(|(point, keep)| keep.then_some(*point))
        .collect()
}

/// Distance of a point from a segment, in units of the tolerance.
fn distance(point: Point, from: Point, to: Point, tolerance: Point) -> f64 {
    let scaled = |p: Point| ((p.0 - from.0) / tolerance.0, (p.1 - from.1) / tolerance.1);
    let ((x, y), (dx, dy)) = (scaled(point), scaled(to));
    let length = dx * dx + dy * dy;
    let along = if length > 0.0 {
        ((x * dx + y * dy) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (x - along * dx).hypot(y - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_needs_two_points() {
        let line: Vec<Point> = (0..=400).map(|k| (f64::from(k) / 400.0, 0.5)).collect();
        assert_eq!(
            stretches(&line, (1e-3, 1e-3)),
            [vec![(0.0, 0.5), (1.0, 0.5)]]
        );
    }

    #[test]
    fn a_curve_is_cut_at_gaps_and_at_the_edge() {
        let points = [
            (0.0, 0.5),
            (0.2, 1.5),
            (0.4, 0.5),
            (f64::NAN, 0.5),
            (0.6, 0.5),
            (0.8, 0.1),
        ];
        let cut = stretches(&points, (1e-3, 1e-3));
        assert_eq!(cut.len(), 3);
        assert_eq!(cut[0], [(0.0, 0.5), (0.1, 1.0)]);
        assert!(cut.iter().flatten().all(|p| (0.0..=1.0).contains(&p.1)));
    }

    #[test]
    fn simplifying_strays_less_than_the_tolerance() {
        let wave: Vec<Point> = (0..5000)
            .map(|k| f64::from(k) / 4999.0)
            .map(|x| (x, 0.5 + 0.4 * (20.0 * x).sin()))
            .collect();
        let thin = &stretches(&wave, (1e-3, 1e-3))[0];
        assert!(thin.len() < 500, "{}", thin.len());
        for point in &wave {
            let nearest = thin
                .windows(2)
                .map(|w| distance(*point, w[0], w[1], (1e-3, 1e-3)));
            assert!(nearest.fold(f64::INFINITY, f64::min) <= 1.0 + 1e-9);
        }
    }

    #[test]
    fn nothing_and_one_point_give_no_stretch() {
        assert!(stretches(&[], (1e-3, 1e-3)).is_empty());
        assert!(stretches(&[(0.5, 0.5)], (1e-3, 1e-3)).is_empty());
    }
}
