//! The two axes of a figure: position of the plot, ticks, grid and labels.

use super::chart::{NOTE, SMALL};
use super::curve::Point;
use super::drawing::{Across, Drawing, Lettering, Upright};
use super::scale::{Laid, Tick};
use super::{text, theme};
use crate::{Figure, Kind, Series};

/// Space below a plot for its numbers and the name of its axis, px.
const BELOW: f64 = 40.0;
const RIGHT: f64 = 18.0;
/// Approximate number of ticks of an ordinate, which ends at ticks, so that its highest value lies below a number.
const TICKS: usize = 6;

/// Both axes of a figure, laid out.
pub(super) struct Axes {
    x: Laid,
    y: Laid,
}

impl Axes {
    /// The axes that hold all finite values of a figure, or `None` without any.
    pub(super) fn new(figure: &Figure) -> Option<Self> {
        let Self { x, y } = Self::tight(figure)?;
        Some(Self {
            x,
            y: y.ended_at_ticks(TICKS),
        })
    }

    /// The axes that end where the data or their ranges end.
    pub(super) fn tight(figure: &Figure) -> Option<Self> {
        let series = || figure.series.iter();
        let roams = |one: &Series| one.x.windows(2).any(|pair| pair[1] < pair[0]);
        let roams = series().any(|one| one.kind == Kind::Points || roams(one));
        let xs = series().flat_map(|series| series.x.iter().copied());
        let ys = series().flat_map(|series| [&series.y, &series.y_low, &series.y_high]);
        Some(Self {
            x: Laid::new(&figure.x, xs, if roams { 0.04 } else { 0.0 })?,
            y: Laid::new(&figure.y, ys.flatten().copied(), 0.0)?,
        })
    }

    /// Ends of x and y; logarithms on a logarithmic axis.
    pub(super) fn ends(&self) -> [[f64; 2]; 2] {
        [self.x.ends(), self.y.ends()]
    }
}

/// The rectangle in which series are drawn, px, and its axes.
pub(super) struct Plot {
    axes: Axes,
    left: f64,
    top: f64,
    pub(super) wide: f64,
    pub(super) tall: f64,
}

impl Plot {
    /// Values in the unit square, y upwards; NaN for a value that cannot be placed.
    pub(super) fn points(&self, x: &[f64], y: &[f64]) -> Vec<Point> {
        let pairs = x.iter().zip(y);
        pairs
            .map(|(&x, &y)| (self.axes.x.at(x), self.axes.y.at(y)))
            .collect()
    }

    /// Converts a point of the unit square to px.
    pub(super) fn px(&self, (x, y): Point) -> Point {
        (self.left + x * self.wide, self.top + (1.0 - y) * self.tall)
    }

    /// [`Plot::px`] for many points.
    pub(super) fn all_px(&self, points: &[Point]) -> Vec<Point> {
        points.iter().map(|point| self.px(*point)).collect()
    }

    fn bottom(&self) -> f64 {
        self.top + self.tall
    }
}

/// Draws axes, grid, numbers and names; the plot starts at `top` px.
pub(super) fn draw(drawing: &mut Drawing, figure: &Figure, axes: Axes, top: f64) -> Plot {
    let tall = (drawing.height() - top - BELOW).max(20.0);
    let y_ticks = y_ticks(&axes.y, tall);
    let left = 1.06 * widest(&y_ticks) + 16.0;
    let wide = (drawing.width() - left - RIGHT).max(20.0);
    let x_ticks = x_ticks(&axes.x, wide);
    let plot = Plot {
        axes,
        left,
        top,
        wide,
        tall,
    };
    grid(drawing, &plot, &x_ticks, &y_ticks);
    numbers(drawing, &plot, &x_ticks, &y_ticks);
    names(drawing, &plot, figure);
    plot
}

fn grid(drawing: &mut Drawing, plot: &Plot, x_ticks: &[Tick], y_ticks: &[Tick]) {
    let mut line = |from: Point, to: Point, ink| drawing.line(&plot.all_px(&[from, to]), 1.0, ink);
    for tick in y_ticks {
        line((0.0, tick.at), (1.0, tick.at), theme::GRID);
    }
    for tick in x_ticks {
        line((tick.at, 0.0), (tick.at, 1.0), theme::GRID);
    }
    line((0.0, 0.0), (1.0, 0.0), theme::AXIS);
}

fn numbers(drawing: &mut Drawing, plot: &Plot, x_ticks: &[Tick], y_ticks: &[Tick]) {
    for tick in y_ticks {
        let at = (plot.left - 8.0, plot.px((0.0, tick.at)).1);
        let lettering = Lettering {
            across: Across::Right,
            upright: Upright::Middle,
            ..NOTE
        };
        drawing.text(&tick.label, at, lettering);
    }
    for tick in x_ticks {
        let at = (plot.px((tick.at, 0.0)).0, plot.bottom() + 7.0);
        drawing.text(
            &tick.label,
            at,
            Lettering {
                across: Across::Middle,
                ..NOTE
            },
        );
    }
}

/// The quantities of the axes: y above its numbers, x below the right end.
fn names(drawing: &mut Drawing, plot: &Plot, figure: &Figure) {
    let limit = drawing.width() - 16.0;
    let lettering = Lettering {
        upright: Upright::Bottom,
        ..NOTE
    };
    let y = text::fit(&figure.y.text(), SMALL, limit);
    drawing.text(&y, (8.0, plot.top - 10.0), lettering);
    let x = text::fit(&figure.x.text(), SMALL, limit);
    let corner = (plot.left + plot.wide, drawing.height() - 2.0);
    drawing.text(
        &x,
        corner,
        Lettering {
            across: Across::Right,
            ..lettering
        },
    );
}

/// As many ticks as fit side by side.
fn x_ticks(axis: &Laid, wide: f64) -> Vec<Tick> {
    if axis.has_names() {
        return axis.ticks(0);
    }
    let fits = |ticks: &[Tick]| {
        let needed = widest(ticks) + 18.0;
        ticks
            .windows(2)
            .all(|pair| (pair[1].at - pair[0].at) * wide > needed)
    };
    let most = ((wide / 56.0) as usize).clamp(2, 12);
    let counts = (1..=most).rev();
    counts
        .map(|count| axis.ticks(count))
        .find(|ticks| fits(ticks))
        .unwrap_or_default()
}

/// A tick about every 42 px, and at least three; the highest one at the upper end if possible.
fn y_ticks(axis: &Laid, tall: f64) -> Vec<Tick> {
    let enough = ((tall / 42.0) as usize).clamp(2, 8);
    let ends = |ticks: &[Tick]| ticks.last().is_some_and(|tick| tick.at > 1.0 - 1e-6);
    let counts = (2..=enough).rev().chain(enough + 1..12);
    let mut candidates = counts.map(|count| axis.ticks(count));
    candidates
        .find(|ticks| ticks.len() > 2 && ends(ticks))
        .or_else(|| {
            let mut candidates = (enough..12).map(|count| axis.ticks(count));
            candidates.find(|ticks| ticks.len() > 2)
        })
        .unwrap_or_else(|| axis.ticks(enough))
}

fn widest(ticks: &[Tick]) -> f64 {
    let widths = ticks.iter().map(|tick| text::width(&tick.label, SMALL));
    widths.fold(0.0, f64::max)
}
