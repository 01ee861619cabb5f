//! The tables of a run's page.

use lagrangian::check::Item;
use lagrangian::mechanics::Outcome;
use lagrangian::score::{Assessment, Forward, RolloutScore, SignalError};
use lagrangian::trajectory::Coordinate;
use lagrangian::{Model, Score, Trajectory, Verdict};
use lagrangian::{models::Parameter, score::CandidateResult, train::AutoSetting};
use lagrangian_report::draw::short;
use lagrangian_report::{Axis, Table};

use super::Page;
use crate::hashing_reader::brief_hash;
use crate::record::RunRecord;
use lagrangian_report::force_unit;

/// The largest number of motions and warnings that are listed one by one.
const MOST_MOTIONS: usize = 20;

/// Errors at single samples, times for which whole motions are followed, parameters, and warnings about the data.
pub(super) fn of(page: &Page, score: &Score, assessment: &Assessment) -> Vec<Table> {
    vec![
        tried(page),
        errors(page, score, assessment),
        forwards(assessment),
        motions(page, score),
        parameters(page),
        warnings(page),
    ]
}

/// The models that were compared.
fn tried(page: &Page) -> Table {
    let row = |c: &CandidateResult| {
        let error = match (c.torque_nmse, &c.failure) {
            (Some(error), _) => format!("{} %", short(100.0 * error)),
            (None, Some(failure)) => failure.clone(),
            (None, None) => String::new(),
        };
        vec![c.family.clone(), error, format!("{:.1} s", c.seconds)]
    };
    Table::new(
        "Models that were tried: the squared error of their torques over the variance, mean over the joints, on samples that were held back.",
        &["model", "torque error", "time"],
        page.record.tried.iter().map(row).collect(),
    )
}

/// The quality of the forward dynamics, joint by joint.
fn forwards(assessment: &Assessment) -> Table {
    let percent = |x: f64| format!("{} %", short(100.0 * x));
    let row = |j: &Forward| {
        vec![
            j.name.clone(),
            percent(j.inertial_share),
            percent(j.unexplained),
            percent(j.acceleration_nmse),
            String::from(if j.predictable { "yes" } else { "no" }),
        ]
    };
    Table::new(
        "From torques to accelerations: where the inertial torque is less than what is not explained, the acceleration cannot be predicted.",
        &[
            "joint",
            "inertia, of the torque's variance",
            "unexplained",
            "error of the acceleration",
            "predictable",
        ],
        assessment.joints.iter().map(row).collect(),
    )
}

fn errors(page: &Page, score: &Score, assessment: &Assessment) -> Table {
    let of = |name, unit: fn(&str) -> String, error: &Option<SignalError>| {
        let rows = error.iter().flat_map(|error| rows(page, name, unit, error));
        rows.collect::<Vec<_>>()
    };
    let accelerations = of("acceleration", Axis::acceleration, &score.acceleration);
    let torques = of("torque", |unit| force_unit(unit).into(), &score.torque);
    let judgements = (0..accelerations.len()).map(|i| score.acceleration_judgement(i, assessment));
    let judgements =
        judgements.chain((0..torques.len()).map(|i| score.torque_judgement(i, assessment)));
    let judgements = judgements.collect();
    Table::new(
        "Errors at single samples: root mean square, and relative to the signal's variance (100 % is as good as its mean).",
        &["signal", "coordinate", "RMS error", "of its variance"],
        [accelerations, torques].concat(),
    )
    .with_judgements(judgements)
}

fn rows(
    page: &Page,
    name: &str,
    unit: fn(&str) -> String,
    error: &SignalError,
) -> Vec<Vec<String>> {
    let errors = error.mse.iter().zip(&error.nmse);
    let row = |(coordinate, (mse, nmse)): (&Coordinate, (&f64, &f64))| {
        let rms = format!("{} {}", short(mse.sqrt()), unit(&coordinate.unit));
        let percent = format!("{} %", short(100.0 * nmse));
        vec![name.into(), coordinate.name.clone(), rms, percent]
    };
    page.model
        .coordinates()
        .0
        .iter()
        .zip(errors)
        .map(row)
        .collect()
}

