//! The legend of a figure: a swatch and a name for each series.

use super::chart::{NOTE, SMALL};
use super::curve::Point;
use super::drawing::{Drawing, Lettering, Upright};
use super::{series, text, theme};
use crate::{Figure, Kind, Series};

const ROW: f64 = 19.0;
const SWATCH: f64 = 20.0;

/// Draws the rows of the legend, starting `top` px below the upper edge; returns their height.
pub(super) fn draw(drawing: &mut Drawing, figure: &Figure, top: f64) -> f64 {
    let width = drawing.width();
    let (mut x, mut y) = (8.0, top + 0.5 * ROW);
    let lettering = Lettering {
        upright: Upright::Middle,
        ink: theme::WORDS,
        ..NOTE
    };
    let mut named = figure
        .series
        .iter()
        .filter(|series| !series.name.is_empty())
        .peekable();
    if named.peek().is_none() {
        return 0.0;
    }
    for series in named {
        let name = text::fit(&series.name, SMALL, width - SWATCH - 24.0);
        let needed = SWATCH + 6.0 + text::width(&name, SMALL) * 1.04;
        if x > 8.0 && x + needed > width - 4.0 {
            (x, y) = (8.0, y + ROW);
        }
        swatch(drawing, series, (x, y));
        drawing.text(&name, (x + SWATCH + 6.0, y), lettering);
        x += needed + 16.0;
    }
    y - top + 0.5 * ROW + 7.0
}

fn swatch(drawing: &mut Drawing, series: &Series, (x, y): Point) {
    let ink = theme::of(series.role);
    match series.kind {
        Kind::Points => drawing.discs(&[(x + 0.5 * SWATCH, y)], 3.5, ink),
        Kind::Line | Kind::Band => {
            if series.kind == Kind::Band {
                let shade = ink.with_opacity(series::SHADE);
                drawing.rectangle((x, y - 5.0), (x + SWATCH, y + 5.0), shade);
            }
            // A band without a line has no line here either.
            if series.kind == Kind::Line || series.y.iter().any(|y| y.is_finite()) {
                drawing.stroke(&[(x, y), (x + SWATCH, y)], series::stroke(series.role));
            }
        }
    }
}
