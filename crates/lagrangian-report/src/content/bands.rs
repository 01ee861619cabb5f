//! Figure of a signal with the band in which it is expected.

use super::coordinate::{near, span};
use super::{Axis, Figure, Kind, Role, Series};

/// Largest number of samples of a motion that are drawn: beyond, bands overlap.
const DRAWN: usize = 2000;

/// A signal over time with its band: the measured and the predicted values, and the uncertainty of the latter, `[len]` each.
#[derive(Debug, Clone, PartialEq)]
pub struct Banded {
    /// Times, s.
    pub t: Vec<f64>,
    /// Measured values; empty without any.
    pub measured: Vec<f64>,
    /// Predicted values.
    pub mean: Vec<f64>,
    /// The lower end of the band.
    pub low: Vec<f64>,
    /// The upper end of the band.
    pub high: Vec<f64>,
}

impl Banded {
    /// The figure of this signal, with the given axis. A band that grows without bound does not flatten the signal.
    #[must_use]
    pub fn figure(mut self, id: &str, title: String, caption: String, axis: Axis) -> Figure {
        for signal in [
            &mut self.t,
            &mut self.measured,
            &mut self.mean,
            &mut self.low,
            &mut self.high,
        ] {
            signal.truncate(DRAWN);
        }
        let lines = span(self.measured.iter().chain(&self.mean));
        let range = near(lines, span(self.low.iter().chain(&self.high)));
        let times = || self.t.clone();
        let measured = Series::line("measured", Role::Truth, times(), self.measured.clone());
        let band = Series {
            kind: Kind::Band,
            y_low: self.low,
            y_high: self.high,
            ..Series::line("predicted", Role::Lnn, times(), self.mean)
        };
        let mut series = vec![measured, band];
        series.retain(|one| !one.y.is_empty());
        Figure {
            id: id.into(),
            title,
            caption,
            x: Axis::linear("time", "s"),
            y: Axis { range, ..axis },
            series,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn banded(width: f64) -> Figure {
        let t: Vec<f64> = (0..3000).map(|k| f64::from(k) * 1e-3).collect();
        let of = |shift: f64| t.iter().map(|t| t.sin() + shift).collect::<Vec<_>>();
        let own = Banded {
            measured: of(0.0),
            mean: of(0.1),
            low: of(0.1 - width),
            high: of(0.1 + width),
            t: t.clone(),
        };
        own.figure(
            "band",
            "a band".into(),
            String::new(),
            Axis::linear("force", "N"),
        )
    }

    #[test]
    fn a_wide_band_does_not_flatten_the_signal() {
        let (narrow, wide) = (banded(0.2), banded(1e6));
        let span = |figure: &Figure| figure.y.range.map_or(0.0, |(low, high)| high - low);
        assert!(span(&narrow) > 1.0 && span(&narrow) < 2.0, "{narrow:?}");
        assert!(span(&wide) < 3.0 * span(&narrow));
        assert_eq!(narrow.series[1].kind, Kind::Band);
        assert_eq!(narrow.series[1].y_high.len(), DRAWN);
    }
}
