//! The curves of the letters.

use lagrangian_report::{Axis, Figure, Series};

use super::Plan;
use super::SPEEDS;
use super::curve::Curve;
use super::main_fit::{Fitted, Found};

/// Errors below this are those of the data's own rounding: (N·m)² and nMSE.
const LEAST: f64 = 1e-13;

/// Points of the curve over training time.
const POINTS: u32 = 120;

/// Torque MSE on the test letters over the time of training.
pub(super) fn over_time(plan: &Plan, main: &[Found]) -> Figure {
    let first = 0.005 * plan.main;
    let at = |k: u32| first * (plan.main / first).powf(f64::from(k) / f64::from(POINTS - 1));
    let grid: Vec<f64> = (0..POINTS).map(at).collect();
    let series = |found: &Found| {
        let along = |run: &Fitted| -> Vec<f64> {
            let moments = &run.history.moments;
            let reached = |t: &f64| moments.iter().rfind(|m| m.seconds <= *t);
            grid.iter()
                .map(|t| reached(t).map_or(f64::NAN, |m| m.value))
                .collect()
        };
        let runs: Vec<Vec<f64>> = found.runs.iter().map(along).collect();
        Series::range(
            found.contestant.name,
            found.contestant.role,
            grid.clone(),
            &runs,
        )
    };
    Figure {
        id: "over-time".into(),
        title: "Error over training time".into(),
        caption: "Torque MSE on the test letters of the best model so far: median of the seeds and their range. The \
                  measurement comes after the fit and steers nothing."
            .into(),
        x: Axis::log("training time", "s"),
        y: Axis::log("torque MSE", "N²m²"),
        series: main.iter().filter(|f| f.contestant.is_trained()).map(series).collect(),
    }
}

/// Torque MSE over the number of training letters.
pub(super) fn learning(curve: &Curve) -> Figure {
    let x: Vec<f64> = curve.counts.iter().map(|count| *count as f64).collect();
    let series = curve
        .runs
        .iter()
        .map(|(contestant, runs)| Series::range(contestant.name, contestant.role, x.clone(), runs));
    Figure {
        id: "learning-curve".into(),
        title: "Learning curve".into(),
        caption: "Torque MSE on the test letters over the number of letters to learn from, chosen by the seed: median \
                  and range. The identified chain is given the structure of the arm, so that only the rounding of the \
                  data is left to it."
            .into(),
        x: Axis::log("training letters", ""),
        y: above_rounding(Axis::log("torque MSE", "N²m²"), series.clone()),
        series: series.map(named_if_unseen).collect(),
    }
}

/// Torque nMSE over the speed of writing.
pub(super) fn extrapolation(main: &[Found]) -> Figure {
    let series = main.iter().map(|found| {
        let runs: Vec<Vec<f64>> = found.runs.iter().map(|run| run.by_speed.clone()).collect();
        Series::range(
            found.contestant.name,
            found.contestant.role,
            SPEEDS.to_vec(),
            &runs,
        )
    });
    Figure {
        id: "faster".into(),
        title: "Faster than trained".into(),
        caption: "Torque error on the test letters written faster, q(t) → q(αt), as a share of the variance of the \
                  torque that this needs (inertial and Coriolis parts times α²: exact)."
            .into(),
        x: Axis::linear("times as fast", ""),
        y: above_rounding(Axis::log("torque nMSE", ""), series.clone()),
        series: series.map(named_if_unseen).collect(),
    }
}

/// A series that would not be seen says so in the legend.
fn named_if_unseen(series: Series) -> Series {
    if series.y.iter().any(|y| *y >= LEAST) {
        return series;
    }
    Series {
        name: format!("{} (below the axis)", series.name),
        ..series
    }
}

/// An axis that does not stretch to errors of rounding.
fn above_rounding(axis: Axis, series: impl Iterator<Item = Series>) -> Axis {
    let values = series.flat_map(|one| one.y_low.into_iter().chain(one.y_high));
    let (low, high) = values
        .filter(|y| *y >= LEAST)
        .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), y| {
            (low.min(y), high.max(y))
        });
    if low < high {
        axis.between(0.5 * low, 2.0 * high)
    } else {
        axis
    }
}
