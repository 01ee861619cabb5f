//! Arms that write letters while their model is learned: feedback alone, a plain network, a learned Lagrangian and the
//! true model; and a payload that comes while they write.

mod page;

use std::fs;

use anyhow::Result;
use experiments::tracking::{
    Arm, Condition, Lesson, Outcome, Writing, curves, recovery, run as track,
};
use lagrangian::Trajectory;
use lagrangian::experiment::letters::Letters;
use serde_json::{Map, Value, json};

use super::spread::median;
use super::{Course, Experiment, Findings, Setting};
use crate::failure::Advise;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "tracking",
    about: "arms of 2 and 7 joints that write letters while their model is learned; a payload comes",
    parts: None,
    run,
};

/// Letters before the payload comes, eight to learn from and two to judge by; and in a quick run.
const LETTERS: usize = 10;
const FEW: usize = 3;
/// A model has recovered where the error stays within this factor of before.
const RECOVERED: f64 = 1.2;
/// A model follows where its error is below so many times that of the true one.
const FOLLOWS: f64 = 10.0;

/// All runs of one arm.
struct Found {
    arm: Arm,
    writing: Writing,
    /// When the payload comes, s.
    change: f64,
    /// `[condition][seed]`.
    runs: Vec<(Condition, Vec<Outcome>)>,
    /// The learner on a thread of its own, in real time.
    live: Option<Outcome>,
}

impl Found {
    fn of(&self, condition: Condition) -> &[Outcome] {
        let found = self.runs.iter().find(|(c, _)| *c == condition);
        found.map_or(&[], |(_, runs)| runs)
    }

    /// The error of the last letters before the payload, one figure a seed.
    fn before(&self, condition: Condition) -> Vec<f64> {
        let last = |errors: &[f64]| {
            let end = errors.len().saturating_sub(1);
            let pair = &errors[end.saturating_sub(2)..end];
            (pair.iter().map(|e| e * e).sum::<f64>() / pair.len().max(1) as f64).sqrt()
        };
        let runs = self.of(condition).iter();
        runs.map(|run| last(&run.errors)).collect()
    }

    /// Seconds from the payload to the old error, one figure a seed; NaN where it does not come back, and for a model
    /// that had not learned to follow before.
    fn recoveries(&self, condition: Condition) -> Vec<f64> {
        let before = self
            .before(condition)
            .into_iter()
            .zip(self.ratios(condition));
        let runs = self.of(condition).iter().zip(before);
        let seconds = runs.map(|(run, (before, ratio))| {
            let found = recovery(&run.after.1, before, RECOVERED);
            found.filter(|_| ratio < FOLLOWS)
        });
        seconds.map(|found| found.unwrap_or(f64::NAN)).collect()
    }

    /// The learned error of the last letters over that of the true model, one figure a seed.
    fn ratios(&self, condition: Condition) -> Vec<f64> {
        let pairs = self.before(condition).into_iter();
        pairs
            .zip(self.before(Condition::Perfect))
            .map(|(a, b)| a / b)
            .collect()
    }

    fn json(&self) -> Value {
        let one = |(condition, runs): &(Condition, Vec<Outcome>)| {
            let each = |f: &dyn Fn(&Outcome) -> Value| runs.iter().map(f).collect::<Vec<_>>();
            let value = json!({
                "errors": each(&|run| json!(run.errors)),
                "after_payload": each(&|run| json!({ "t": run.after.0, "error": run.after.1 })),
                "before_payload": self.before(*condition),
                "over_perfect": self.ratios(*condition),
                "recovery_seconds": self.recoveries(*condition),
                "latency": each(&|run| json!(run.latency)),
                "learner": each(&|run| json!(run.record)),
                "finished": each(&|run| json!(run.finished)),
            });
            (condition.key().to_string(), value)
        };
        let conditions: Map<String, Value> = self.runs.iter().map(one).collect();
        let letters: Vec<&str> = self.writing.letters.iter().map(|l| l.0.as_str()).collect();
        let live = self.live.as_ref();
        json!({
            "letters": letters,
            "payload_kg": self.arm.payload,
            "payload_at": self.change,
            "conditions": conditions,
            "live": live.map(|run| json!({
                "latency": run.latency, "histogram": run.histogram, "learner": run.record,
                "errors": run.errors,
            })),
        })
    }
}

