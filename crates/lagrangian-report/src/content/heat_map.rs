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

    /// The cells of one row as runs of equal colour: (first column, end, level), the level from −`levels` to `levels`,
    /// without 0 and gaps.
    #[must_use]
    pub fn runs(&self, row: usize, levels: i32) -> Vec<(usize, usize, i32)> {
        let level = |x: &f64| {
            let ratio = (x / self.limit).clamp(-1.0, 1.0);
            if ratio.is_finite() {
                (ratio * f64::from(levels)).round() as i32
            } else {
                0
            }
        };
        let mut runs: Vec<(usize, usize, i32)> = Vec::new();
        let from = row * self.columns;
        let cells = self.values.iter().skip(from).take(self.columns);
        for (column, value) in cells.map(level).enumerate() {
            match runs.last_mut() {
                Some(run) if run.1 == column && run.2 == value => run.1 = column + 1,
                _ if value == 0 => {}
                _ => runs.push((column, column + 1, value)),
            }
        }
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_cells_make_one_run_and_gaps_none() {
        let map = HeatMap {
            columns: 6,
            values: vec![0.0, 1.0, 1.0, f64::NAN, -0.5, 9.0],
            limit: 1.0,
            ..HeatMap::default()
        };
        assert_eq!(map.rows(), 1);
        assert_eq!(map.runs(0, 4), [(1, 3, 4), (4, 5, -2), (5, 6, 4)]);
    }
}
