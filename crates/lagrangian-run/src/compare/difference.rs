//! Settings and data that differ between runs, and so whether their losses can be compared.

use std::collections::BTreeMap;

use serde::Serialize;
use toml::{Table, Value};

use super::LoadedRun;
use crate::page::file_name;
use crate::record::DataFile;

/// The role of a file that a fit used for an unknown purpose.
const OF_A_FIT: &str = "data of the fit";

/// A setting that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// The name; nested names are separated by dots.
    pub name: String,
    /// The value in each run; `None` where it is not set or not known.
    pub values: Vec<Option<String>>,
}

/// A file of data that not all runs share.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DataUse {
    /// The purpose of the file.
    pub role: String,
    /// The SHA-256 of the file.
    pub sha256: String,
    /// The path for each run; `None` for a run without the file.
    pub paths: Vec<Option<String>>,
}

/// A file that a fit has used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DataOverlap {
    /// The name of the file.
    pub file: String,
    /// Its purpose: `training`, `validation`, or `data of the fit` where only that is known.
    pub role: String,
}

impl LoadedRun {
    /// The files with these hashes that the fit has used.
    #[must_use]
    pub fn overlap(&self, hashes: &[String]) -> Vec<DataOverlap> {
        let known = self.files().into_iter();
        let known = known.filter(|file| hashes.contains(&file.sha256));
        let overlap = |file: DataFile| DataOverlap {
            file: file_name(&file.path).into(),
            role: file.role,
        };
        known.map(overlap).collect()
    }

    /// The files of the fit. Without the run of a model neither their purpose nor their sizes are known.
    fn files(&self) -> Vec<DataFile> {
        let Some(record) = &self.record else {
            let file = |(path, sha256): (&String, &String)| DataFile {
                role: OF_A_FIT.into(),
                path: path.clone(),
                bytes: 0,
                sha256: sha256.clone(),
            };
            return self.provenance.data.iter().map(file).collect();
        };
        record.data.clone()
    }

    /// The settings of the fit that was kept: those of the family of the model, the only ones, or of several those with the smallest
    /// error. A chain becomes a model of rigid bodies.
    pub(super) fn kept_fit(&self) -> Option<&Table> {
        let record = self.record.as_ref()?;
        let fits = record.resolved.get("fit")?.as_table()?;
        let own = fits.get(self.model.family());
        let only = || fits.values().next().filter(|_| fits.len() == 1);
        let best = || {
            let tried = record.tried.iter();
            let known = tried.filter_map(|one| Some((one.shown().1?, one.shown().0)));
            fits.get(known.min_by(|a, b| a.0.total_cmp(&b.0))?.1)
        };
        own.or_else(only).or_else(best)?.as_table()
    }
}

/// The files that not all runs share.
pub(super) fn of_data(runs: &[LoadedRun]) -> Vec<DataUse> {
    // A model alone does not record the purpose of a file.
    let is_role_known = runs.iter().all(|run| run.record.is_some());
    let mut all: BTreeMap<(String, String), Vec<Option<String>>> = BTreeMap::new();
    for (k, run) in runs.iter().enumerate() {
        for file in run.files() {
            let role = if is_role_known {
                file.role.as_str()
            } else {
                OF_A_FIT
            };
            let paths = all.entry((role.into(), file.sha256));
            let paths = paths.or_insert_with(|| vec![None; runs.len()]);
            paths[k].get_or_insert(file.path);
        }
    }
    let differing = all.into_iter().filter(|(_, paths)| paths.contains(&None));
    let data = |((role, sha256), paths)| DataUse {
        role,
        sha256,
        paths,
    };
    differing.map(data).collect()
}

/// The settings that differ between runs with known settings: the preparation of their data, and the settings of the kept fit.
pub(super) fn of_settings(runs: &[LoadedRun]) -> Vec<Setting> {
    let mut all: BTreeMap<String, Vec<Option<String>>> = BTreeMap::new();
    let known = || {
        let each = runs.iter().enumerate();
        each.filter_map(|(k, run)| Some((k, run, run.record.as_ref()?)))
    };
    for (k, run, record) in known() {
        let mut set = |name: String, value: String| {
            all.entry(name).or_insert_with(|| vec![None; runs.len()])[k] = Some(value);
        };
        set("model".into(), run.model.family().into());
        set("version".into(), record.version.clone());
        let data = record.resolved.get("data").and_then(Value::as_table);
        for table in [data, run.kept_fit()].into_iter().flatten() {
            flatten("", table, &mut set);
        }
    }
    let differs = |values: &[Option<String>]| {
        let mut known = known().map(|(k, ..)| &values[k]);
        let first = known.next();
        known.any(|value| Some(value) != first)
    };
    let settings = all.into_iter().filter(|(_, values)| differs(values));
    settings
        .map(|(name, values)| Setting { name, values })
        .collect()
}

/// Passes the values of a table to `set`, with the names of nested tables and a dot before their names.
fn flatten(path: &str, table: &Table, set: &mut impl FnMut(String, String)) {
    for (key, value) in table {
        match value {
            Value::Table(within) => flatten(&format!("{path}{key}."), within, set),
            other => set(format!("{path}{key}"), word(other)),
        }
    }
}

/// The value of a setting in words.
pub(super) fn word(value: &Value) -> String {
    match value {
        // The description of a robot.
        Value::String(text) if text.contains('\n') => format!("{} bytes", text.len()),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Settings that losses depend on beside the model, and the reason that is stated where they differ.
const OF_LOSSES: [(&str, &str); 7] = [
    ("loss", "another loss is minimised"),
    (
        "nominal",
        "losses are in units of what a nominal model leaves, and that differs",
    ),
    (
        "low_pass",
        "another low-pass: the signals that are fitted differ",
    ),
    ("smooth", "one is fitted to smoothed signals"),
    ("delay", "the forces were shifted by other delays"),
    ("baseline", "neighbours at another distance are compared"),
    ("validate_fraction", "another part of the data is held back"),
];

/// Reasons why the losses of the fits cannot be compared.
pub(super) fn of_losses(runs: &[LoadedRun]) -> Vec<String> {
    let mut reasons = Vec::new();
    let unknown = runs.iter().filter(|run| run.record.is_none());
    let unknown: Vec<&str> = unknown.map(|run| run.name.as_str()).collect();
    if !unknown.is_empty() {
        let names = unknown.join(", ");
        reasons.push(format!(
            "the settings of {names} are not known: it is a model without its run"
        ));
    }
    let differing = of_settings(runs);
    for (name, reason) in OF_LOSSES {
        let is_own = |s: &&Setting| s.name.split('.').next() == Some(name);
        if let Some(setting) = differing.iter().find(is_own) {
            let values = setting.values.iter();
            let values: Vec<&str> = values.map(|v| v.as_deref().unwrap_or("none")).collect();
            reasons.push(format!("{reason} ({})", values.join(" / ")));
        }
    }
    // A run without a file for validation has held back a part of its data.
    let records = || runs.iter().filter_map(|run| run.record.as_ref());
    let mut files = records().map(|record| record.data.iter());
    let holds_back = files.any(|mut files| files.all(|file| file.role != "validation"));
    if of_data(runs).iter().any(|data| data.role != "robot") {
        reasons.push("they are fitted to other data, or validated on others".into());
    } else if holds_back && differing.iter().any(|setting| setting.name == "seed") {
        reasons.push("another seed holds back other parts of the data for validation".into());
    }
    reasons
}
