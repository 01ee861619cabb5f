//! One figure on any canvas: legend, axes, grid, series.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::curve::Point;
use super::scale::{Laid, Tick};
use super::{UNIT, heat_map, legend, series, text, theme};
use crate::{Figure, HeatMap, Kind, Series};

pub(super) type Plot<DB> = DrawingArea<DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

pub(super) const SMALL: f64 = 12.0;
const HEADING: f64 = 15.0;

/// Draws a figure of `width` × `height` px, with its title where a `heading` is wanted.
pub(super) fn draw<DB: DrawingBackend>(
    canvas: DB,
    figure: &Figure,
    size: (u32, u32),
    heading: bool,
) -> Result<()> {
    draw_with(canvas, figure, size, heading, None)
}

/// The same, with the cells of a map in place of the series.
pub(super) fn draw_with<DB: DrawingBackend>(
    canvas: DB,
    figure: &Figure,
    (width, height): (u32, u32),
    heading: bool,
    map: Option<&HeatMap>,
) -> Result<()> {
    let root = canvas.into_drawing_area();
    root.fill(&theme::colour("surface")).map_err(plain)?;
    let (width, height) = (f64::from(width), f64::from(height));
    let mut top = 4.0;
    if heading {
        let title = text::fit(&figure.title, HEADING, width - 16.0);
        write(
            &root,
            &title,
            (8.0, top + 4.0),
            (HPos::Left, VPos::Top),
            HEADING,
            "ink",
        )?;
        top += 30.0;
    }
    top += legend::draw(&root, figure, top, width)?;
    let axes = Axes::new(figure);
    match axes {
        Some(axes) => plot(
            &root,
            (figure, map),
            &axes,
            Place {
                top: top + 22.0,
                width,
                height,
            },
        ),
        None => write(
            &root,
            "no finite data",
            (0.5 * width, 0.5 * height),
            (HPos::Center, VPos::Center),
            13.0,
            "muted",
        ),
    }?;
    root.present().map_err(plain)
}

pub(super) struct Axes {
    x: Laid,
    y: Laid,
}

impl Axes {
    fn new(figure: &Figure) -> Option<Self> {
        let dots = figure
            .series
            .iter()
            .any(|series| series.kind == Kind::Points);
        let xs = figure
            .series
            .iter()
            .flat_map(|series| series.x.iter().copied());
        let ys = figure
            .series
            .iter()
            .flat_map(|series| [&series.y, &series.y_low, &series.y_high])
            .flatten()
            .copied();
        let x = Laid::new(&figure.x, xs, if dots { 0.04 } else { 0.0 })?;
        Some(Self {
            x,
            y: Laid::new(&figure.y, ys, 0.06)?,
        })
    }

    pub(super) fn points(&self, x: &[f64], y: &[f64]) -> Vec<Point> {
        x.iter()
            .zip(y)
            .map(|(&x, &y)| (self.x.at(x), self.y.at(y)))
            .collect()
    }
}

/// Where the plot stands on the canvas, px.
struct Place {
    top: f64,
    width: f64,
    height: f64,
}

