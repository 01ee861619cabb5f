//! The columns of a recording, one by one.

use super::range;
use crate::Recording;
use crate::local_polynomial::Series;
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::{deviation, sort_numbers, upper_median};

/// One column of a recording.
pub(super) struct Column<'a> {
    pub(super) signal: Signal,
    pub(super) name: &'a str,
    pub(super) coordinate: usize,
    pub(super) series: Series<'a>,
}

impl<'a> Column<'a> {
    pub(super) fn iter(&self) -> impl Iterator<Item = f64> + 'a {
        let own = self.series.y.iter().skip(self.coordinate);
        own.step_by(self.series.n).copied()
    }

    pub(super) fn range(&self) -> (f64, f64) {
        range(self.iter())
    }

    /// Smallest step between the values, within which they are rounded; 0 if they are all equal.
    pub(super) fn quantum(&self) -> f64 {
        let mut values: Vec<f64> = self.iter().collect();
        sort_numbers(&mut values);
        let span = values.last().unwrap_or(&0.0) - values.first().unwrap_or(&0.0);
        let steps = values.windows(2).map(|w| w[1] - w[0]);
        steps.filter(|d| *d > 1e-9 * span).fold(span, f64::min)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.iter().all(f64::is_finite)
    }

    pub(super) fn deviation(&self) -> f64 {
        deviation(&mut self.iter())
    }

    /// Standard deviation of the noise that is present throughout, from the median third difference: the deviation of that is √20 times
    /// as large, and short peaks of a fast motion do not change it.
    pub(super) fn steady_noise(&self) -> f64 {
        let values: Vec<f64> = self.iter().collect();
        let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
        let mut differences: Vec<f64> = values.windows(4).map(third).collect();
        robust_deviation(&mut differences) / 20.0_f64.sqrt()
    }
}

/// The columns of all signals that were recorded.
pub(super) fn columns(recording: &Recording) -> Vec<Column<'_>> {
    let of_signal = |(signal, values): (Signal, _)| {
        let names = recording.columns.signals.get(signal);
        (0..recording.dof()).map(move |coordinate| Column {
            signal,
            name: names.get(coordinate).map_or(signal.name(), String::as_str),
            coordinate,
            series: Series::of(recording, values, coordinate),
        })
    };
    let all = recording.known().flat_map(of_signal);
    // A force without a column is 0 by declaration.
    all.filter(|column| !column.name.is_empty()).collect()
}

/// Standard deviation of values about 0 from the median of their sizes, as for a normal distribution.
pub(super) fn robust_deviation(sizes: &mut [f64]) -> f64 {
    1.4826 * upper_median(sizes)
}
