//! A quantity over two axes as plain data, e.g. a field over space and time.

use serde::{Deserialize, Serialize};

use super::Axis;

/// Values on a regular grid, each a coloured cell; two maps with equal limits can be compared by eye.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct HeatMap {
    /// A name for links and files: lower case, words joined by `-`.
    pub id: String,
    /// Title, in a few words.
    pub title: String,
    /// Description, in one or two sentences.
    pub caption: String,
    /// The horizontal axis; its range is that of the grid.
    pub x: Axis,
    /// The vertical axis; its range is that of the grid.
    pub y: Axis,
    /// Number of cells in a row.
    pub columns: usize,
    /// Rows from the bottom up, `[rows, columns]`; NaN is a gap.
    #[serde(with = "super::gaps")]
    pub values: Vec<f64>,
    /// The magnitude that has the full colour.
    pub limit: f64,
}

impl HeatMap {
    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.values.len().checked_div(self.columns).unwrap_or(0)
    }
}
