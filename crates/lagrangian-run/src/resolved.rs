//! The resolved settings of a fit, from the given ones and from the data: the record of a run holds them beside the given ones.

use std::path::PathBuf;

use lagrangian::FitConfig;
use lagrangian::fit::ResolvedConfig;
use lagrangian::saved::Preparation;
use lagrangian::{Layout, PrepareOptions};
use serde_json::{Map, Value, json};
use toml::Table;

use crate::error::{Context, Result};

/// The reading of the data of a run.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    /// The columns of the first file, and those of the others that differ from them, by their paths.
    layouts: Option<(Table, Map<String, Value>)>,
    /// The largest number of rows that are used; `None` for all.
    pub rows: Option<usize>,
}

impl Columns {
    /// The layouts of some files, with the largest number of rows that are used.
    ///
    /// # Errors
    /// As [`Layout::to_table`].
    pub fn of(
        files: impl IntoIterator<Item = (PathBuf, Layout)>,
        rows: Option<usize>,
    ) -> Result<Self> {
        let mut layouts: Option<(Table, Map<String, Value>)> = None;
        for (path, layout) in files {
            let own = layout.to_table()?;
            match &mut layouts {
                None => layouts = Some((own, Map::new())),
                Some((first, others)) if own != *first => {
                    others.insert(path.display().to_string(), json!(own));
                }
                Some(_) => {}
            }
        }
        Ok(Self { layouts, rows })
    }
}

impl Columns {
    /// Recordings that were all read with the layout of this text.
    pub(crate) fn of_layout(text: &str) -> Result<Self> {
        let own: Table = toml::from_str(text).context("cannot write the columns", "")?;
        Ok(Self {
            layouts: Some((own, Map::new())),
            rows: None,
        })
    }
}

const FAILED: &str = "cannot write the settings as TOML";

/// The reading and the preparation of the data, and the settings of each fit, as a table that is equal after a round trip through a file.
///
/// # Errors
/// [`Error::Refused`](crate::Error::Refused) for values that TOML cannot represent.
pub(crate) fn resolved(
    columns: Columns,
    preparation: &Preparation,
    options: &PrepareOptions,
    held_back: bool,
    candidates: &[ResolvedConfig],
) -> Result<Table> {
    let (first, others) = columns.layouts.unwrap_or_default();
    let data = json!({
        "columns": first,
        "columns_of": others,
        "smooth": preparation.smooth,
        "low_pass": preparation.low_pass,
        "delay": preparation.delay,
        "rows": columns.rows,
        "baseline": options.baseline,
        "validate_fraction": held_back.then_some(options.validate_fraction),
    });
    let mut fits = Map::new();
    for candidate in candidates {
        let config = serde_json::to_value(&candidate.config).context(FAILED, "")?;
        fits.insert(candidate.name.clone(), in_short(config));
    }
    table(json!({ "data": data, "fit": fits }))
}

/// The settings of a fit, as in the table of [`resolved`].
///
/// # Errors
/// As [`resolved`].
pub(crate) fn of_fit(config: &FitConfig) -> Result<Table> {
    table(in_short(serde_json::to_value(config).context(FAILED, "")?))
}

fn table(value: Value) -> Result<Table> {
    Table::try_from(for_toml(value)).context(FAILED, "")
}

/// Replaces a robot's description by its size, since the file is among the data. That of a simulated robot stays, as it is the truth.
fn in_short(value: Value) -> Value {
    let entry = |(key, value): (String, Value)| match value {
        Value::String(text) if key == "urdf" => {
            (key, Value::String(format!("{} bytes", text.len())))
        }
        value => (key, in_short(value)),
    };
    match value {
        Value::Object(entries) => Value::Object(entries.into_iter().map(entry).collect()),
        Value::Array(items) => Value::Array(items.into_iter().map(in_short).collect()),
        value => value,
    }
}

/// Removes values that were not given, which TOML cannot represent.
pub(crate) fn for_toml(value: Value) -> Value {
    let entry = |(key, value): (String, Value)| match value {
        Value::Null => None,
        value => Some((key, for_toml(value))),
    };
    match value {
        Value::Object(entries) => Value::Object(entries.into_iter().filter_map(entry).collect()),
        Value::Array(items) => Value::Array(items.into_iter().map(for_toml).collect()),
        value => value,
    }
}
