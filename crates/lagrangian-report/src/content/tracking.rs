//! Figures of a reference and the motions that followed it.

use lagrangian::{Coordinates, Trajectory};

use super::coordinate::{column, label};
use super::{Axis, Figure, Motion, Role, Series};

fn line(name: &str, role: Role, motion: &Trajectory, i: usize) -> Series {
    let q = column(&motion.q, i, motion.dof());
    Series::line(name, role, motion.t.clone(), q)
}

/// Coordinate `i` of a reference and of all its followers, over time.
#[must_use]
pub fn followed_motion(
    coordinates: &Coordinates,
    i: usize,
    reference: &Trajectory,
    followers: &[Motion],
) -> Figure {
    let (name, unit) = label(coordinates, i);
    let mut series = vec![line("reference", Role::Reference, reference, i)];
    let motions = followers.iter();
    series.extend(motions.map(|own| line(own.name, own.role, own.trajectory, i)));
    Figure {
        id: format!("motion-{}", i + 1),
        title: format!("Motion of {name}"),
        caption: "The reference, and what the robot made of it.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear(&name, &unit),
        series,
    }
}

/// Tracking errors of coordinate `i` over time, in thousandths of its unit: reference minus motion at the samples of each motion,
/// `[samples, n]`.
#[must_use]
pub fn tracking_error(
    coordinates: &Coordinates,
    i: usize,
    followers: &[(Motion, &[f64])],
) -> Figure {
    let (name, unit) = label(coordinates, i);
    // In thousandths of the unit, if it is known.
    let (size, unit) = match unit.is_empty() {
        true => (1.0, String::new()),
        false => (1e3, format!("m{unit}")),
    };
    let error = |(motion, error): &(Motion, &[f64])| {
        let error = column(error, i, coordinates.dof()).into_iter();
        let error = error.map(|e| size * e).collect();
        Series::line(motion.name, motion.role, motion.trajectory.t.clone(), error)
    };
    Figure {
        id: format!("error-{}", i + 1),
        title: format!("Tracking error of {name}"),
        caption: "Reference minus motion.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("error", &unit),
        series: followers.iter().map(error).collect(),
    }
}
