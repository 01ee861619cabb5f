//! The results of a sweep as a table: one row a unit, whatever machine has done it and when.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::unit::{Unit, UnitResult};
use crate::error::Result;
use crate::files::{Existing, write_bytes};

/// The table in the folder of the units.
pub const RESULTS: &str = "results.csv";

/// A unit and what it has given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The name of its folder.
    pub unit: String,
    /// Its values of the settings that differ.
    pub settings: lagrangian::settings::Values,
    /// What it has given; none where it has not ended.
    pub result: Option<UnitResult>,
}

/// The units of a sweep, in their order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// The names of the settings that differ.
    pub varied: Vec<String>,
    /// A row for each unit.
    pub rows: Vec<Row>,
}

impl Table {
    /// What the units have given until now.
    ///
    /// # Errors
    /// As [`Unit::result`].
    pub fn of(units: &[Unit], varied: &[String], root: &Path) -> Result<Self> {
        let row = |unit: &Unit| {
            Ok(Row {
                unit: unit.id.clone(),
                settings: unit.varied.clone(),
                result: unit.result(root)?,
            })
        };
        Ok(Self {
            varied: varied.to_vec(),
            rows: units.iter().map(row).collect::<Result<_>>()?,
        })
    }

    /// The number of units that have ended.
    #[must_use]
    pub fn finished(&self) -> usize {
        self.rows.iter().filter(|row| row.result.is_some()).count()
    }

    /// The row with the least error; the first of those that are alike.
    #[must_use]
    pub fn best(&self) -> Option<&Row> {
        let error = |row: &Row| row.result.as_ref().and_then(|result| result.error);
        let known = self.rows.iter().filter_map(|row| Some((error(row)?, row)));
        let best = known.min_by(|(a, _), (b, _)| a.total_cmp(b));
        best.map(|(_, row)| row)
    }

    /// The table as CSV. It holds no times, so that it is the same however often the work was interrupted.
    #[must_use]
    pub fn csv(&self) -> String {
        let head = [
            "unit", "verdict", "error", "loss", "steps", "family", "failure",
        ];
        let names = self.varied.iter().map(String::as_str);
        let [unit, rest @ ..] = head;
        let mut text = line([unit].into_iter().chain(names).chain(rest));
        for row in &self.rows {
            let cells = self.cells(row);
            text += &line(cells.iter().map(String::as_str));
        }
        text
    }

    /// The cells of a row, in the order of the head.
    fn cells(&self, row: &Row) -> Vec<String> {
        let value = |name: &String| row.settings.get(name).map(shown).unwrap_or_default();
        let mut cells = vec![row.unit.clone()];
        cells.extend(self.varied.iter().map(value));
        let number = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:e}"));
        let Some(result) = &row.result else {
            cells.extend(std::iter::repeat_n(String::new(), 6));
            return cells;
        };
        let verdict = result.verdict.as_deref().unwrap_or_default();
        cells.extend([
            verdict.to_string(),
            number(result.error),
            number(result.loss),
            result.steps.to_string(),
            result.family.clone(),
            result.failure.clone().unwrap_or_default(),
        ]);
        cells
    }

    /// The table for a terminal: the `most` best rows, the best first, then those that failed.
    #[must_use]
    pub fn text(&self, most: usize) -> String {
        let error = |row: &&Row| {
            let result = row.result.as_ref();
            result.and_then(|r| r.error).unwrap_or(f64::INFINITY)
        };
        let mut rows: Vec<&Row> = self
            .rows
            .iter()
            .filter(|row| row.result.is_some())
            .collect();
        rows.sort_by(|a, b| error(a).total_cmp(&error(b)));
        let mut text = String::new();
        for row in rows.iter().take(most) {
            let settings = self.varied.iter().filter_map(|name| {
                let value = row.settings.get(name)?;
                Some(format!("{name} {}", shown(value)))
            });
            let settings = settings.collect::<Vec<_>>().join(", ");
            let words = row.result.as_ref().map(in_words).unwrap_or_default();
            // OK: writing to a string does not fail.
            let _ = writeln!(text, "{}  {words}  {settings}", row.unit);
        }
        if let Some(more) = rows.len().checked_sub(most).filter(|more| *more > 0) {
            let _ = writeln!(text, "… and {more} more in {RESULTS}");
        }
        text
    }

    /// Writes the table into the folder of the units.
    ///
    /// # Errors
    /// As [`write_bytes`].
    pub fn write(&self, root: &Path) -> Result<()> {
        write_bytes(
            &root.join(RESULTS),
            Existing::Replace,
            self.csv().as_bytes(),
        )
    }
}

fn in_words(result: &UnitResult) -> String {
    if let Some(failure) = &result.failure {
        return format!("failed: {failure}");
    }
    let verdict = result.verdict.as_deref().unwrap_or_default();
    let error = result
        .error
        .map_or("no error".into(), |x| format!("error {x:.3e}"));
    format!("{verdict:<4}  {error}")
}

/// A value as a cell shows it: words without quotes.
fn shown(value: &Value) -> String {
    value
        .as_str()
        .map_or_else(|| value.to_string(), String::from)
}

/// One line of CSV.
fn line<'a>(cells: impl Iterator<Item = &'a str>) -> String {
    let cell = |cell: &str| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_string(),
    };
    cells.map(cell).collect::<Vec<_>>().join(",") + "\n"
}