fn plot<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    (figure, map): (&Figure, Option<&HeatMap>),
    axes: &Axes,
    place: Place,
) -> Result<()> {
    let bottom = 40.0;
    let tall = (place.height - place.top - bottom).max(20.0);
    let y_ticks = tall_enough(&axes.y, tall);
    let widest = y_ticks
        .iter()
        .map(|tick| text::width(&tick.label, SMALL))
        .fold(0.0, f64::max);
    let (left, right) = (1.06 * widest + 16.0, 18.0);
    let wide = (place.width - left - right).max(20.0);
    let x_ticks = roomy(&axes.x, wide);
    let area = root.margin(units(place.top), units(bottom), units(left), units(right));
    let chart = ChartBuilder::on(&area)
        .build_cartesian_2d(0.0..1.0, 0.0..1.0)
        .map_err(plain)?;
    let plot = chart.plotting_area();
    grid(plot, &x_ticks, &y_ticks)?;
    for tick in &y_ticks {
        let at = (left - 8.0, place.top + (1.0 - tick.at) * tall);
        write(
            root,
            &tick.label,
            at,
            (HPos::Right, VPos::Center),
            SMALL,
            "muted",
        )?;
    }
    for tick in &x_ticks {
        let at = (left + tick.at * wide, place.top + tall + 7.0);
        write(
            root,
            &tick.label,
            at,
            (HPos::Center, VPos::Top),
            SMALL,
            "muted",
        )?;
    }
    let y_label = text::fit(&figure.y.text(), SMALL, place.width - 16.0);
    write(
        root,
        &y_label,
        (8.0, place.top - 10.0),
        (HPos::Left, VPos::Bottom),
        SMALL,
        "muted",
    )?;
    let x_label = text::fit(&figure.x.text(), SMALL, place.width - 16.0);
    write(
        root,
        &x_label,
        (left + wide, place.height - 2.0),
        (HPos::Right, VPos::Bottom),
        SMALL,
        "muted",
    )?;
    if let Some(map) = map {
        return heat_map::cells(plot, map);
    }
    let mut series: Vec<&Series> = figure.series.iter().collect();
    series.sort_by_key(|series| series::depth(series.role));
    series
        .into_iter()
        .try_for_each(|series| series::draw(plot, axes, series, (wide, tall)))
}

/// As many ticks as have room beside each other.
fn roomy(axis: &Laid, wide: f64) -> Vec<Tick> {
    if axis.has_names() {
        return axis.ticks(0);
    }
    let fits = |ticks: &[Tick]| {
        let widest = ticks
            .iter()
            .map(|tick| text::width(&tick.label, SMALL))
            .fold(0.0, f64::max);
        ticks
            .windows(2)
            .all(|pair| (pair[1].at - pair[0].at) * wide > widest + 18.0)
    };
    let most = ((wide / 56.0) as usize).clamp(2, 12);
    (1..=most)
        .rev()
        .map(|count| axis.ticks(count))
        .find(|ticks| fits(ticks))
        .unwrap_or_default()
}

/// A tick about every 42 px, and three where that gives fewer.
fn tall_enough(axis: &Laid, tall: f64) -> Vec<Tick> {
    let wanted = ((tall / 42.0) as usize).clamp(2, 8);
    let enough = (wanted..12)
        .map(|count| axis.ticks(count))
        .find(|ticks| ticks.len() > 2);
    enough.unwrap_or_else(|| axis.ticks(wanted))
}

fn grid<DB: DrawingBackend>(plot: &Plot<DB>, x_ticks: &[Tick], y_ticks: &[Tick]) -> Result<()> {
    let line = |from: Point, to: Point, ink: &str| {
        let style = theme::colour(ink).stroke_width(units(1.0) as u32);
        plot.draw(&PathElement::new(vec![from, to], style))
            .map_err(plain)
    };
    for tick in y_ticks {
        line((0.0, tick.at), (1.0, tick.at), "grid")?;
    }
    for tick in x_ticks {
        line((tick.at, 0.0), (tick.at, 1.0), "grid")?;
    }
    line((0.0, 0.0), (1.0, 0.0), "axis")
}

/// Writes a text at a place in px.
pub(super) fn write<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    words: &str,
    (x, y): Point,
    (h_pos, v_pos): (HPos, VPos),
    size: f64,
    ink: &str,
) -> Result<()> {
    let weight = if size >= HEADING {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    let font = FontDesc::new(FontFamily::SansSerif, f64::from(units(size)), weight);
    let colour = theme::colour(ink);
    let style = TextStyle::from(font)
        .color(&colour)
        .pos(Pos::new(h_pos, v_pos));
    root.draw(&Text::new(words.to_owned(), (units(x), units(y)), style))
        .map_err(plain)
}

/// From px to the units of a canvas.
pub(super) fn units(px: f64) -> i32 {
    (px * f64::from(UNIT)).round() as i32
}

pub(super) fn plain<E: std::error::Error + Send + Sync>(
    error: DrawingAreaErrorKind<E>,
) -> anyhow::Error {
    anyhow!("the figure cannot be drawn: {error}")
}
