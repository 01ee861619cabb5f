//! The settings of a fit as they followed from flags, files and data: what the record of a run holds beside what was given.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lagrangian::saved::Preparation;
use lagrangian::train::Chosen;
use serde_json::{Map, Value, json};
use toml::Table;

use crate::bag_folder;
use crate::cli::DataArgs;
use crate::fit_args::FitArgs;

/// How the data of a fit were prepared.
pub(crate) struct Resolved(Map<String, Value>);

impl Resolved {
    /// Of data that were read with these flags, and prepared so.
    pub(crate) fn of(args: &FitArgs, preparation: &Preparation) -> Result<Self> {
        let files = [&args.files[..], &args.training.validate].concat();
        let (columns, others) = columns(&args.data, &bag_folder::files(&files)?)?;
        let held_back = args.training.validate.is_empty();
        let prepared = json!({
            "columns": columns,
            "columns_of": others,
            "smooth": preparation.smooth,
            "low_pass": preparation.low_pass,
            "delay": preparation.delay,
            "rows": args.sample.sampling(0, 0).map(|sampling| sampling.rows),
            "baseline": args.training.baseline,
            "validate_fraction": held_back.then_some(args.training.validate_fraction),
        });
        Ok(Self([("data".to_string(), prepared)].into_iter().collect()))
    }

    /// With the settings of each fit, as a table that comes back the same from a file.
    pub(crate) fn with(mut self, candidates: &[Chosen]) -> Result<Table> {
        let configs = candidates.iter().map(|c| serde_json::to_value(&c.config));
        let configs = configs.collect::<Result<Vec<Value>, _>>()?;
        let named = candidates
            .iter()
            .map(|c| c.config.family.name().to_string());
        let fits: Map<String, Value> = named.zip(configs).collect();
        self.0.insert("fit".into(), Value::Object(fits));
        let text = toml::to_string(&for_toml(Value::Object(self.0)));
        let text = text.context("cannot write the settings as TOML")?;
        Ok(toml::from_str(&text)?)
    }
}

/// The columns of the first file, and those of the others that differ from them.
fn columns(args: &DataArgs, files: &[PathBuf]) -> Result<(Table, Map<String, Value>)> {
    let of =
        |path: &Path| -> Result<Table> { Ok(toml::from_str(&args.layout_for(path)?.to_toml()?)?) };
    let Some((first, others)) = files.split_first() else {
        return Ok((Table::new(), Map::new()));
    };
    let first = of(first)?;
    let mut differing = Map::new();
    for path in others {
        let own = of(path)?;
        if own != first {
            differing.insert(path.display().to_string(), serde_json::to_value(own)?);
        }
    }
    Ok((first, differing))
}

/// Without what is not given, which TOML has no word for, and with the size of a robot's description in its place: the
/// file is among the data.
fn for_toml(value: Value) -> Value {
    let entry = |(key, value): (String, Value)| match value {
        Value::Null => None,
        Value::String(text) if key == "urdf" => {
            Some((key, Value::String(format!("{} bytes", text.len()))))
        }
        value => Some((key, for_toml(value))),
    };
    match value {
        Value::Object(entries) => Value::Object(entries.into_iter().filter_map(entry).collect()),
        Value::Array(items) => Value::Array(items.into_iter().map(for_toml).collect()),
        value => value,
    }
}
