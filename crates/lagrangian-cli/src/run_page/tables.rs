//! The tables of a run's page.

use lagrangian::score::SignalError;
use lagrangian::train::Choice;
use lagrangian::{Item, Model, Outcome, Score, Verdict};
use lagrangian_report::Table;
use lagrangian_report::draw::short;

use super::Run;
use crate::run_folder::RunRecord;

/// Motions and warnings that are listed one by one, at most.
const MOST_MOTIONS: usize = 20;

/// Errors at single samples, and how long whole motions are followed.
pub(super) fn of(run: &Run, score: &Score) -> Vec<Table> {
    let tables = [
        errors(run, score),
        motions(run, score),
        parameters(run),
        warnings(run),
    ];
    tables
        .into_iter()
        .filter(|table| !table.rows.is_empty())
        .collect()
}

fn errors(run: &Run, score: &Score) -> Table {
    let mut table = Table {
        caption: "Errors at single samples: root mean square, and as a share of the signal's variance (100 % is as \
                  good as its mean)."
            .into(),
        header: ["signal", "coordinate", "RMS error", "of its variance"]
            .map(str::to_string)
            .to_vec(),
        rows: Vec::new(),
    };
    let signals = [
        ("acceleration", "/s²", &score.acceleration),
        ("torque", "", &score.torque),
    ];
    for (name, unit, error) in signals {
        let Some(error) = error else { continue };
        table.rows.extend(rows(run, name, unit, error));
    }
    table
}

fn rows(run: &Run, name: &str, per: &str, error: &SignalError) -> Vec<Vec<String>> {
    let coordinates = run.model.coordinates().0.iter();
    let row = |(coordinate, (mse, nmse)): (&lagrangian::Coordinate, (&f64, &f64))| {
        let unit = match (per, coordinate.unit.as_str()) {
            ("", "rad") => "N·m".to_string(),
            ("", _) => "N".to_string(),
            (per, unit) => format!("{unit}{per}"),
        };
        vec![
            name.to_string(),
            coordinate.name.clone(),
            format!("{} {unit}", short(mse.sqrt())),
            format!("{} %", short(100.0 * nmse)),
        ]
    };
    coordinates
        .zip(error.mse.iter().zip(&error.nmse))
        .map(row)
        .collect()
}

/// What was learned that has a name and a unit.
fn parameters(run: &Run) -> Table {
    let row = |p: lagrangian::models::Parameter| {
        let error = p.standard_error.map(|e| format!(" ± {}", short(e)));
        let value = format!("{}{}", short(p.value), error.unwrap_or_default());
        vec![p.name, value, p.unit]
    };
    Table {
        caption: "What was learned beside the Lagrangian, or of it.".into(),
        header: ["parameter", "value", "unit"].map(str::to_string).to_vec(),
        rows: run.model.parameters().into_iter().map(row).collect(),
    }
}

/// What the check of the data warns of.
fn warnings(run: &Run) -> Table {
    let items = run.judged.check.items.iter();
    let warned = items.filter(|item| item.verdict == Verdict::Warn);
    let row = |item: &Item| {
        vec![
            item.trajectory.clone().unwrap_or_else(|| "all".into()),
            item.name.to_string(),
            item.finding.clone(),
            item.remedy.clone().unwrap_or_default(),
        ]
    };
    Table {
        caption: "What the check of the data warns of; `lagrangian check` has all findings.".into(),
        header: ["trajectory", "check", "finding", "remedy"]
            .map(str::to_string)
            .to_vec(),
        rows: warned.take(MOST_MOTIONS).map(row).collect(),
    }
}

fn motions(run: &Run, score: &Score) -> Table {
    let shown = score.rollouts.len().min(MOST_MOTIONS);
    let rest = match score.rollouts.len() - shown {
        0 => String::new(),
        more => format!(" The first {shown}; {more} more are in `lagrangian score --json`."),
    };
    let row =
        |(trajectory, rollout): (&lagrangian::Trajectory, &lagrangian::score::RolloutScore)| {
            let bound = if rollout.exceeded { "" } else { "≥ " };
            vec![
                trajectory.name.clone(),
                format!("{:.2} s", rollout.duration),
                format!("{bound}{:.2} s", rollout.valid_seconds),
                ending(&rollout.outcome),
            ]
        };
    Table {
        caption: format!("Whole motions, each predicted from its first state alone.{rest}"),
        header: ["motion", "duration", "followed for", "prediction ended"]
            .map(str::to_string)
            .to_vec(),
        rows: run
            .judged
            .motions
            .iter()
            .zip(&score.rollouts)
            .take(shown)
            .map(row)
            .collect(),
    }
}

fn ending(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Finished => "with the motion".into(),
        Outcome::Diverged { t, .. } => format!("diverged at {t:.2} s"),
        Outcome::StepLimit { t } => format!("step limit at {t:.2} s"),
    }
}

/// What was set, without what is empty; files by the beginnings of their hashes.
pub(super) fn settings(record: &RunRecord) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    for (group, value) in &record.settings {
        match value {
            toml::Value::Table(table) => rows.extend(table.iter().filter_map(setting)),
            _ => rows.extend(setting((group, value))),
        }
    }
    rows.extend(record.choices.iter().map(choice));
    rows.push(("threads".into(), record.threads.to_string()));
    rows.push(("platform".into(), record.platform.clone()));
    rows.extend(record.data.iter().map(|file| {
        let hash = file.sha256.get(..12).unwrap_or(&file.sha256);
        (
            format!("{} data", file.role),
            format!("{} (SHA-256 {hash}…)", super::file_name(&file.path)),
        )
    }));
    rows
}

/// A setting that was chosen from the data, with its reason.
fn choice(choice: &Choice) -> (String, String) {
    let value = match &choice.value {
        serde_json::Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let name = choice.setting.replace('_', " ");
    (name, format!("{value} (chosen: {})", choice.reason))
}

fn setting((name, value): (&String, &toml::Value)) -> Option<(String, String)> {
    // The data files are listed with their hashes, and how the folder was opened is no setting of the fit.
    if matches!(name.as_str(), "files" | "validate" | "force" | "resume") {
        return None;
    }
    let words = match value {
        toml::Value::String(text) => text.clone(),
        toml::Value::Boolean(yes) => String::from(if *yes { "yes" } else { "no" }),
        toml::Value::Array(items) => items
            .iter()
            .map(|item| item.as_str().map_or_else(|| item.to_string(), String::from))
            .collect::<Vec<_>>()
            .join(", "),
        other => other.to_string(),
    };
    (!words.is_empty()).then(|| (name.replace('_', " "), words))
}
