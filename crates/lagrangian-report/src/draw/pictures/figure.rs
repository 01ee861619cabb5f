//! One figure: title, axes, series, legend.

use plotters::chart::{ChartContext, SeriesLabelPosition};
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::{Area, Drawn, colour, letters};
use crate::draw::short::power;
use crate::draw::{plain, short, theme};
use crate::{Axis, Figure, Kind, Role, Scale, Series, decimate};

/// Largest number of dots: more would not be distinguishable, and make files large.
const MOST_DOTS: usize = 1500;
/// Number of dots up to which they are drawn larger.
const FEW: usize = 100;
/// Opacities of a band and of a cloud of dots.
const SHADE: f64 = 0.18;
const DOT: f64 = 0.6;
/// Number of columns of pixels of a curve.
const COLUMNS: usize = 1200;

type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Point = (f64, f64);

/// Draws a figure on an area of 1280 × 840 px, or larger by a scale.
pub(super) fn draw<B: DrawingBackend>(area: &Area<B>, figure: &Figure, scale: u32) -> Drawn<B> {
    let letters = |size: u32, ink| letters(f64::from(scale * size), ink);
    let wide = |ink, width: u32| colour(ink).stroke_width(scale * width);
    area.fill(&WHITE)?;
    let mut builder = ChartBuilder::on(area);
    builder
        .caption(plain(&figure.title), letters(30, theme::WORDS))
        .margin(20 * scale)
        .x_label_area_size(80 * scale)
        .y_label_area_size(130 * scale);
    let Some((x, y)) = ends(figure) else {
        area.draw_text(
            "no finite data",
            &letters(26, theme::MUTED),
            (540 * scale as i32, 420 * scale as i32),
        )?;
        return area.present();
    };
    let mut chart = builder.build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    chart
        .configure_mesh()
        .x_desc(plain(&figure.x.text()))
        .y_desc(plain(&figure.y.text()))
        .x_label_formatter(&|place| label(&figure.x, *place))
        .y_label_formatter(&|place| label(&figure.y, *place))
        .x_labels(9)
        .y_labels(8)
        .light_line_style(TRANSPARENT)
        .bold_line_style(wide(theme::GRID, 2))
        .axis_style(wide(theme::AXIS, 2))
        .label_style(letters(24, theme::MUTED))
        .axis_desc_style(letters(24, theme::MUTED))
        .draw()?;
    let mut all: Vec<&Series> = figure.series.iter().collect();
    all.sort_by_key(|one| theme::depth(one.role));
    for one in all {
        series(&mut chart, figure, one, scale)?;
    }
    if figure.series.iter().any(|one| !one.name.is_empty()) {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .legend_area_size(60 * scale)
            .margin(16 * scale)
            .label_font(letters(24, theme::WORDS))
            .draw()?;
    }
    area.present()
}

/// The places at which the axes end; `None` without a value to draw.
fn ends(figure: &Figure) -> Option<(Point, Point)> {
    let all = || figure.series.iter();
    let ordinates = all().flat_map(|one| [&one.y, &one.y_low, &one.y_high]);
    let x = figure.x.extent(all().flat_map(|one| &one.x))?;
    let y = figure.y.extent(ordinates.flatten())?;
    Some((around(&figure.x, x, 0.02), around(&figure.y, y, 0.06)))
}

/// The fixed ends of an axis, or ends around data with a margin, a fraction of their distance.
fn around(axis: &Axis, (low, high): Point, margin: f64) -> Point {
    if let Some((low, high)) = axis.fixed() {
        return (axis.inner(low), axis.inner(high));
    }
    let size = low.abs().max(high.abs());
    let span = if high - low > 1e-9 * size {
        margin * (high - low)
    } else if size > 0.0 && axis.scale == Scale::Linear {
        0.1 * size
    } else {
        1.0
    };
    (low - span, high + span)
}

/// The label of a tick.
fn label(axis: &Axis, place: f64) -> String {
    let whole = (place - place.round()).abs() < 1e-6;
    match axis.scale {
        _ if !axis.names.is_empty() => {
            let name = axis.names.get(place.round() as usize);
            name.filter(|_| whole && place > -0.5)
                .map_or(String::new(), |name| plain(name))
        }
        Scale::Log if whole && place.abs() > 3.0 => power(place.round() as i32),
        Scale::Log => trimmed(&short(10f64.powf(place))),
        Scale::Linear if place.abs() < 1e-300 => "0".into(),
        Scale::Linear => trimmed(&short(place)),
    }
}

/// A number without zeros at the end of its decimals.
fn trimmed(text: &str) -> String {
    match text.contains('.') && !text.contains('×') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text.into(),
    }
}

