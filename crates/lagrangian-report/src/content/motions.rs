//! Figures of motions: coordinates over time, and phase portraits.

use std::f64::consts::{PI, TAU};

use lagrangian::{Coordinates, Trajectory};

use super::coordinate::{axis, column, label, near, span};
use super::{Axis, Figure, Role, Series};

/// A trajectory with a name and a role.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// The system or model of the motion, which sets its colour.
    pub role: Role,
    /// The motion.
    pub trajectory: &'a Trajectory,
}

impl<'a> Motion<'a> {
    /// A trajectory under this name, in the colour of this role.
    #[must_use]
    pub fn new(name: &'a str, role: Role, trajectory: &'a Trajectory) -> Self {
        Self {
            name,
            role,
            trajectory,
        }
    }
}

/// Coordinate `i` over time, predicted and true, over the first twenty swings or turns: more would not be readable.
///
/// A diverging prediction does not flatten the others: the axis follows the truth if there is one.
#[must_use]
pub fn trajectories(coordinates: &Coordinates, i: usize, motions: &[Motion]) -> Figure {
    let (name, _) = label(coordinates, i);
    let window = window(coordinates, motions, 40);
    let series = signals(motions, window, |motion| {
        (
            motion.trajectory.t.clone(),
            column(&motion.trajectory.q, i, motion.trajectory.dof()),
        )
    });
    Figure {
        id: format!("trajectory-{}", i + 1),
        title: format!("{name} over time"),
        caption: format!(
            "{} Predicted from the first state alone; where the motion is chaotic, any prediction parts \
             from it in the end.",
            extent(window)
        ),
        x: Axis::linear("time", "s"),
        y: Axis {
            range: range_of_truth(&series),
            ..axis(coordinates, i)
        },
        series,
    }
}

/// Velocity over coordinate `i`, over the first eight swings or turns; an angle is shown in (−π, π], with gaps where
/// it leaves at one side.
#[must_use]
pub fn phase_portrait(coordinates: &Coordinates, i: usize, motions: &[Motion]) -> Figure {
    let (name, unit) = label(coordinates, i);
    let circle = i < coordinates.dof() && coordinates.is_circle(i);
    let window = window(coordinates, motions, 16);
    let series = signals(motions, window, |motion| {
        let n = motion.trajectory.dof();
        let (q, qd) = (&motion.trajectory.q, &motion.trajectory.qd);
        (column(q, i, n), column(qd, i, n))
    });
    let turned = |one: Series| {
        let (x, y) = if circle {
            wrapped(&one.x, &one.y)
        } else {
            (one.x, one.y)
        };
        Series { x, y, ..one }
    };
    let series: Vec<Series> = series.into_iter().map(turned).collect();
    let x = axis(coordinates, i);
    Figure {
        id: format!("phase-{}", i + 1),
        title: format!("Phase portrait of {name}"),
        caption: format!(
            "{} Velocity over position: the shapes should agree even where the motions have parted.",
            extent(window)
        ),
        x: if circle && !is_narrow(&series) {
            x.between(-PI, PI)
        } else {
            x
        },
        y: Axis {
            range: range_of_truth(&series),
            ..Axis::velocity(&name, &unit)
        },
        series,
    }
}

/// One line for each motion, up to the end of a window.
fn signals(
    motions: &[Motion],
    window: Option<f64>,
    xy: impl Fn(&Motion) -> (Vec<f64>, Vec<f64>),
) -> Vec<Series> {
    let line = |motion: &Motion| {
        let t = motion.trajectory.t.iter();
        let len = t.filter(|t| window.is_none_or(|end| **t <= end)).count();
        let (mut x, mut y) = xy(motion);
        x.truncate(len);
        y.truncate(len);
        Series::line(motion.name, motion.role, x, y)
    };
    motions.iter().map(line).collect()
}

/// The time at which the fastest coordinate of the truth (or of the first motion) has made `halves` reversals or half turns;
/// `None` if no coordinate ever does. All coordinates share it, so that their figures can be compared.
fn window(coordinates: &Coordinates, motions: &[Motion], halves: usize) -> Option<f64> {
    let motion = motions
        .iter()
        .find(|motion| motion.role == Role::Truth)
        .or(motions.first())?;
    let ends = (0..coordinates.dof()).filter_map(|i| nth_half(motion, i, halves));
    ends.min_by(f64::total_cmp)
}

fn nth_half(motion: &Motion, i: usize, halves: usize) -> Option<f64> {
    let position = column(&motion.trajectory.q, i, motion.trajectory.dof());
    let velocity = column(&motion.trajectory.qd, i, motion.trajectory.dof());
    let (mut halves_seen, mut start) = (0, *position.first()?);
    let steps = position.iter().skip(1).zip(velocity.windows(2));
    for (k, (&q, pair)) in steps.enumerate() {
        let turns_back = pair[0] * pair[1] < 0.0;
        if turns_back || (q - start).abs() > PI {
            (halves_seen, start) = (halves_seen + 1, q);
        }
        if halves_seen >= halves {
            return motion.trajectory.t.get(k + 1).copied();
        }
    }
    None
}

/// The beginning of a caption, with the part of the motion that is shown.
fn extent(window: Option<f64>) -> String {
    window.map_or(String::from("The whole motion."), |end| {
        format!("The first {} s.", significant(end))
    })
}

/// The range of all series, limited to the vicinity of the true one; `None` if no truth spans a range.
fn range_of_truth(series: &[Series]) -> Option<(f64, f64)> {
    let truth = series.iter().filter(|one| one.role == Role::Truth);
    let known = span(truth.flat_map(|one| &one.y));
    near(known, span(series.iter().flat_map(|one| &one.y)))
}

/// Whether all motions stay within less than half of the circle: small swings would be invisible on all of it.
fn is_narrow(series: &[Series]) -> bool {
    let (low, high) = span(series.iter().flat_map(|one| &one.x));
    high - low < PI
}

/// Angles in (−π, π], with a gap if the next sample is on another turn.
fn wrapped(q: &[f64], qd: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let turn = |angle: f64| ((angle - PI) / TAU).ceil();
    let (mut x, mut y) = (Vec::with_capacity(q.len()), Vec::with_capacity(q.len()));
    let mut before = None;
    for (&angle, &velocity) in q.iter().zip(qd) {
        let now = turn(angle);
        if before.is_some_and(|before: f64| (before - now).abs() > 0.5) {
            x.push(f64::NAN);
            y.push(f64::NAN);
        }
        x.push(angle - TAU * now);
        y.push(velocity);
        before = Some(now);
    }
    (x, y)
}

/// A time with its significant digits.
fn significant(seconds: f64) -> String {
    if seconds < 10.0 {
        format!("{seconds:.2}")
    } else {
        format!("{seconds:.0}")
    }
}
