//! The tables of a run's page.

use lagrangian::check::Item;
use lagrangian::mechanics::Outcome;
use lagrangian::score::{Assessment, Forward, Judgement, RestartScore, RolloutScore, SignalError};
use lagrangian::{Coordinates, Model, Score, Trajectory, Verdict};
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
    let (coordinates, motions) = (page.model.coordinates(), &page.evaluation.motions);
    let mut tables = vec![tried(page)];
    tables.extend(score_tables(coordinates, motions, score, assessment));
    tables.extend([parameters(page), warnings(page)]);
    tables
}

/// The tables of a score: errors at single samples, the forward dynamics of each joint, the motions, and predictions that restart.
#[must_use]
pub fn score_tables(
    coordinates: &Coordinates,
    trajectories: &[Trajectory],
    score: &Score,
    assessment: &Assessment,
) -> Vec<Table> {
    vec![
        errors(coordinates, score, assessment),
        forwards(assessment),
        motions(trajectories, score),
        positions(coordinates, trajectories, score),
        restarts(coordinates, score),
    ]
}

/// The models that were compared.
fn tried(page: &Page) -> Table {
    let row = |c: &CandidateResult| {
        let (name, error) = c.shown();
        let error = match (error, &c.failure) {
            (Some(error), _) => format!("{} %", short(100.0 * error)),
            (None, Some(failure)) => failure.clone(),
            (None, None) => String::new(),
        };
        vec![name.into(), error, format!("{:.1} s", c.seconds)]
    };
    Table::new(
        "Models that were tried: the squared error of their torques, or of the accelerations of free motions, in parts of its size, on samples that were held back.",
        &["model", "error", "time"],
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

fn errors(coordinates: &Coordinates, score: &Score, assessment: &Assessment) -> Table {
    let (mut rows, mut judgements) = (Vec::new(), Vec::new());
    let mut add = |name: &str, error: &Option<SignalError>, unit: UnitOf, judged: JudgementOf| {
        let each = error.iter().flat_map(|e| e.mse.iter().zip(&e.nmse));
        for (i, (coordinate, (mse, nmse))) in coordinates.0.iter().zip(each).enumerate() {
            let rms = format!("{} {}", short(mse.sqrt()), unit(&coordinate.unit));
            let percent = format!("{} %", short(100.0 * nmse));
            rows.push(vec![name.into(), coordinate.name.clone(), rms, percent]);
            judgements.push(judged(score, i, assessment));
        }
    };
    add(
        "acceleration",
        &score.acceleration,
        Axis::acceleration,
        Score::acceleration_judgement,
    );
    let force = |unit: &str| force_unit(unit).into();
    add("torque", &score.torque, force, Score::torque_judgement);
    let singular = match score.singular {
        0 => String::new(),
        states => format!(" The mass matrix is singular at {states} states."),
    };
    Table::new(
        format!("Errors at single samples: root mean square, and relative to the signal's variance (100 % is as good as its mean).{singular}"),
        &["signal", "coordinate", "RMS error", "of its variance"],
        rows,
    )
    .with_judgements(judgements)
}

/// The unit of a signal for the unit of a coordinate.
type UnitOf = fn(&str) -> String;
/// The verdict on a signal of a coordinate.
type JudgementOf = fn(&Score, usize, &Assessment) -> Option<Judgement>;

/// A row of values of the coordinates, with their units.
fn with_units(coordinates: &Coordinates, values: &[f64]) -> impl Iterator<Item = String> {
    let pairs = coordinates.0.iter().zip(values).take(MOST_COLUMNS);
    pairs.map(|(own, value)| format!("{} {}", short(*value), own.unit))
}

/// Of more coordinates a table has the first.
const MOST_COLUMNS: usize = 24;

/// The header of a table with columns of the coordinates.
fn header<'a>(first: &[&'a str], coordinates: &'a Coordinates) -> Vec<&'a str> {
    let names = coordinates.0.iter().map(|own| own.name.as_str());
    let names = names.take(MOST_COLUMNS);
    first.iter().copied().chain(names).collect()
}

/// Errors of motions that are simulated from goals.
fn positions(coordinates: &Coordinates, trajectories: &[Trajectory], score: &Score) -> Table {
    let pairs = trajectories.iter().zip(&score.rollouts);
    let with_goals = pairs.filter(|(trajectory, _)| !trajectory.goal.is_empty());
    let row = |(trajectory, rollout): (&Trajectory, &RolloutScore)| {
        let errors = with_units(coordinates, &rollout.q_mean_absolute);
        [trajectory.name.clone()]
            .into_iter()
            .chain(errors)
            .collect()
    };
    Table::new(
        "Mean absolute errors of the positions of motions that are simulated from their goals.",
        &header(&["motion"], coordinates),
        with_goals.take(MOST_MOTIONS).map(row).collect(),
    )
}

/// Errors of predictions that restart from the recording.
fn restarts(coordinates: &Coordinates, score: &Score) -> Table {
    let row = |own: &RestartScore| {
        let counts = [format!("{:.1} s", own.seconds), own.starts.to_string()];
        let counts = counts.into_iter().chain([own.unfinished.to_string()]);
        counts
            .chain(with_units(coordinates, &own.q_rms_end))
            .collect()
    };
    Table::new(
        "Root mean square errors of the coordinates at the ends of short predictions, each from a recorded state.",
        &header(&["after", "starts", "diverged"], coordinates),
        score.restarts.iter().map(row).collect(),
    )
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

fn motions(trajectories: &[Trajectory], score: &Score) -> Table {
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
    let pairs = trajectories.iter().zip(&score.rollouts);
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
