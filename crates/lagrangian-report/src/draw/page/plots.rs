//! Data of the plots for the script of a page: axes, series and maps, with their numbers.

use serde::Serialize;

use super::arrays::{Arrays, Spread, is_regular};
use crate::draw::axes::Axes;
use crate::draw::{series, theme};
use crate::{Axis, Figure, HeatMap, Kind, Role, Scale, Series, decimate};

/// Largest number of values in a page: with four letters each, a page stays below 2 MB.
const BUDGET: usize = 320_000;
/// A series that spans this many times its axis is stored by ratios.
const RUNAWAY: f64 = 100.0;

/// The plots of a page and the arrays that they share.
#[derive(Debug, Default, Serialize)]
pub(super) struct Plots {
    arrays: Arrays,
    plots: Vec<Plot>,
    /// Largest number of samples of a series.
    #[serde(skip)]
    most: usize,
}

#[derive(Debug, Serialize)]
struct Plot {
    title: String,
    /// The element with the description in words.
    words: String,
    x: PlotAxis,
    y: PlotAxis,
    series: Vec<PlotSeries>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<PlotMap>,
}

#[derive(Debug, Serialize)]
struct PlotAxis {
    label: String,
    unit: String,
    log: bool,
    /// Whether its ends are independent of the data.
    fixed: bool,
    /// Its ends; logarithms on a logarithmic axis.
    ends: [f64; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    names: Option<Vec<String>>,
}

#[derive(Debug, Serialize)]
struct PlotSeries {
    name: String,
    ink: &'static str,
    kind: Kind,
    width: f64,
    dash: bool,
    depth: u8,
    x: usize,
    y: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    low: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    high: Option<usize>,
}

#[derive(Debug, Serialize)]
struct PlotMap {
    columns: usize,
    rows: usize,
    values: usize,
    limit: f64,
}

impl Plots {
    /// An empty set with a budget for the plots of `figures`.
    pub(super) fn for_figures(figures: &[Figure]) -> Self {
        let all = || figures.iter().flat_map(|figure| &figure.series);
        let mut most = all().map(|one| one.y.len()).max().unwrap_or(0);
        while all().map(|one| cost(one, most)).sum::<usize>() > BUDGET {
            most /= 2;
        }
        Self {
            most,
            ..Self::default()
        }
    }

    /// The number of the plot of a figure; `None` if there is nothing to draw.
    pub(super) fn figure(&mut self, figure: &Figure) -> Option<usize> {
        let axes = Axes::new(figure)?;
        let [x, y] = axes.ends();
        let along = by_scale(&figure.x);
        let series = figure.series.iter().map(|one| {
            let one = thinned(one, self.most);
            let mut add = |values: &[f64]| {
                let spread = spread(&figure.y, y, values);
                self.arrays.add(values, spread)
            };
            let (low, high) = (
                optional(&one.y_low, &mut add),
                optional(&one.y_high, &mut add),
            );
            PlotSeries {
                name: one.name.clone(),
                ink: theme::of(one.role).name,
                kind: one.kind,
                width: series::width(one.role),
                dash: one.role == Role::Reference,
                depth: series::depth(one.role),
                y: add(&one.y),
                low,
                high,
                x: self.arrays.add(&one.x, along),
            }
        });
        let series = series.collect();
        Some(self.push(Plot {
            title: figure.title.clone(),
            words: String::new(),
            x: axis(&figure.x, x),
            y: axis(&figure.y, y),
            series,
            map: None,
        }))
    }

