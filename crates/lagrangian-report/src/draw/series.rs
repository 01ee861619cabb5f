//! The series of a figure: lines, dots and bands.

use super::axes::Plot;
use super::curve::{self, Point};
use super::drawing::{Drawing, Stroke};
use super::theme;
use crate::{Kind, Role, Series, decimate};

/// Largest number of dots: more would not be distinguishable, and make pages large.
const MOST_DOTS: usize = 1500;
/// Number of dots up to which they are drawn larger.
const FEW: usize = 100;
/// Opacity of a band.
pub(super) const SHADE: f64 = 0.18;

/// Draws one series on a plot.
pub(super) fn draw(drawing: &mut Drawing, plot: &Plot, series: &Series) {
    match series.kind {
        Kind::Points => dots(drawing, plot, series),
        Kind::Line => line(drawing, plot, series),
        Kind::Band => {
            band(drawing, plot, series);
            line(drawing, plot, series);
        }
    }
}

fn line(drawing: &mut Drawing, plot: &Plot, series: &Series) {
    let (x, y) = decimate(&series.x, &series.y, 2 * plot.wide as usize);
    let tolerance = (0.25 / plot.wide, 0.25 / plot.tall);
    let points = plot.points(&x, &y);
    for stretch in curve::stretches(&points, tolerance) {
        drawing.stroke(&plot.all_px(&stretch), stroke(series.role));
    }
    let alone: Vec<Point> = alone(&points).iter().map(|at| plot.px(*at)).collect();
    drawing.discs(&alone, 2.6, theme::of(series.role));
}

/// The points of a line without neighbours, within the unit square.
fn alone(points: &[Point]) -> Vec<Point> {
    let is_there = |k: usize| {
        let point = points.get(k);
        point.is_some_and(|at| at.0.is_finite() && at.1.is_finite())
    };
    let is_alone = |k: &usize| is_there(*k) && !is_there(k + 1) && (*k == 0 || !is_there(k - 1));
    let inside = |at: &Point| (0.0..=1.0).contains(&at.0) && (0.0..=1.0).contains(&at.1);
    let all = (0..points.len()).filter(is_alone).map(|k| points[k]);
    all.filter(inside).collect()
}

/// The style of a line of this role.
pub(super) fn stroke(role: Role) -> Stroke {
    Stroke {
        width: width(role),
        ink: theme::of(role),
        dashed: role == Role::Reference,
    }
}

fn dots(drawing: &mut Drawing, plot: &Plot, series: &Series) {
    let inside = |at: &Point| (0.0..=1.0).contains(&at.0) && (0.0..=1.0).contains(&at.1);
    let mut dots = plot.points(&series.x, &series.y);
    dots.retain(inside);
    let every = dots.len().div_ceil(MOST_DOTS).max(1);
    let drawn: Vec<Point> = dots.iter().step_by(every).map(|at| plot.px(*at)).collect();
    let radius = if drawn.len() > FEW { 1.9 } else { 3.5 };
    drawing.discs(&drawn, radius, theme::of(series.role).with_opacity(0.6));
}

fn band(drawing: &mut Drawing, plot: &Plot, series: &Series) {
    let low = plot.points(&series.x, &series.y_low);
    let high = plot.points(&series.x, &series.y_high);
    let pairs: Vec<(Point, Point)> = low.into_iter().zip(high).collect();
    let is_missing =
        |(low, high): &(Point, Point)| ![low.0, low.1, high.1].iter().all(|x| x.is_finite());
    let inside = |at: &Point| plot.px((at.0, at.1.clamp(0.0, 1.0)));
    for stretch in pairs.split(is_missing).filter(|stretch| stretch.len() > 1) {
        let there = stretch.iter().map(|(low, _)| inside(low));
        let back = stretch.iter().rev().map(|(_, high)| inside(high));
        let outline: Vec<Point> = there.chain(back).collect();
        drawing.polygon(&outline, theme::of(series.role).with_opacity(SHADE));
    }
}

/// Width of a line, px: truth is broad and pale, so that a model that follows it is visible on top of it.
pub(super) fn width(role: Role) -> f64 {
    match role {
        Role::Truth => 3.2,
        Role::Lnn => 1.7,
        Role::Reference => 1.3,
        Role::Baseline | Role::Other(_) => 1.5,
    }
}

/// The order of drawing: later series cover earlier ones.
pub(super) fn depth(role: Role) -> u8 {
    match role {
        Role::Truth => 0,
        Role::Baseline => 1,
        Role::Other(_) => 2,
        Role::Lnn => 3,
        Role::Reference => 4,
    }
}
