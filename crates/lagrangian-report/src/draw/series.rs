//! The series of a figure: lines, dots and bands.

use anyhow::Result;
use plotters::prelude::*;

use super::chart::{Axes, Plot, plain, units};
use super::curve::{self, Point};
use super::theme;
use crate::{Kind, Role, Series, decimate};

/// A cloud of more dots than this shows no more, and makes pages heavy.
const MOST_DOTS: usize = 1500;

/// Draws one series on a plot of so many px.
pub(super) fn draw<DB: DrawingBackend>(
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
pub(super) fn stroke(role: Role) -> ShapeStyle {
    let width = match role {
        Role::Truth => 3.2,
        Role::Lnn => 1.7,
        Role::Baseline | Role::Other(_) => 1.5,
    };
    theme::colour(theme::name_of(role)).stroke_width(units(width) as u32)
}

/// What is drawn first is covered by what follows.
pub(super) fn depth(role: Role) -> u8 {
    match role {
        Role::Truth => 0,
        Role::Baseline => 1,
        Role::Other(_) => 2,
        Role::Lnn => 3,
    }
}
