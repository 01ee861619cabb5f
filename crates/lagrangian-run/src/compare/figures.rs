//! The figures of a comparison: errors along the motions, the first motion with its forces as each model predicts them, and losses.

use lagrangian::trajectory::Signal;
use lagrangian::{Coordinates, Model, Trajectory};
use lagrangian_report::{
    Axis, Figure, Motion, Role, Series, force_unit, loss_curves, trajectories,
};

use super::measured::Predicted;
use super::{Comparison, LoadedRun, VALIDATION_LOSS};
use crate::metrics::Metric;

/// The largest number of samples of a motion that are drawn.
const DRAWN: usize = 4000;

/// Figures under their headings.
pub(super) fn of(
    comparison: &Comparison,
    runs: &[LoadedRun],
    first: Option<&Trajectory>,
    predicted: &[Predicted],
) -> [(&'static str, Vec<Figure>); 2] {
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let coordinates = runs[0].model.coordinates();
    let mut motions: Vec<Figure> = blocks(comparison).into_iter().collect();
    if let Some(truth) = first {
        motions.extend(positions(truth, coordinates, predicted, &names));
        motions.extend(torques(truth, coordinates, predicted, &names));
    }
    let mut figures = [
        ("Errors and motions", motions),
        ("Training", vec![losses(comparison, runs)]),
    ];
    for (_, own) in &mut figures {
        own.retain(|figure| figure.series.iter().any(|series| !series.x.is_empty()));
    }
    figures
}

fn role(k: usize) -> Role {
    Role::Other(u8::try_from(k).unwrap_or(u8::MAX))
}

/// The losses of validation over the steps.
fn losses(comparison: &Comparison, runs: &[LoadedRun]) -> Figure {
    let line = |(k, run): (usize, &LoadedRun)| {
        let (x, y) = Metric::curve(&run.metrics, VALIDATION_LOSS);
        Series::line(&run.name, role(k), x, y)
    };
    Figure {
        caption: match comparison.losses_differ.is_empty() {
            true => "The loss of the validation of each fit.".into(),
            false => "The loss of the validation of each fit: of different kinds or data, so that only its course tells something.".into(),
        },
        ..loss_curves("step", "", runs.iter().enumerate().map(line).collect())
    }
}

/// The errors in the blocks of the motions, of the first figure over all coordinates that every run has.
fn blocks(comparison: &Comparison) -> Option<Figure> {
    let signals = comparison.figures.iter().filter_map(|row| {
        let signal = row.signal.of_variance()?;
        Some((signal, row)).filter(|_| row.coordinate.is_none())
    });
    let mut whole = signals.filter(|(_, row)| row.blocks.iter().all(Option::is_some));
    let (signal, row) = whole.next()?;
    let pairs = comparison.runs.iter().zip(row.blocks.iter().flatten());
    let points = pairs.enumerate().map(|(k, (run, blocked))| {
        let x = (1..=blocked.means.len())
            .map(|block| block as f64)
            .collect();
        let y = blocked.means.iter().map(|x| 100.0 * x).collect();
        Series::line(&run.name, role(k), x, y)
    });
    Some(Figure {
        id: "blocks".into(),
        title: format!("Error of the {signal}s along the motions"),
        caption: "In each block of the motions, of the variance of the signal: where one is better everywhere, the difference is sure.".into(),
        x: Axis::linear("block of the motions", ""),
        y: Axis::log("squared error", "%"),
        series: points.collect(),
    })
}

/// The coordinates of the first motion, recorded and as each model predicts them from its first state.
fn positions(
    truth: &Trajectory,
    coordinates: &Coordinates,
    predicted: &[Predicted],
    names: &[&str],
) -> Vec<Figure> {
    let mut motions = vec![Motion::new("recorded", Role::Truth, truth)];
    for (k, own) in predicted.iter().enumerate() {
        let rollout = own.rollouts.first().map(|rollout| &rollout.trajectory);
        let rollout = rollout.filter(|rollout| !rollout.is_empty());
        motions.extend(rollout.map(|own| Motion::new(names[k], role(k), own)));
    }
    let moving = (0..coordinates.dof()).filter(|&i| !coordinates.is_parameter(i));
    let figure = |i| trajectories(coordinates, i, &motions);
    moving.map(figure).collect()
}

/// The forces along the first motion, recorded and predicted.
fn torques(
    truth: &Trajectory,
    coordinates: &Coordinates,
    predicted: &[Predicted],
    names: &[&str],
) -> Vec<Figure> {
    let (n, Some(recorded)) = (coordinates.dof(), truth.values(Signal::Tau)) else {
        return Vec::new();
    };
    let mut lines = vec![("recorded", Role::Truth, recorded)];
    for (k, own) in predicted.iter().enumerate() {
        let own = own.torques.iter().flat_map(|motions| motions.first());
        lines.extend(own.map(|own| (names[k], role(k), own.as_slice())));
    }
    let rows = truth.len().min(DRAWN);
    let figure = |i: usize| {
        let coordinate = &coordinates.0[i];
        let line = |&(name, role, values): &(&str, Role, &[f64])| {
            let column = values.iter().skip(i).step_by(n).take(rows).copied();
            Series::line(name, role, truth.t[..rows].to_vec(), column.collect())
        };
        Figure {
            id: format!("torque-{}", i + 1),
            title: format!("Force on {}", coordinate.name),
            caption:
                "Along the first motion, at its recorded positions, velocities and accelerations."
                    .into(),
            x: Axis::linear("time", "s"),
            y: Axis::linear("force", force_unit(&coordinate.unit)),
            series: lines.iter().map(line).collect(),
        }
    };
    (0..n).filter(|_| lines.len() > 1).map(figure).collect()
}