/// The learned parameters that have a name and a unit.
fn parameters(page: &Page) -> Table {
    let row = |p: Parameter| {
        let error = p.standard_error.map(|e| format!(" ± {}", short(e)));
        let value = format!("{}{}", short(p.value), error.unwrap_or_default());
        vec![p.name, value, p.unit]
    };
    Table::new(
        "Learned parameters of the Lagrangian and of the forces beside it.",
        &["parameter", "value", "unit"],
        page.model.parameters().into_iter().map(row).collect(),
    )
}

/// The warnings of the check of the data.
fn warnings(page: &Page) -> Table {
    let items = page.evaluation.check.items.iter();
    let warned = items.filter(|item| item.verdict == Verdict::Warn);
    let row = |item: &Item| {
        let trajectory = item.trajectory.clone().unwrap_or_else(|| "all".into());
        let (finding, remedy) = (item.finding.clone(), item.remedy.clone());
        vec![
            trajectory,
            item.name.into(),
            finding,
            remedy.unwrap_or_default(),
        ]
    };
    Table::new(
        "Warnings about the data; `lagrangian check` shows all findings.",
        &["trajectory", "check", "finding", "remedy"],
        warned.take(MOST_MOTIONS).map(row).collect(),
    )
}

fn motions(page: &Page, score: &Score) -> Table {
    let shown = score.rollouts.len().min(MOST_MOTIONS);
    let rest = match score.rollouts.len() - shown {
        0 => String::new(),
        more => format!(" The first {shown}; {more} more are in `lagrangian score --json`."),
    };
    let row = |(trajectory, rollout): (&Trajectory, &RolloutScore)| {
        let bound = if rollout.exceeded { "" } else { "≥ " };
        let duration = format!("{:.2} s", rollout.duration);
        let followed = format!("{bound}{:.2} s", rollout.valid_seconds);
        let end = ending(&rollout.outcome);
        vec![trajectory.name.clone(), duration, followed, end]
    };
    let pairs = page.evaluation.motions.iter().zip(&score.rollouts);
    Table::new(
        format!("Whole motions, each predicted from its first state alone.{rest}"),
        &["motion", "duration", "followed for", "prediction ended"],
        pairs.take(shown).map(row).collect(),
    )
    .with_judgements((0..shown).map(|k| score.motion_judgement(k)).collect())
}

fn ending(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Finished => "with the motion".into(),
        Outcome::Diverged { t, .. } => format!("diverged at {t:.2} s"),
        Outcome::Stopped { t } => format!("stopped at {t:.2} s"),
        Outcome::StepLimit { t } => format!("step limit at {t:.2} s"),
    }
}

/// The given settings, without empty ones; files by the beginnings of their hashes.
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
        let (name, hash) = (super::file_name(&file.path), brief_hash(&file.sha256));
        (
            format!("{} data", file.role),
            format!("{name} (SHA-256 {hash})"),
        )
    }));
    rows
}

/// A setting that was chosen from the data, with its reason.
fn choice(choice: &AutoSetting) -> (String, String) {
    let value = match &choice.value {
        serde_json::Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let name = choice.setting.replace('_', " ");
    (name, format!("{value} (chosen: {})", choice.reason))
}

fn setting((name, value): (&String, &toml::Value)) -> Option<(String, String)> {
    // The data files are listed with their hashes, and the treatment of an existing folder is not a setting of the fit.
    if matches!(name.as_str(), "files" | "validate" | "force" | "resume") {
        return None;
    }
    let words = match value {
        toml::Value::String(text) => text.clone(),
        toml::Value::Boolean(yes) => String::from(if *yes { "yes" } else { "no" }),
        toml::Value::Array(items) => {
            let word = |item: &toml::Value| item.as_str().map_or(item.to_string(), String::from);
            items.iter().map(word).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    };
    (!words.is_empty()).then(|| (name.replace('_', " "), words))
}
