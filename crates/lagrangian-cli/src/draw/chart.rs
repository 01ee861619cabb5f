//! One figure on any canvas: legend, axes, grid, series.

use anyhow::{Result, anyhow};
use lagrangian::report::{Figure, Kind, Role, Series, decimate};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::curve::{self, Point};
use super::scale::{Laid, Tick};
use super::{UNIT, text, theme};

type Plot<DB> = DrawingArea<DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

const SMALL: f64 = 12.0;
const HEADING: f64 = 15.0;
const ROW: f64 = 19.0;
const SWATCH: f64 = 20.0;
/// A cloud of more dots than this shows no more, and makes pages heavy.
const MOST_DOTS: usize = 1500;

/// Draws a figure of `width` × `height` px, with its title where a `heading` is wanted.
pub(super) fn draw<DB: DrawingBackend>(
    canvas: DB,
    figure: &Figure,
    (width, height): (u32, u32),
    heading: bool,
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
    top += legend(&root, figure, top, width)?;
    let axes = Axes::new(figure);
    match axes {
        Some(axes) => plot(
            &root,
            figure,
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

struct Axes {
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

    fn points(&self, x: &[f64], y: &[f64]) -> Vec<Point> {
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

/// The rows of the legend; returns their height.
fn legend<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    figure: &Figure,
    top: f64,
    width: f64,
) -> Result<f64> {
    let (mut x, mut y) = (8.0, top + 0.5 * ROW);
    let named: Vec<&Series> = figure
        .series
        .iter()
        .filter(|series| !series.name.is_empty())
        .collect();
    for series in &named {
        let name = text::fit(&series.name, SMALL, width - SWATCH - 24.0);
        let needed = SWATCH + 6.0 + text::width(&name, SMALL) * 1.04;
        if x > 8.0 && x + needed > width - 4.0 {
            (x, y) = (8.0, y + ROW);
        }
        swatch(root, series, (x, y))?;
        write(
            root,
            &name,
            (x + SWATCH + 6.0, y),
            (HPos::Left, VPos::Center),
            SMALL,
            "ink",
        )?;
        x += needed + 16.0;
    }
    Ok(if named.is_empty() {
        0.0
    } else {
        y - top + 0.5 * ROW + 7.0
    })
}

fn swatch<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    series: &Series,
    (x, y): Point,
) -> Result<()> {
    let style = stroke(series.role);
    if series.kind == Kind::Points {
        let middle = (units(x + 0.5 * SWATCH), units(y));
        return root
            .draw(&Circle::new(middle, units(3.5), style.filled()))
            .map_err(plain);
    }
    if series.kind == Kind::Band {
        let (upper, lower) = (
            (units(x), units(y - 5.0)),
            (units(x + SWATCH), units(y + 5.0)),
        );
        root.draw(&Rectangle::new(
            [upper, lower],
            style.color.mix(0.18).filled(),
        ))
        .map_err(plain)?;
    }
    root.draw(&PathElement::new(
        vec![(units(x), units(y)), (units(x + SWATCH), units(y))],
        style,
    ))
    .map_err(plain)
}

fn plot<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    figure: &Figure,
    axes: &Axes,
    place: Place,
) -> Result<()> {
    let bottom = 40.0;
    let tall = (place.height - place.top - bottom).max(20.0);
    let y_ticks = axes.y.ticks(((tall / 42.0) as usize).clamp(2, 8));
    let widest = y_ticks
        .iter()
        .map(|tick| text::width(&tick.label, SMALL))
        .fold(0.0, f64::max);
    let (left, right) = (widest + 16.0, 18.0);
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
    let mut series: Vec<&Series> = figure.series.iter().collect();
    series.sort_by_key(|series| depth(series.role));
    series
        .into_iter()
        .try_for_each(|series| draw_series(plot, axes, series, (wide, tall)))
}

/// As many ticks as have room beside each other.
fn roomy(axis: &Laid, wide: f64) -> Vec<Tick> {
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

fn draw_series<DB: DrawingBackend>(
    plot: &Plot<DB>,
    axes: &Axes,
    series: &Series,
    (wide, tall): Point,
) -> Result<()> {
    if series.kind == Kind::Points {
        return dots(plot, axes, series);
    }
    if series.kind == Kind::Band {
        band(plot, axes, series)?;
    }
    let (x, y) = decimate(&series.x, &series.y, 2 * wide as usize);
    let tolerance = (0.25 / wide, 0.25 / tall);
    for stretch in curve::stretches(&axes.points(&x, &y), tolerance) {
        plot.draw(&PathElement::new(stretch, stroke(series.role)))
            .map_err(plain)?;
    }
    Ok(())
}

fn dots<DB: DrawingBackend>(plot: &Plot<DB>, axes: &Axes, series: &Series) -> Result<()> {
    let inside = |at: &Point| (0.0..=1.0).contains(&at.0) && (0.0..=1.0).contains(&at.1);
    let all: Vec<Point> = axes
        .points(&series.x, &series.y)
        .into_iter()
        .filter(inside)
        .collect();
    let style = stroke(series.role).color.mix(0.6).filled();
    for at in all.iter().step_by(all.len().div_ceil(MOST_DOTS).max(1)) {
        plot.draw(&Circle::new(*at, units(1.9), style))
            .map_err(plain)?;
    }
    Ok(())
}

fn band<DB: DrawingBackend>(plot: &Plot<DB>, axes: &Axes, series: &Series) -> Result<()> {
    let edge = |y: &[f64]| {
        axes.points(&series.x, y)
            .into_iter()
            .map(|(x, y)| (x, y.clamp(0.0, 1.0)))
            .collect::<Vec<_>>()
    };
    let (low, high) = (edge(&series.y_low), edge(&series.y_high));
    let pairs: Vec<(Point, Point)> = low.into_iter().zip(high).collect();
    let missing = |pair: &(Point, Point)| {
        ![pair.0.0, pair.0.1, pair.1.1]
            .iter()
            .all(|value| value.is_finite())
    };
    for stretch in pairs.split(missing).filter(|stretch| stretch.len() > 1) {
        let there = stretch.iter().map(|pair| pair.0);
        let back = stretch.iter().rev().map(|pair| pair.1);
        let style = stroke(series.role).color.mix(0.18).filled();
        plot.draw(&Polygon::new(there.chain(back).collect::<Vec<_>>(), style))
            .map_err(plain)?;
    }
    Ok(())
}

/// Truth is a broad soft line, so that a model that follows it is seen on top of it.
fn stroke(role: Role) -> ShapeStyle {
    let width = match role {
        Role::Truth => 3.2,
        Role::Lnn => 1.7,
        Role::Baseline | Role::Other(_) => 1.5,
    };
    theme::colour(theme::name_of(role)).stroke_width(units(width) as u32)
}

/// What is drawn first is covered by what follows.
fn depth(role: Role) -> u8 {
    match role {
        Role::Truth => 0,
        Role::Baseline => 1,
        Role::Other(_) => 2,
        Role::Lnn => 3,
    }
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
