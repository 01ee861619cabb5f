//! The figures that every run has, made from what it computed.

use std::f64::consts::{PI, TAU};

use lagrangian::{Coordinates, Trajectory};

use super::{Axis, Figure, Role, Series};

/// A curve with a name and a role; the shorter of `x` and `y` counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Whose it is.
    pub role: Role,
    /// Abscissae.
    pub x: &'a [f64],
    /// Ordinates.
    pub y: &'a [f64],
}

/// A trajectory with a name and a role.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Whose it is.
    pub role: Role,
    /// The motion.
    pub trajectory: &'a Trajectory,
}

/// True and predicted values of one quantity; the shorter of the two counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairs<'a> {
    /// The model's name in the legend.
    pub name: &'a str,
    /// Whose prediction it is.
    pub role: Role,
    /// True values.
    pub truth: &'a [f64],
    /// Predicted values.
    pub predicted: &'a [f64],
}

/// Loss over training steps (or seconds, as `progress` says with its unit) on a log axis.
///
/// ```
/// use lagrangian_report::{Curve, Role, loss_curves};
/// let (step, loss) = ([0.0, 1.0, 2.0], [1.0, 1e-2, 1e-4]);
/// let lnn = Curve { name: "Lagrangian, training", role: Role::Lnn, x: &step, y: &loss };
/// assert_eq!(loss_curves("step", "", &[lnn]).series[0].y, loss);
/// ```
#[must_use]
pub fn loss_curves(progress: &str, unit: &str, curves: &[Curve]) -> Figure {
    Figure {
        id: "loss".into(),
        title: "Loss".into(),
        caption:
            "How the loss fell while training; validation is data that the optimiser never saw."
                .into(),
        x: Axis::linear(progress, unit),
        y: Axis::log("loss", ""),
        series: lines(curves),
    }
}

/// |E(t) − E(0)| over the energy scale, in percent, on a log axis. `curves` hold fractions; exact zeros are gaps.
#[must_use]
pub fn energy_error_over_time(curves: &[Curve]) -> Figure {
    let mut series = lines(curves);
    series
        .iter_mut()
        .flat_map(|one| &mut one.y)
        .for_each(|y| *y = 100.0 * y.abs());
    Figure {
        id: "energy-error".into(),
        title: "Energy error over time".into(),
        caption: "A model that respects the Euler–Lagrange equation keeps the energy; \
                  the truth's own curve is the error of the integrator alone."
            .into(),
        x: Axis::linear("time", "s"),
        y: Axis::log("energy error", "%"),
        series,
    }
}

