//! The figure of a torque and its parts.

use lagrangian::Coordinates;
use lagrangian::torque::TorquePrediction;

use super::coordinate::{column, force_unit, label};
use super::{Axis, Figure, Role, Series};

/// Largest number of samples that are drawn: about a minute of a slow log, some seconds of a fast one.
const DRAWN: usize = 4000;

/// The force on coordinate `i` over time, measured and predicted, and the parts of the prediction.
#[must_use]
pub fn torque_parts(coordinates: &Coordinates, i: usize, prediction: &TorquePrediction) -> Figure {
    let n = coordinates.dof();
    let drawn = prediction.t.len().min(DRAWN);
    let t = || prediction.t[..drawn].to_vec();
    let column = |values: &[f64]| {
        let mut own = column(values, i, n);
        own.truncate(drawn);
        own
    };
    let mut series = Vec::new();
    for (role, (name, part)) in (0..).zip(prediction.parts.named()) {
        if part.iter().any(|x| x.abs() > 0.0) {
            series.push(Series::line(name, Role::Other(role), t(), column(part)));
        }
    }
    if let Some(measured) = &prediction.measured {
        series.push(Series::line("measured", Role::Truth, t(), column(measured)));
    }
    let total = column(&prediction.parts.total());
    series.push(Series::line("predicted", Role::Lnn, t(), total));
    let (name, unit) = label(coordinates, i);
    Figure {
        id: format!("torque-{}", i + 1),
        title: format!("Force on {name}"),
        caption: "The parts add up to the prediction; inertial is the force of the acceleration, gravity the force that holds the system at rest.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("force", force_unit(&unit)),
        series,
    }
}