/// The letters of the reference data; where it is absent, curves like letters.
fn text(setting: &Setting, count: usize) -> Result<Vec<Trajectory>> {
    let Ok(folder) = setting.data("characters") else {
        return Ok(curves(count));
    };
    let path = folder.join("characters.csv");
    let shown = format!("cannot read '{}'", path.display());
    let file = fs::read(&path).advise(&shown, "check that the file may be read")?;
    let letters = Letters::read(&file).advise(shown, "give the reference data with --data")?;
    Ok(letters.chosen(count, 0))
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let quick = setting.args.quick;
    let letters = text(setting, if quick { FEW } else { LETTERS } + 1)?;
    let mut arms = vec![Arm::two_joints()?];
    if !quick {
        arms.push(Arm::seven_joints()?);
    }
    let seeds = setting.seeds();
    // A learned second of seven joints takes some ten times as long as one of two.
    let weight = |arm: &Arm| if arm.gains.kp.len() > 2 { 10.0 } else { 1.0 };
    let learned = 2.0 * seeds.len() as f64 + 1.0;
    course.plan(arms.iter().map(weight).sum::<f64>() * learned);
    let mut found = Vec::new();
    for arm in arms {
        let weight = weight(&arm);
        found.push(measure(arm, &letters, &seeds, weight, course)?);
    }
    let figures: Map<String, Value> = found
        .iter()
        .map(|f| (f.arm.name.replace(' ', "_"), f.json()))
        .collect();
    Ok(Findings {
        figures: figures.into(),
        summary: page::summary(&found),
        report: page::report(&found, seeds.len()),
    })
}

fn measure(
    arm: Arm,
    letters: &[Trajectory],
    seeds: &[u64],
    weight: f64,
    course: &mut Course,
) -> Result<Found> {
    let text: Vec<Trajectory> = letters.iter().map(|letter| arm.write(letter)).collect();
    let writing = Writing::new(&text)?;
    let change = writing.letters.last().map_or(0.0, |last| last.1);
    let lesson = Lesson::default();
    let mut runs = Vec::new();
    for condition in Condition::ALL {
        let trained = matches!(condition, Condition::Plain | Condition::Learned);
        let mut outcomes = Vec::new();
        for &seed in seeds {
            let part = format!("{}, {}, seed {seed}", arm.name, condition.key());
            course.begin(part, if trained { weight } else { 0.0 })?;
            let change = (condition != Condition::Pd).then_some(change);
            outcomes.push(track(
                &arm,
                &writing,
                condition,
                (change, seed, false),
                &lesson,
            )?);
        }
        runs.push((condition, outcomes));
    }
    course.begin(format!("{}, in real time", arm.name), weight)?;
    // Two letters are enough to see how long a tick takes.
    let short = Writing::new(&text[..text.len().min(2)])?;
    let live = track(
        &arm,
        &short,
        Condition::Learned,
        (None, seeds[0], true),
        &lesson,
    )?;
    Ok(Found {
        arm,
        writing,
        change,
        runs,
        live: Some(live),
    })
}

/// What a condition is called in tables.
fn name(condition: Condition) -> &'static str {
    match condition {
        Condition::Pd => "feedback alone",
        Condition::Plain => "plain network, learned online",
        Condition::Learned => "deep Lagrangian network, learned online",
        Condition::Perfect => "true model",
        Condition::PerfectLoaded => "true model that knows the payload",
    }
}

/// The letter errors of a condition, median over the seeds.
fn typical(runs: &[Outcome]) -> Vec<f64> {
    let letters = runs.first().map_or(0, |run| run.errors.len());
    let letter = |k: usize| median(&runs.iter().map(|run| run.errors[k]).collect::<Vec<_>>());
    (0..letters).map(letter).collect()
}