/// Coordinate `i` over time, predicted and true, over the first twenty swings or turns: more would be a blur.
///
/// A runaway prediction does not flatten the others: the axis follows the truth where there is one.
#[must_use]
pub fn trajectories(coordinates: &Coordinates, i: usize, motions: &[Motion]) -> Figure {
    let (name, _) = label(coordinates, i);
    let window = window(coordinates, motions, 40);
    let series = signals(motions, window, |motion| {
        (
            motion.trajectory.t.clone(),
            column(motion, &motion.trajectory.q, i),
        )
    });
    Figure {
        id: format!("trajectory-{}", i + 1),
        title: format!("{name} over time"),
        caption: format!(
            "{} Predicted from the first state alone; where the motion is chaotic, any prediction parts \
             from it in the end.",
            spoken(window)
        ),
        x: Axis::linear("time", "s"),
        y: Axis {
            range: range_of_truth(&series),
            ..quantity(coordinates, i)
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
        let (q, qd) = (&motion.trajectory.q, &motion.trajectory.qd);
        (column(motion, q, i), column(motion, qd, i))
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
    let x = quantity(coordinates, i);
    Figure {
        id: format!("phase-{}", i + 1),
        title: format!("Phase portrait of {name}"),
        caption: format!(
            "{} Velocity over position: the shapes should agree even where the motions have parted.",
            spoken(window)
        ),
        x: if circle && !is_narrow(&series) {
            x.between(-PI, PI)
        } else {
            x
        },
        y: Axis {
            range: range_of_truth(&series),
            ..Axis::linear(&format!("velocity of {name}"), &format!("{unit}/s"))
        },
        series,
    }
}

/// Predicted over true values of one quantity, with the diagonal on which a perfect model lies.
#[must_use]
pub fn parity(quantity: &str, unit: &str, models: &[Pairs]) -> Figure {
    let (low, high) = span(models.iter().flat_map(|model| model.truth));
    let dots = models.iter().map(|model| {
        let len = model.truth.len().min(model.predicted.len());
        Series::points(
            model.name,
            model.role,
            model.truth[..len].to_vec(),
            model.predicted[..len].to_vec(),
        )
    });
    let mut series: Vec<Series> = dots.collect();
    let mut axes = (
        Axis::linear(&format!("true {quantity}"), unit),
        Axis::linear(&format!("predicted {quantity}"), unit),
    );
    if low < high {
        let margin = 0.05 * (high - low);
        let (low, high) = (low - margin, high + margin);
        series.insert(
            0,
            Series::line("exact", Role::Truth, vec![low, high], vec![low, high]),
        );
        axes = (axes.0.between(low, high), axes.1.between(low, high));
    }
    Figure {
        id: format!("parity-{}", quantity.replace(' ', "-")),
        title: format!("Predicted and true {quantity}"),
        caption: "Each dot is a sample that no model was trained on; a perfect model puts it on the diagonal.".into(),
        x: axes.0,
        y: axes.1,
        series,
    }
}

pub(super) fn lines(curves: &[Curve]) -> Vec<Series> {
    let line = |curve: &Curve| {
        let len = curve.x.len().min(curve.y.len());
        Series::line(
            curve.name,
            curve.role,
            curve.x[..len].to_vec(),
            curve.y[..len].to_vec(),
        )
    };
    curves.iter().map(line).collect()
}

/// One line a motion, up to the end of a window.
fn signals(
    motions: &[Motion],
    window: Option<f64>,
    xy: impl Fn(&Motion) -> (Vec<f64>, Vec<f64>),
) -> Vec<Series> {
    let line = |motion: &Motion| {
        let len = motion
            .trajectory
            .t
            .iter()
            .filter(|t| window.is_none_or(|end| **t <= end))
            .count();
        let (mut x, mut y) = xy(motion);
        x.truncate(len);
        y.truncate(len);
        Series::line(motion.name, motion.role, x, y)
    };
    motions.iter().map(line).collect()
}

/// When the fastest coordinate of the truth (or of the first motion) has turned back or gone half round so many
/// times; `None` if none ever does. All coordinates share it, so that their figures can be compared.
fn window(coordinates: &Coordinates, motions: &[Motion], halves: usize) -> Option<f64> {
    let motion = motions
        .iter()
        .find(|motion| motion.role == Role::Truth)
        .or(motions.first())?;
    let ends = (0..coordinates.dof()).filter_map(|i| nth_half(motion, i, halves));
    ends.min_by(f64::total_cmp)
}

fn nth_half(motion: &Motion, i: usize, halves: usize) -> Option<f64> {
    let position = column(motion, &motion.trajectory.q, i);
    let velocity = column(motion, &motion.trajectory.qd, i);
    let (mut seen, mut start) = (0, *position.first()?);
    for (k, &q) in position.iter().enumerate().skip(1) {
        let back = velocity[k - 1] * velocity[k] < 0.0;
        if back || (q - start).abs() > PI {
            (seen, start) = (seen + 1, q);
        }
        if seen >= halves {
            return Some(motion.trajectory.t[k]);
        }
    }
    None
}

fn spoken(window: Option<f64>) -> String {
    window.map_or(String::from("The whole motion."), |end| {
        format!("The first {} s.", significant(end))
    })
}

pub(super) fn label(coordinates: &Coordinates, i: usize) -> (String, String) {
    let known = coordinates
        .0
        .get(i)
        .map(|coordinate| (coordinate.name.clone(), coordinate.unit.clone()));
    known.unwrap_or_else(|| (format!("q{}", i + 1), String::new()))
}

/// The axis of coordinate `i`.
fn quantity(coordinates: &Coordinates, i: usize) -> Axis {
    let (name, unit) = label(coordinates, i);
    if i < coordinates.dof() && coordinates.is_circle(i) {
        return Axis::linear(&format!("angle {name}"), &unit);
    }
    Axis::linear(&name, &unit)
}

/// Column `i` of a `[len, n]` signal; gaps where it has none.
fn column(motion: &Motion, signal: &[f64], i: usize) -> Vec<f64> {
    let n = motion.trajectory.dof();
    let value = |k: usize| {
        if i < n {
            signal.get(k * n + i).copied().unwrap_or(f64::NAN)
        } else {
            f64::NAN
        }
    };
    (0..motion.trajectory.len()).map(value).collect()
}

/// The range of all series, as far as it stays near the true one; `None` where no truth spans anything.
fn range_of_truth(series: &[Series]) -> Option<(f64, f64)> {
    let truth = series.iter().filter(|one| one.role == Role::Truth);
    let (low, high) = span(truth.flat_map(|one| &one.y));
    let all = span(series.iter().flat_map(|one| &one.y));
    let near = 0.5 * (high - low);
    let margin = 0.06 * (high - low);
    let range = (
        all.0.max(low - near) - margin,
        all.1.min(high + near) + margin,
    );
    (high > low).then_some(range)
}

/// Whether all motions keep to less than half the circle: small swings would be lost on the whole of it.
fn is_narrow(series: &[Series]) -> bool {
    let (low, high) = span(series.iter().flat_map(|one| &one.x));
    high - low < PI
}

/// The lowest and the highest finite value; an empty range where there is none.
fn span<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    finite.fold(start, |(low, high), value| {
        (low.min(*value), high.max(*value))
    })
}

/// Angles in (−π, π], with a gap wherever the next sample is on another turn.
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

/// A time without digits that nobody reads.
fn significant(seconds: f64) -> String {
    if seconds < 10.0 {
        format!("{seconds:.2}")
    } else {
        format!("{seconds:.0}")
    }
}
