//! What else differs between runs: settings, data, and so whether their losses can be compared.

use std::collections::{BTreeMap, BTreeSet};

use lagrangian::train::Contestant;
use serde::Serialize;
use toml::{Table, Value};

use super::{About, Ground, Run};
use crate::page::file_name;
use crate::record::{DataFile, RunRecord};

/// The loss that weights are kept by.
const VALIDATION: &str = "loss/validation";

/// The role of a file of which it is only known that a fit used it.
const OF_A_FIT: &str = "data of the fit";

/// A setting that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// Its name; those within others with a dot between.
    pub name: String,
    /// Its value in each run; none where it is not set or not known.
    pub values: Vec<Option<String>>,
}

/// A file of data that not all runs share.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DataUse {
    /// What it was for.
    pub role: String,
    /// Its SHA-256.
    pub sha256: String,
    /// Where it was for each run; none for a run that does not have it.
    pub paths: Vec<Option<String>>,
}

/// A run in the list.
pub(super) fn about(run: &Run, ground: &Ground) -> About {
    let losses = run.metrics.iter().filter_map(|m| m.figures.get(VALIDATION));
    let last = run.metrics.last();
    About {
        name: run.name.clone(),
        path: run.path.clone(),
        family: run.model.family().into(),
        loss: of_fit(run, "loss").map(|loss| word(&loss)),
        least: losses.copied().reduce(f64::min),
        steps: last.map(|m| m.step),
        seconds: last.map(|m| m.seconds),
        seen: run.seen(&ground.hashes),
    }
}

/// A file that a fit has used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Seen {
    /// The name of the file.
    pub file: String,
    /// What it was for: `training`, `validation`, or `data of the fit` where only that is known.
    pub role: String,
}

impl Run {
    /// Those of the files with these hashes that the fit has used.
    #[must_use]
    pub fn seen(&self, hashes: &[String]) -> Vec<Seen> {
        let known = files(self).into_iter();
        let known = known.filter(|file| hashes.contains(&file.sha256));
        let seen = |file: Used| Seen {
            file: file_name(&file.path).into(),
            role: file.role,
        };
        known.map(seen).collect()
    }
}

/// A file as the record of a run, or a model, has it.
struct Used {
    role: String,
    sha256: String,
    path: String,
}

/// The files of a run. A model without its run does not know what they were for.
fn files(run: &Run) -> Vec<Used> {
    let Some(record) = &run.record else {
        let file = |(path, sha256): (&String, &String)| Used {
            role: OF_A_FIT.into(),
            sha256: sha256.clone(),
            path: path.clone(),
        };
        return run.provenance.data.iter().map(file).collect();
    };
    let file = |file: &DataFile| Used {
        role: file.role.clone(),
        sha256: file.sha256.clone(),
        path: file.path.clone(),
    };
    record.data.iter().map(file).collect()
}

/// The files that not all runs have for the same.
pub(super) fn of_data(runs: &[Run]) -> Vec<DataUse> {
    let mut each: Vec<Vec<Used>> = runs.iter().map(files).collect();
    if runs.iter().any(|run| run.record.is_none()) {
        // A model alone does not tell what a file was for.
        let all = each.iter_mut().flatten();
        all.for_each(|file| file.role = OF_A_FIT.into());
    }
    let keys = each.iter().flatten();
    let keys = keys.map(|file| (file.role.clone(), file.sha256.clone()));
    let keys: BTreeSet<(String, String)> = keys.collect();
    let of = |(role, sha256): (String, String)| {
        let path = |own: &Vec<Used>| {
            let mut own = own.iter();
            let own = own.find(|file| file.role == role && file.sha256 == sha256)?;
            Some(own.path.clone())
        };
        DataUse {
            paths: each.iter().map(path).collect(),
            role,
            sha256,
        }
    };
    let shared = |data: &DataUse| data.paths.iter().all(Option::is_some);
    keys.into_iter()
        .map(of)
        .filter(|data| !shared(data))
        .collect()
}

