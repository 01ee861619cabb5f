//! Data of the plots for the script of a page: axes, series and maps, with their numbers.

use std::collections::BTreeMap;

use serde::Serialize;

use super::arrays::{Arrays, Spread, is_regular};
use crate::draw::theme;
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
    /// The inks on paper.
    paper: BTreeMap<&'static str, String>,
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
    /// Its ends, if they do not follow from the data.
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<(f64, f64)>,
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
    pub(super) fn for_figures<'a>(figures: impl Iterator<Item = &'a Figure> + Clone) -> Self {
        let all = || figures.clone().flat_map(|figure| &figure.series);
        let mut most = all().map(|one| one.y.len()).max().unwrap_or(0);
        while all().map(|one| cost(one, most)).sum::<usize>() > BUDGET {
            most /= 2;
        }
        Self {
            most,
            paper: theme::paper(),
            ..Self::default()
        }
    }

    /// The number of the plot of a figure; `None` if there is nothing to draw.
    pub(super) fn figure(&mut self, figure: &Figure) -> Option<usize> {
        let all = || figure.series.iter();
        let x = figure.x.extent(all().flat_map(|one| &one.x))?;
        let ordinates = all().flat_map(|one| [&one.y, &one.y_low, &one.y_high]);
        let y = figure.y.extent(ordinates.flatten())?;
        let series = all().map(|one| {
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
                width: theme::width(one.role),
                dash: one.role == Role::Reference,
                depth: theme::depth(one.role),
                y: add(&one.y),
                low,
                high,
                x: self.arrays.add(&one.x, spread(&figure.x, x, &one.x)),
            }
        });
        let series = series.collect();
        Some(self.push(Plot {
            title: figure.title.clone(),
            words: String::new(),
            x: axis(&figure.x),
            y: axis(&figure.y),
            series,
            map: None,
        }))
    }

    /// The number of the plot of a map; `None` if it has no cells or no axes.
    pub(super) fn map(&mut self, map: &HeatMap) -> Option<usize> {
        map.x.fixed().and(map.y.fixed())?;
        if map.rows() == 0 || !map.limit.is_finite() || map.limit <= 0.0 {
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
            x: axis(&map.x),
            y: axis(&map.y),
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

    /// Whether the page has no plot.
    pub(super) fn is_empty(&self) -> bool {
        self.plots.is_empty()
    }

    /// The data for a script element; `None` without plots.
    pub(super) fn json(&self) -> Option<String> {
        let json = serde_json::to_string(self).ok()?;
        let safe = |json: String| json.replace('<', "\\u003c").replace('\'', "\\u0027");
        (!self.is_empty()).then(|| safe(lagrangian::text::shown_json(&json)))
    }
}

/// The name of the element that describes a plot in words.
pub(super) fn words_id(number: usize) -> String {
    format!("words-{number}")
}

fn optional(values: &[f64], add: &mut impl FnMut(&[f64]) -> usize) -> Option<usize> {
    (!values.is_empty()).then(|| add(values))
}

fn axis(axis: &Axis) -> PlotAxis {
    PlotAxis {
        label: axis.label.clone(),
        unit: axis.unit.clone(),
        log: axis.scale == Scale::Log,
        range: axis.fixed(),
        names: (!axis.names.is_empty()).then(|| axis.names.clone()),
    }
}

/// Ratios on a logarithmic axis, and for values far outside of their axis, which ends where the data do unless it is fixed.
fn spread(axis: &Axis, data: (f64, f64), values: &[f64]) -> Spread {
    let (low, high) = axis.fixed().unwrap_or(data);
    let limit = RUNAWAY * (high - low);
    let runs_away = |value: &f64| value.is_finite() && (value - 0.5 * (low + high)).abs() > limit;
    match axis.scale {
        Scale::Linear if !values.iter().any(runs_away) => Spread::Even,
        _ => Spread::Wide,
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
