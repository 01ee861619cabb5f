//! Figures of curves: losses and energy errors.

use super::{Axis, Figure, Role, Series};

/// A curve with a name and a role; the shorter of `x` and `y` counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// The system or model that it belongs to, which gives it its colour.
    pub role: Role,
    /// Abscissae.
    pub x: &'a [f64],
    /// Ordinates.
    pub y: &'a [f64],
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

/// A line for each curve.
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