/// The settings of the fit that was kept: those of the family of the model, the only ones, or of several those with the least error. A
/// chain becomes a model of rigid bodies.
fn kept(run: &Run) -> Option<&Table> {
    let RunRecord {
        resolved, tried, ..
    } = run.record.as_ref()?;
    let fits = resolved.get("fit")?.as_table()?;
    let own = fits.get(run.model.family());
    let only = || fits.values().next().filter(|_| fits.len() == 1);
    let best = || {
        let known = tried.iter().filter(|one| one.torque_nmse.is_some());
        let best = known.min_by(|a, b| {
            let error = |one: &Contestant| one.torque_nmse.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        fits.get(&best?.family)
    };
    own.or_else(only).or_else(best)?.as_table()
}

/// A setting of the fit that was kept, by its name.
fn of_fit(run: &Run, name: &str) -> Option<Value> {
    kept(run)?.get(name).cloned()
}

/// The settings of a run, by their names: how its data were prepared, and those of the fit that was kept.
fn settings(run: &Run) -> Option<BTreeMap<String, String>> {
    let RunRecord {
        resolved, version, ..
    } = run.record.as_ref()?;
    let mut all = BTreeMap::from([
        ("model".into(), run.model.family().into()),
        ("version".into(), version.clone()),
    ]);
    for part in [resolved.get("data").and_then(Value::as_table), kept(run)] {
        part.into_iter()
            .for_each(|part| flatten("", part, &mut all));
    }
    Some(all)
}

/// Writes the values of a table, those of tables within it with a dot before their names.
fn flatten(path: &str, table: &Table, all: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let path = match path {
            "" => key.clone(),
            _ => format!("{path}.{key}"),
        };
        match value {
            Value::Table(within) => flatten(&path, within, all),
            other => {
                all.insert(path, word(other));
            }
        }
    }
}

fn word(value: &Value) -> String {
    match value {
        // The description of a robot.
        Value::String(text) if text.contains('\n') => format!("{} bytes", text.len()),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// The settings that differ between the runs whose settings are known.
pub(super) fn of_settings(runs: &[Run]) -> Vec<Setting> {
    let each: Vec<Option<BTreeMap<String, String>>> = runs.iter().map(settings).collect();
    let known = || each.iter().flatten();
    let names: BTreeSet<&String> = known().flat_map(BTreeMap::keys).collect();
    let differs = |name: &&String| {
        let mut values = known().map(|own| own.get(*name));
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    let setting = |name: &String| Setting {
        name: name.clone(),
        values: each
            .iter()
            .map(|own| own.as_ref()?.get(name).cloned())
            .collect(),
    };
    names.into_iter().filter(differs).map(setting).collect()
}

/// What losses depend on, beside the model: settings by their names, and what is said where they differ.
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

/// Why the losses of the fits cannot be compared.
pub(super) fn of_losses(runs: &[Run]) -> Vec<String> {
    let mut reasons = Vec::new();
    let unknown: Vec<&str> = (runs.iter().filter(|run| run.record.is_none()))
        .map(|run| run.name.as_str())
        .collect();
    if !unknown.is_empty() {
        let names = unknown.join(", ");
        reasons.push(format!(
            "the settings of {names} are not known: it is a model without its run"
        ));
    }
    let differing = of_settings(runs);
    for (name, reason) in OF_LOSSES {
        let within = format!("{name}.");
        let own = |s: &&Setting| s.name == name || s.name.starts_with(&within);
        if let Some(setting) = differing.iter().find(own) {
            let values = setting
                .values
                .iter()
                .map(|v| v.as_deref().unwrap_or("none"));
            let values = values.collect::<Vec<_>>().join(" / ");
            reasons.push(format!("{reason} ({values})"));
        }
    }
    if of_data(runs).iter().any(|data| data.role != "robot") {
        reasons.push("they are fitted to other data, or validated on others".into());
    } else if holds_back(runs) && differing.iter().any(|setting| setting.name == "seed") {
        reasons.push("another seed holds back other parts of the data for validation".into());
    }
    reasons
}

/// Whether a run has held back a part of its data.
fn holds_back(runs: &[Run]) -> bool {
    let of = |record: &RunRecord| record.data.iter().all(|file| file.role != "validation");
    runs.iter().filter_map(|run| run.record.as_ref()).any(of)
}
