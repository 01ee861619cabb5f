//! Figure of quantities along an axis that the data cover in part: learned and true values, the members of
//! an ensemble, and the ends of the data.

use super::coordinate::span;
use super::{Axis, Figure, Kind, Role, Series};

/// A quantity that varies by less than this part of its size is drawn as nearly flat.
const FLAT: f64 = 0.1;

/// A quantity at the points of a [`Sweep`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Along {
    /// Its name; empty for a single quantity.
    pub name: String,
    /// Learned values, `[len]`.
    pub learned: Vec<f64>,
    /// True values, `[len]`; empty if unknown.
    pub truth: Vec<f64>,
    /// The members of an ensemble, `[members][len]`; empty without one.
    pub members: Vec<Vec<f64>>,
}

/// Quantities along one axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sweep {
    /// The points on the axis, increasing, `[len]`.
    pub at: Vec<f64>,
    /// The part of the axis that the data cover.
    pub data: (f64, f64),
    /// The quantities.
    pub quantities: Vec<Along>,
}

impl Sweep {
    /// The figure; the range outside of the data is shaded, and does not flatten the curves within.
    #[must_use]
    pub fn figure(&self, id: &str, title: String, caption: String, [x, y]: [Axis; 2]) -> Figure {
        let (low, high) = self.range();
        let mut series = self.shades(low, high);
        let line =
            |name: &str, role, y: &[f64]| Series::line(name, role, self.at.clone(), y.to_vec());
        for (k, own) in (0_u8..).zip(&self.quantities) {
            // Each kind of line is named once in the legend.
            let once = |name: &'static str| if k == 0 { name } else { "" };
            let role = match self.quantities.len() {
                1 => Role::Lnn,
                _ => Role::Other(k),
            };
            if !own.truth.is_empty() {
                series.push(line(once("true"), Role::Truth, &own.truth));
            }
            if !own.members.is_empty() {
                let name = once("members of the ensemble");
                let band = Series::range(name, role, self.at.clone(), &own.members);
                series.push(Series {
                    y: vec![f64::NAN; self.at.len()],
                    ..band
                });
            }
            let name = if own.name.is_empty() {
                "learned"
            } else {
                &own.name
            };
            series.push(line(name, role, &own.learned));
        }
        let ends = self.at.first().copied().zip(self.at.last().copied());
        Figure {
            id: id.into(),
            title,
            caption,
            x: Axis { range: ends, ..x },
            y: y.between(low, high),
            series,
        }
    }

    /// The shades of the parts of the axis that the data do not cover; they reach beyond its ends, which are moved outwards to ticks.
    fn shades(&self, low: f64, high: f64) -> Vec<Series> {
        let beyond = high - low;
        let names = ["outside of the data", ""].into_iter();
        let shade = |((from, to), name)| Series {
            kind: Kind::Band,
            y_low: vec![low - beyond; 2],
            y_high: vec![high + beyond; 2],
            ..Series::line(name, Role::Truth, vec![from, to], vec![f64::NAN; 2])
        };
        self.outside().into_iter().zip(names).map(shade).collect()
    }

    /// The parts of the axis that the data do not cover.
    fn outside(&self) -> Vec<(f64, f64)> {
        let (Some(&first), Some(&last)) = (self.at.first(), self.at.last()) else {
            return Vec::new();
        };
        let (low, high) = self.data;
        let parts = [(first, low.min(last)), (high.max(first), last)];
        parts.into_iter().filter(|(from, to)| from < to).collect()
    }

    /// Vertical range of all values within the data, and of those outside of them up to a distance equal to its width.
    fn range(&self) -> (f64, f64) {
        let known = |x: &f64| (self.data.0..=self.data.1).contains(x);
        let lines = || {
            self.quantities
                .iter()
                .flat_map(|own| [&own.learned, &own.truth])
        };
        let within = lines().flat_map(|y| self.at.iter().zip(y).filter(|(x, _)| known(x)));
        let (low, high) = span(within.map(|(_, y)| y));
        let (least, most) = span(lines().flatten());
        let broad = (high - low)
            .max(FLAT * low.abs().max(high.abs()))
            .max(f64::MIN_POSITIVE);
        match low <= high {
            true => (
                least.max(low - broad) - 0.06 * broad,
                most.min(high + broad) + 0.06 * broad,
            ),
            false => (0.0, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(data: (f64, f64)) -> Figure {
        let at: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.02 - 1.0).collect();
        let own = Along {
            learned: at.iter().map(|x| x.powi(2)).collect(),
            truth: at
                .iter()
                .map(|x| x.powi(2) + 100.0 * (x.abs() - 0.5).max(0.0))
                .collect(),
            ..Along::default()
        };
        let all = Sweep {
            at,
            data,
            quantities: vec![own],
        };
        all.figure(
            "v",
            "V".into(),
            String::new(),
            [Axis::linear("q", "rad"), Axis::linear("V", "J")],
        )
    }

    #[test]
    fn what_lies_outside_of_the_data_is_shaded_and_does_not_flatten_what_lies_within() {
        let figure = sweep((-0.5, 0.5));
        let shaded: Vec<&Series> = figure
            .series
            .iter()
            .filter(|s| s.kind == Kind::Band)
            .collect();
        assert_eq!(shaded.len(), 2);
        assert_eq!((shaded[0].x[1], shaded[1].x[0]), (-0.5, 0.5));
        assert!(shaded[0].name == "outside of the data" && shaded[1].name.is_empty());
        let (low, high) = figure.y.range.unwrap_or_default();
        assert!(low < 0.0 && high < 1.0, "{low} {high}");
        // The axis ends at ticks, up to a third of its length further out; the shade must reach as far.
        let reach = (shaded[0].y_low[0], shaded[0].y_high[0]);
        assert!(reach.0 < low - 0.5 * (high - low) && reach.1 > high + 0.5 * (high - low));
    }

    #[test]
    fn an_axis_that_the_data_cover_is_not_shaded() {
        assert!(
            sweep((-1.0, 1.0))
                .series
                .iter()
                .all(|s| s.kind == Kind::Line)
        );
    }
}
