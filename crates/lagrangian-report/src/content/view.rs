//! The direction from which a motion in space is drawn.

/// A parallel projection of space onto a plane, chosen so that most of a motion is visible.
///
/// ```
/// use lagrangian_report::View;
///
/// // A point that moves along y, in the gravity of the earth: it is seen from the side, with y across.
/// let moves = [[[0.0, -1.0, 2.0]], [[0.0, 1.0, 2.0]]];
/// let view = View::of(moves.iter().map(|frame| &frame[..]), [0.0, 0.0, -9.81]);
/// let [across, upwards] = view.place([5.0, 1.0, 2.0]);
/// assert!((across - 1.0).abs() < 1e-12 && upwards == 2.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    across: [f64; 3],
    upwards: [f64; 3],
    side: Side,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Beside,
    Above,
}

/// A motion is seen from above if its spread along the second horizontal direction is this many times that along the vertical …
const FLAT: f64 = 4.0;
/// … and more than this part of its length: a thinner one is a line, with a width from rounding errors.
const LINE: f64 = 1e-3;

/// Sums over a motion: the squares of the two horizontal directions, their product, and the square of the vertical.
#[derive(Default)]
struct Spread {
    first: f64,
    second: f64,
    mixed: f64,
    upright: f64,
}

impl View {
    /// The view of points in space over frames with equal numbers of points: upright against gravity (without gravity, along z), across the
    /// horizontal direction of the largest motion; from above if they hardly move upwards.
    #[must_use]
    pub fn of<'a>(frames: impl Iterator<Item = &'a [[f64; 3]]> + Clone, gravity: [f64; 3]) -> Self {
        let upwards = unit(gravity.map(|g| -g)).unwrap_or([0.0, 0.0, 1.0]);
        let basis = horizontal(upwards);
        let spread = Spread::of(frames, basis, upwards);
        let (s, c) = (0.5 * (2.0 * spread.mixed).atan2(spread.first - spread.second)).sin_cos();
        let [a, b] = basis;
        let across = [0, 1, 2].map(|k| c * a[k] + s * b[k]);
        let second = s * s * spread.first + c * c * spread.second - 2.0 * s * c * spread.mixed;
        let thinnest = LINE * LINE * (spread.first + spread.second);
        if second > thinnest.max(FLAT * FLAT * spread.upright) {
            return Self {
                across,
                upwards: cross(upwards, across),
                side: Side::Above,
            };
        }
        Self {
            across,
            upwards,
            side: Side::Beside,
        }
    }

    /// Position of a point of space in the drawing: to the right, and upwards.
    #[must_use]
    pub fn place(&self, point: [f64; 3]) -> [f64; 2] {
        [dot(self.across, point), dot(self.upwards, point)]
    }

    /// The direction of the view, in words.
    #[must_use]
    pub fn words(&self) -> &'static str {
        match self.side {
            Side::Beside => "seen from the side",
            Side::Above => "seen from above",
        }
    }
}

impl Spread {
    /// Sums about the mean of each point, so that points at rest do not count.
    fn of<'a>(
        frames: impl Iterator<Item = &'a [[f64; 3]]> + Clone,
        [a, b]: [[f64; 3]; 2],
        upwards: [f64; 3],
    ) -> Self {
        let mut spread = Self::default();
        let points = frames.clone().map(<[_]>::len).min().unwrap_or(0);
        for k in 0..points {
            let places = frames.clone().map(|frame| frame[k]);
            let count = places.clone().count() as f64;
            let sum = places
                .clone()
                .fold([0.0; 3], |sum, p| [0, 1, 2].map(|i| sum[i] + p[i]));
            for place in places {
                let moved = [0, 1, 2].map(|i| place[i] - sum[i] / count);
                let (x, y, z) = (dot(moved, a), dot(moved, b), dot(moved, upwards));
                spread.first += x * x;
                spread.second += y * y;
                spread.mixed += x * y;
                spread.upright += z * z;
            }
        }
        spread
    }
}

/// Two directions orthogonal to an upright one: for z these are x and y.
fn horizontal(upwards: [f64; 3]) -> [[f64; 3]; 2] {
    let start = match upwards[0].abs() < 0.9 {
        true => [1.0, 0.0, 0.0],
        false => [0.0, 1.0, 0.0],
    };
    let along = dot(start, upwards);
    let level = [0, 1, 2].map(|k| start[k] - along * upwards[k]);
    let first = unit(level).unwrap_or(start);
    [first, cross(upwards, first)]
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 0.0 && length.is_finite()).then(|| v.map(|x| x / length))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

    fn view(places: &[[f64; 3]]) -> View {
        View::of(places.chunks(1), DOWN)
    }

    #[test]
    fn a_swing_in_an_upright_plane_is_seen_at_right_angles_to_that_plane() {
        let (s, c) = 0.6_f64.sin_cos();
        let at = |angle: f64| [c * angle.sin(), s * angle.sin(), 1.0 - angle.cos()];
        let swing: Vec<_> = (-10..=10).map(|k| at(0.1 * f64::from(k))).collect();
        let view = view(&swing);
        assert_eq!(view.words(), "seen from the side");
        for (place, k) in swing.iter().zip(-10..=10) {
            let angle = 0.1 * f64::from(k);
            let [x, y] = view.place(*place);
            assert!((x - angle.sin()).abs() < 1e-12 && (y - 1.0 + angle.cos()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_motion_in_the_horizontal_plane_is_seen_from_above() {
        let at = |angle: f64| [angle.cos(), angle.sin(), 0.3];
        let turn: Vec<_> = (0..20).map(|k| at(0.3 * f64::from(k))).collect();
        let view = view(&turn);
        assert_eq!(view.words(), "seen from above");
        // Lengths in that plane are preserved.
        let (a, b) = (view.place(turn[0]), view.place(turn[5]));
        let drawn = (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!((drawn - 2.0 * 0.75_f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn gravity_points_down_and_what_stands_still_is_seen_from_the_side() {
        let view = View::of([[[0.0, 2.0, 1.0]]].iter().map(|p| &p[..]), [0.0, 9.81, 0.0]);
        assert!((view.place([0.0, 2.0, 1.0])[1] + 2.0).abs() < 1e-12);
        assert_eq!(view.words(), "seen from the side");
        let none = View::of([].into_iter(), [0.0; 3]);
        let [x, y] = none.place([1.0, 2.0, 3.0]);
        assert!((x - 1.0).hypot(y - 3.0) < 1e-12);
    }
}