    /// The number of the plot of a map; `None` if it has no cells or no axes.
    pub(super) fn map(&mut self, map: &HeatMap) -> Option<usize> {
        let (x, y) = (map.x.range?, map.y.range?);
        let drawn = |(low, high): (f64, f64)| low < high && (high - low).is_finite();
        let limited = map.limit.is_finite() && map.limit > 0.0;
        if map.rows() == 0 || !limited || !drawn(x) || !drawn(y) {
            return None;
        }
        let cells = &map.values[..map.rows() * map.columns];
        let cells = PlotMap {
            columns: map.columns,
            rows: map.rows(),
            values: self.arrays.add(cells, Spread::Even),
            limit: map.limit,
        };
        Some(self.push(Plot {
            title: map.title.clone(),
            words: String::new(),
            x: axis(&map.x, [x.0, x.1]),
            y: axis(&map.y, [y.0, y.1]),
            series: Vec::new(),
            map: Some(cells),
        }))
    }

    fn push(&mut self, plot: Plot) -> usize {
        let number = self.plots.len();
        let words = words_id(number);
        self.plots.push(Plot { words, ..plot });
        number
    }

    /// The data for a script element; `None` without plots.
    pub(super) fn json(&self) -> Option<String> {
        let json = serde_json::to_string(self).ok()?;
        let safe = |json: String| json.replace('<', "\\u003c").replace('\'', "\\u0027");
        (!self.plots.is_empty()).then(|| safe(lagrangian::shown_json(&json)))
    }
}

/// The name of the element that describes a plot in words.
pub(super) fn words_id(number: usize) -> String {
    format!("words-{number}")
}

fn optional(values: &[f64], add: &mut impl FnMut(&[f64]) -> usize) -> Option<usize> {
    (!values.is_empty()).then(|| add(values))
}

fn axis(axis: &Axis, ends: [f64; 2]) -> PlotAxis {
    PlotAxis {
        label: axis.label.clone(),
        unit: axis.unit.clone(),
        log: axis.scale == Scale::Log,
        fixed: axis.range.is_some(),
        ends,
        names: (!axis.names.is_empty()).then(|| axis.names.clone()),
    }
}

/// Ratios on a logarithmic axis, and for values far outside of their axis.
fn spread(axis: &Axis, ends: [f64; 2], values: &[f64]) -> Spread {
    let limit = RUNAWAY * (ends[1] - ends[0]);
    let middle = 0.5 * (ends[0] + ends[1]);
    let runs_away = |value: &f64| value.is_finite() && (value - middle).abs() > limit;
    if values.iter().any(runs_away) {
        return Spread::Wide;
    }
    by_scale(axis)
}

fn by_scale(axis: &Axis) -> Spread {
    match axis.scale {
        Scale::Log => Spread::Wide,
        Scale::Linear => Spread::Even,
    }
}

/// Number of values that a page uses for a series of at most `most` samples.
fn cost(series: &Series, most: usize) -> usize {
    let kept = series.y.len().min(most);
    let is_whole = kept == series.y.len();
    let abscissae = if is_whole && is_regular(&series.x) {
        0
    } else {
        kept
    };
    let band = if series.y_low.is_empty() { 0 } else { 2 * kept };
    abscissae + kept + band
}

/// At most about `most` samples: extremes in steps for a line over a rising abscissa, else every nth.
fn thinned(series: &Series, most: usize) -> Series {
    let len = series.y.len().min(series.x.len());
    if len <= most {
        return cut(series, len, 1);
    }
    let rising = series.x.windows(2).all(|pair| pair[0] <= pair[1]);
    if series.kind == Kind::Line && rising && most >= 8 {
        let (x, y) = decimate(&series.x, &series.y, most / 4);
        return Series {
            x,
            y,
            ..series.clone()
        };
    }
    cut(series, len, len.div_ceil(most.max(1)))
}

/// Every nth of the first `len` samples.
fn cut(series: &Series, len: usize, every: usize) -> Series {
    let kept = |values: &[f64]| values.iter().take(len).step_by(every).copied().collect();
    Series {
        x: kept(&series.x),
        y: kept(&series.y),
        y_low: kept(&series.y_low),
        y_high: kept(&series.y_high),
        name: series.name.clone(),
        ..*series
    }
}
