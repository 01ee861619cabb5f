//! The legend of a figure: a swatch and a name for each series.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::chart::{SMALL, plain, units, write};
use super::curve::Point;
use super::series::stroke;
use super::text;
use crate::{Figure, Kind, Series};

const ROW: f64 = 19.0;
const SWATCH: f64 = 20.0;

/// The rows of the legend; returns their height.
pub(super) fn draw<DB: DrawingBackend>(
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
