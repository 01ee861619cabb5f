//! A quantity over two axes: cells in two inks, one for each sign, with an opacity that grows with the magnitude.

use super::axes::{Axes, Plot};
use super::drawing::{Drawing, Letters};
use super::{chart, theme};
use crate::{Axis, Figure, HeatMap, Role, Series};

/// Number of shades of each ink.
const LEVELS: i32 = 10;

/// A map of `width` × `height` px for a page that displays the title itself.
pub(super) fn drawing(map: &HeatMap, size: (u32, u32)) -> Drawing {
    let mut drawing = Drawing::new(size, Letters::Text);
    let frame = frame(map);
    let axes = Axes::tight(&frame);
    if let Some(plot) = chart::plot_within(&mut drawing, &frame, axes, 4.0) {
        drawing.with_sharp_edges(|drawing| cells(drawing, &plot, map));
    }
    drawing
}

/// The axes of a map.
fn frame(map: &HeatMap) -> Figure {
    let ends = |axis: &Axis| {
        axis.range
            .map_or(vec![0.0, 1.0], |(low, high)| vec![low, high])
    };
    Figure {
        x: map.x.clone(),
        y: map.y.clone(),
        series: vec![Series::line("", Role::Truth, ends(&map.x), ends(&map.y))],
        ..Figure::default()
    }
}

fn cells(drawing: &mut Drawing, plot: &Plot, map: &HeatMap) {
    let (rows, columns) = (map.rows() as f64, map.columns as f64);
    for row in 0..map.rows() {
        let (low, high) = (row as f64 / rows, (row + 1) as f64 / rows);
        for (first, end, level) in map.runs(row, LEVELS) {
            let from = plot.px((first as f64 / columns, low));
            let to = plot.px((end as f64 / columns, high));
            let ink = if level > 0 {
                theme::BASELINE
            } else {
                theme::LNN
            };
            let opacity = f64::from(level.abs()) / f64::from(LEVELS);
            drawing.rectangle(from, to, ink.with_opacity(opacity));
        }
    }
}
