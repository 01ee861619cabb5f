//! The figures of a comparison: losses, errors along the motions, and the first motion with its forces as each model predicts them.

use lagrangian::{Coordinates, Signal, Trajectory};
use lagrangian_report::{Axis, Figure, Motion, Role, Series, loss_curves, trajectories};

use super::measured::{Measured, Shown};
use super::page::role;
use super::{Comparison, Run};
use lagrangian_report::force_unit;

/// Samples of a motion that are drawn, at most.
const DRAWN: usize = 4000;

/// The losses of validation over the steps.
pub(super) fn losses(comparison: &Comparison, runs: &[Run]) -> Figure {
    let line = |(k, run): (usize, &Run)| {
        let known = run.metrics.iter();
        let known = known.filter_map(|m| Some((m.step as f64, *m.figures.get("loss/validation")?)));
        let (x, y) = known.unzip();
        Series::line(&run.name, role(k), x, y)
    };
    let figure = loss_curves("step", "", runs.iter().enumerate().map(line).collect());
    Figure {
        caption: match comparison.losses_differ.is_empty() {
            true => "The loss of the validation of each fit.".into(),
            false => "The loss of the validation of each fit: of different kinds or data, so that only its course tells something.".into(),
        },
        ..figure
    }
}

/// The errors in the blocks of the motions.
pub(super) fn blocks(measured: &Measured, names: &[&str]) -> Option<Figure> {
    let (signal, each) = measured.blocks.as_ref()?;
    let points = |(k, means): (usize, &Vec<f64>)| {
        let x = (1..=means.len()).map(|block| block as f64).collect();
        Series::line(
            names[k],
            role(k),
            x,
            means.iter().map(|x| 100.0 * x).collect(),
        )
    };
    Some(Figure {
        id: "blocks".into(),
        title: format!("Error of the {signal}s along the motions"),
        caption: "In each block of the motions, of the variance of the signal: where one is better everywhere, the difference is sure.".into(),
        x: Axis::linear("block of the motions", ""),
        y: Axis::log("squared error", "%"),
        series: each.iter().enumerate().map(points).collect(),
    })
}

/// The coordinates of the first motion, recorded and as each model predicts them from its first state.
pub(super) fn motions(
    truth: &Trajectory,
    coordinates: &Coordinates,
    measured: &Measured,
    names: &[&str],
) -> Vec<Figure> {
    let mut motions = vec![Motion::new("recorded", Role::Truth, truth)];
    for (k, Shown { rollout, .. }) in measured.shown.iter().enumerate() {
        let rollout = rollout.iter().filter(|rollout| !rollout.is_empty());
        motions.extend(rollout.map(|own| Motion::new(names[k], role(k), own)));
    }
    let moving = (0..coordinates.dof()).filter(|&i| !coordinates.is_parameter(i));
    moving
        .map(|i| trajectories(coordinates, i, &motions))
        .collect()
}

/// The forces along the first motion, recorded and predicted.
pub(super) fn torques(
    truth: &Trajectory,
    coordinates: &Coordinates,
    measured: &Measured,
    names: &[&str],
) -> Vec<Figure> {
    let (n, Some(recorded)) = (coordinates.dof(), truth.values(Signal::Tau)) else {
        return Vec::new();
    };
    let rows = truth.len().min(DRAWN);
    let line = |name: &str, role, values: &[f64], i: usize| {
        let column = values.iter().skip(i).step_by(n).take(rows).copied();
        Series::line(name, role, truth.t[..rows].to_vec(), column.collect())
    };
    let figure = |i: usize| {
        let coordinate = &coordinates.0[i];
        let mut series = vec![line("recorded", Role::Truth, recorded, i)];
        for (k, own) in measured.shown.iter().enumerate() {
            let predicted = own.torques.iter();
            series.extend(predicted.map(|own| line(names[k], role(k), own, i)));
        }
        Figure {
            id: format!("torque-{}", i + 1),
            title: format!("Force on {}", coordinate.name),
            caption:
                "Along the first motion, at its recorded positions, velocities and accelerations."
                    .into(),
            x: Axis::linear("time", "s"),
            y: Axis::linear("force", force_unit(&coordinate.unit)),
            series,
        }
    };
    let any = measured.shown.iter().any(|own| own.torques.is_some());
    (0..n).filter(|_| any).map(figure).collect()
}
