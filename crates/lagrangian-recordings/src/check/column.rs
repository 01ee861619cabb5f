//! The columns of a recording, one by one.

use super::range;
use crate::Recording;
use crate::local_polynomial::Series;
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::upper_median;

/// One column of a recording.
pub(super) struct Column<'a> {
    pub(super) signal: Signal,
    pub(super) name: &'a str,
    pub(super) coordinate: usize,
    n: usize,
    values: &'a [f64],
}

impl<'a> Column<'a> {
    pub(super) fn iter(&self) -> impl Iterator<Item = f64> + 'a {
        let own = self.values.iter().skip(self.coordinate);
        own.step_by(self.n).copied()
    }

    pub(super) fn series(&self, t: &'a [f64]) -> Series<'a> {
        Series {
            t,
            y: self.values,
            n: self.n,
            coordinate: self.coordinate,
        }
    }

    pub(super) fn range(&self) -> (f64, f64) {
        range(self.iter())
    }

    pub(super) fn is_finite(&self) -> bool {
        self.iter().all(f64::is_finite)
    }

    pub(super) fn deviation(&self) -> f64 {
        let len = self.iter().count().max(1) as f64;
        let mean = self.iter().sum::<f64>() / len;
        (self.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / len).sqrt()
    }

    /// Standard deviation of the noise that is present throughout, from the median third difference: the deviation of that is √20 times
    /// as large, and short peaks of a fast motion do not change it.
    pub(super) fn steady_noise(&self) -> f64 {
        let values: Vec<f64> = self.iter().collect();
        let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
        let mut differences: Vec<f64> = values.windows(4).map(third).collect();
        // 1.4826: the median absolute deviation of a normal distribution, in standard deviations.
        1.4826 * upper_median(&mut differences) / 20.0_f64.sqrt()
    }
}

/// The columns of all signals that were recorded.
pub(super) fn columns(recording: &Recording) -> Vec<Column<'_>> {
    let n = recording.dof();
    let of_signal = |(signal, values): (Signal, _)| {
        let names = recording.columns.signals.get(signal);
        (0..n).map(move |coordinate| Column {
            signal,
            name: names.get(coordinate).map_or(signal.name(), String::as_str),
            coordinate,
            n,
            values,
        })
    };
    let all = recording.known().flat_map(of_signal);
    // A force without a column is 0 by declaration.
    all.filter(|column| !column.name.is_empty()).collect()
}
