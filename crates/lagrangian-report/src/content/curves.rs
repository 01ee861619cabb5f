//! Figures of curves: losses and energy errors.

use super::{Axis, Figure, Series};

/// Loss over training steps (or seconds, according to `progress` and its unit) on a log axis.
///
/// ```
/// use lagrangian_report::{Role, Series, loss_curves};
/// let (step, loss) = (vec![0.0, 1.0, 2.0], vec![1.0, 1e-2, 1e-4]);
/// let lnn = Series::line("Lagrangian, training", Role::Lnn, step, loss.clone());
/// assert_eq!(loss_curves("step", "", vec![lnn]).series[0].y, loss);
/// ```
#[must_use]
pub fn loss_curves(progress: &str, unit: &str, series: Vec<Series>) -> Figure {
    Figure {
        id: "loss".into(),
        title: "Loss".into(),
        caption:
            "How the loss fell while training; validation is data that the optimiser never saw."
                .into(),
        x: Axis::linear(progress, unit),
        y: Axis::log("loss", ""),
        series,
    }
}

/// |E(t) − E(0)| over the energy scale, in percent, on a log axis. The series hold fractions; exact zeros are gaps.
#[must_use]
pub fn energy_error_over_time(mut series: Vec<Series>) -> Figure {
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
