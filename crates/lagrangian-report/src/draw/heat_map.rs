//! A quantity over two axes: cells in two inks, one a sign, the stronger the larger.

use anyhow::Result;
use plotters::prelude::*;

use super::chart::{Plot, plain};
use super::theme;
use crate::{Figure, HeatMap, Role, Series};

/// Shades of each ink.
const LEVELS: i32 = 10;

/// The axes of a map.
pub(super) fn frame(map: &HeatMap) -> Figure {
    let ends = |axis: &crate::Axis| axis.range.map_or([0.0, 1.0], |(a, b)| [a, b]);
    let corners = Series::line(
        "",
        Role::Truth,
        ends(&map.x).to_vec(),
        ends(&map.y).to_vec(),
    );
    Figure {
        id: map.id.clone(),
        title: map.title.clone(),
        caption: map.caption.clone(),
        x: map.x.clone(),
        y: map.y.clone(),
        series: vec![corners],
    }
}

/// Draws all cells on a plot whose axes go from 0 to 1.
pub(super) fn cells<DB: DrawingBackend>(plot: &Plot<DB>, map: &HeatMap) -> Result<()> {
    let (rows, columns) = (map.rows() as f64, map.columns as f64);
    for row in 0..map.rows() {
        let (low, high) = (row as f64 / rows, (row + 1) as f64 / rows);
        for (first, end, level) in map.runs(row, LEVELS) {
            let corners = [(first as f64 / columns, low), (end as f64 / columns, high)];
            let ink = if level > 0 { "baseline" } else { "lnn" };
            let share = f64::from(level.abs()) / f64::from(LEVELS);
            let style = theme::colour(ink).mix(share).filled();
            plot.draw(&Rectangle::new(corners, style)).map_err(plain)?;
        }
    }
    Ok(())
}