fn series<'a, B: DrawingBackend + 'a>(
    chart: &mut Chart<'a, B>,
    figure: &Figure,
    one: &Series,
    scale: u32,
) -> Drawn<B> {
    let (ink, name) = (colour(theme::of(one.role)), plain(&one.name));
    let placed = |x: &[f64], y: &[f64]| -> Vec<Point> {
        let place = |(x, y): (&f64, &f64)| (figure.x.inner(*x), figure.y.inner(*y));
        x.iter().zip(y).map(place).collect()
    };
    if one.kind == Kind::Points {
        dots(chart, placed(&one.x, &one.y), ink, scale)?;
    } else {
        let (low, high) = (placed(&one.x, &one.y_low), placed(&one.x, &one.y_high));
        band(chart, &low, &high, ink)?;
        let (x, y) = decimate(&one.x, &one.y, COLUMNS);
        line(chart, &placed(&x, &y), one.role, scale)?;
    }
    if !name.is_empty() {
        let (kind, role, s) = (one.kind, one.role, scale as i32);
        let swatch = move |(x, y): (i32, i32)| match kind {
            Kind::Points => Circle::new((x + 25 * s, y), 7 * s, ink.filled()).into_dyn(),
            Kind::Line => path(vec![(x, y), (x + 50 * s, y)], role, scale),
            Kind::Band => {
                let corners = [(x, y - 10 * s), (x + 50 * s, y + 10 * s)];
                Rectangle::new(corners, ink.mix(2.0 * SHADE).filled()).into_dyn()
            }
        };
        let nothing = std::iter::empty::<PathElement<Point>>();
        chart.draw_series(nothing)?.label(name).legend(swatch);
    }
    Ok(())
}

fn dots<B: DrawingBackend>(
    chart: &mut Chart<B>,
    mut dots: Vec<Point>,
    ink: RGBColor,
    scale: u32,
) -> Drawn<B> {
    dots.retain(|dot| is_inside(chart, dot));
    let radius = scale * if dots.len() > FEW { 4 } else { 7 };
    let every = dots.len().div_ceil(MOST_DOTS).max(1);
    let disc = |dot: &Point| Circle::new(*dot, radius, ink.mix(DOT).filled());
    chart.draw_series(dots.iter().step_by(every).map(disc))?;
    Ok(())
}

/// The areas between two edges, broken at gaps.
fn band<B: DrawingBackend>(
    chart: &mut Chart<B>,
    low: &[Point],
    high: &[Point],
    ink: RGBColor,
) -> Drawn<B> {
    let edges: Vec<(&Point, &Point)> = low.iter().zip(high).collect();
    let is_gap = |(low, high): &(&Point, &Point)| !(low.0 + low.1 + high.1).is_finite();
    for stretch in edges.split(is_gap).filter(|stretch| stretch.len() > 1) {
        let back = stretch.iter().rev().map(|edge| *edge.1);
        let outline: Vec<Point> = stretch.iter().map(|edge| *edge.0).chain(back).collect();
        chart.draw_series([Polygon::new(outline, ink.mix(SHADE))])?;
    }
    Ok(())
}

/// A line, broken at gaps and where it leaves the plot; a point without neighbours is a dot.
fn line<B: DrawingBackend>(
    chart: &mut Chart<B>,
    points: &[Point],
    role: Role,
    scale: u32,
) -> Drawn<B> {
    let inside: Vec<bool> = points.iter().map(|point| is_inside(chart, point)).collect();
    let finite = |k: usize| points[k].0.is_finite() && points[k].1.is_finite();
    let next_inside = |k: usize| inside.get(k + 1) == Some(&true) || (k > 0 && inside[k - 1]);
    let mut stretch = Vec::new();
    for k in 0..=points.len() {
        if k < points.len() && finite(k) && (inside[k] || next_inside(k)) {
            stretch.push(points[k]);
            continue;
        }
        match std::mem::take(&mut stretch).as_slice() {
            [] => {}
            [alone] => {
                let disc = Circle::new(*alone, 5 * scale, colour(theme::of(role)).filled());
                chart.draw_series([disc])?;
            }
            several => {
                chart.draw_series([path(several.to_vec(), role, scale)])?;
            }
        }
    }
    Ok(())
}

fn is_inside<B: DrawingBackend>(chart: &Chart<B>, (x, y): &Point) -> bool {
    let within =
        |range: std::ops::Range<f64>, place: &f64| range.start <= *place && *place <= range.end;
    within(chart.x_range(), x) && within(chart.y_range(), y)
}

/// A line in the style of a role.
fn path<B: DrawingBackend, P: Clone + 'static>(
    points: Vec<P>,
    role: Role,
    scale: u32,
) -> DynElement<'static, B, P> {
    let ink = colour(theme::of(role));
    let width = f64::from(2 * scale) * theme::width(role);
    let stroke = ink.stroke_width(width.round() as u32);
    match role {
        Role::Reference => DashedPathElement::new(points, 10 * scale, 8 * scale, stroke).into_dyn(),
        _ => PathElement::new(points, stroke).into_dyn(),
    }
}
