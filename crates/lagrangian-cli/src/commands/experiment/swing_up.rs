//! Pendulums that are swung up through a learned energy, against the true one.

use anyhow::Result;
use experiments::swing_up::{Attempt, HELD, SECONDS, attempts, excitation, machine};
use lagrangian::dynamics::Model;
use lagrangian::lagrangian::DelanConfig;
use lagrangian::train::{Budget, Family, FitConfig, Loss, fit};
use lagrangian_control::Machine;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};
use serde_json::{Map, Value, json};

use super::spread::{cell, scientific};
use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "swing-up",
    about: "pendulum, cart-pole and Furuta pendulum, swung up through a learned energy",
    parts: None,
    run,
};

/// Starts of each machine, and in a quick run.
const STARTS: usize = 30;
const FEW: usize = 5;
/// Seconds of random motion that a model is learned from, and in a quick run.
const DATA: f64 = 180.0;
const LITTLE: f64 = 60.0;
/// The starts are the same for all models and seeds.
const START_SEED: u64 = 5;

struct Found {
    machine: Machine,
    truth: Vec<Attempt>,
    /// `[seed]`: attempts, or why there were none.
    learned: Vec<std::result::Result<Vec<Attempt>, String>>,
    /// Validation loss of each fit.
    losses: Vec<f64>,
}

impl Found {
    fn successes(&self) -> Vec<f64> {
        let count = |runs: &std::result::Result<Vec<Attempt>, String>| {
            runs.as_ref().map_or(0.0, |runs| successes(runs) as f64)
        };
        self.learned.iter().map(count).collect()
    }

    fn json(&self) -> Value {
        let times = |runs: &[Attempt]| runs.iter().map(|a| a.up_since).collect::<Vec<_>>();
        let learned = |runs: &std::result::Result<Vec<Attempt>, String>| match runs {
            Ok(runs) => json!({ "successes": successes(runs), "up_since": times(runs) }),
            Err(reason) => json!({ "successes": 0, "reason": reason }),
        };
        json!({
            "starts": self.truth.len(),
            "truth": { "successes": successes(&self.truth), "up_since": times(&self.truth) },
            "learned": self.learned.iter().map(learned).collect::<Vec<_>>(),
            "validation_loss": self.losses,
        })
    }
}

fn successes(runs: &[Attempt]) -> usize {
    runs.iter().filter(|a| a.up_since.is_some()).count()
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let seeds = setting.seeds();
    course.plan((Machine::ALL.len() * seeds.len()) as f64);
    let mut found = Vec::new();
    for machine in Machine::ALL {
        found.push(measure(machine, setting, &seeds, course)?);
    }
    let figures: Map<String, Value> = found
        .iter()
        .map(|f| (f.machine.system().to_string(), f.json()))
        .collect();
    Ok(Findings {
        figures: figures.into(),
        summary: summary(&found),
        report: report(&found, setting.args.quick),
    })
}

fn measure(kind: Machine, setting: &Setting, seeds: &[u64], course: &mut Course) -> Result<Found> {
    let quick = setting.args.quick;
    let (starts, data) = if quick { (FEW, LITTLE) } else { (STARTS, DATA) };
    let system = machine(kind)?;
    let truth: &dyn Model = &*system;
    let mut found = Found {
        machine: kind,
        truth: attempts(kind, truth, starts, START_SEED)?,
        learned: Vec::new(),
        losses: Vec::new(),
    };
    for &seed in seeds {
        course.begin(format!("{}, seed {seed}", kind.system()), 1.0)?;
        let config = FitConfig {
            family: Box::new(DelanConfig::default()),
            loss: Loss::Torque,
            budget: setting.args.seconds.map_or(
                Budget::Steps(if quick { 100 } else { 300 }),
                Budget::Seconds,
            ),
            batch: 128,
            seed,
            ..FitConfig::default()
        };
        let fitted = fit(&excitation(kind, data, seed)?, &config, None, course)?;
        course.check()?;
        found.losses.push(fitted.best);
        let result = attempts(kind, &fitted.model, starts, START_SEED);
        found.learned.push(result.map_err(|e| e.to_string()));
    }
    Ok(found)
}

fn summary(found: &[Found]) -> Table {
    let row = |found: &Found| {
        let starts = found.truth.len();
        let times: Vec<f64> = found
            .learned
            .iter()
            .flatten()
            .flatten()
            .filter_map(|a| a.up_since)
            .collect();
        let true_times: Vec<f64> = found.truth.iter().filter_map(|a| a.up_since).collect();
        vec![
            found.machine.system().to_string(),
            format!("{} of {starts}", successes(&found.truth)),
            format!("{} of {starts}", counts(&found.successes())),
            cell(&true_times),
            cell(&times),
            cell(&found.losses),
        ]
    };
    Table {
        caption: format!(
            "Swing-ups from random starts that end upright within {SECONDS} s and were held for at least {HELD} s, for each \
             seed; seconds until upright, median (least … largest) of all; mean squared torque error of the fit in units of \
             its variance."
        ),
        header: [
            "machine",
            "true model",
            "learned",
            "s, true",
            "s, learned",
            "loss",
        ]
        .map(str::to_string)
        .to_vec(),
        rows: found.iter().map(row).collect(),
    }
}

/// How many swing-ups succeeded with each fit: `30, 29, 30`.
fn counts(successes: &[f64]) -> String {
    let counts: Vec<String> = successes.iter().map(|x| format!("{x:.0}")).collect();
    counts.join(", ")
}

/// The pendulum's angle in the first attempt, with the true and with the learned model.
fn angles(found: &Found) -> Figure {
    let p = found.machine.config().pendulum;
    let angle = |attempt: &Attempt| {
        let n = attempt.motion.dof();
        let rows = attempt.motion.q.chunks_exact(n).step_by(10);
        rows.map(|q| q[p]).collect::<Vec<f64>>()
    };
    let time = |attempt: &Attempt| attempt.motion.t.iter().step_by(10).copied().collect();
    let learned = found.learned.iter().flatten().next();
    let pairs = [
        ("through the true model", Role::Truth, found.truth.first()),
        (
            "through the learned one",
            Role::Lnn,
            learned.and_then(|a| a.first()),
        ),
    ];
    let series = pairs.into_iter().filter_map(|(name, role, attempt)| {
        attempt.map(|a| Series::line(name, role, time(a), angle(a)))
    });
    Figure {
        id: format!("angle-{}", found.machine.system()),
        title: format!("Angle of the {}", found.machine.system()),
        caption: "From the first start; π is up, and so is π after whole turns (9.42, −3.14 …)."
            .into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("angle from hanging down", "rad"),
        series: series.collect(),
    }
}

fn report(found: &[Found], quick: bool) -> Report {
    let headline = |found: &Found| Headline {
        label: format!("Swing-ups, {}", found.machine.system()),
        value: format!("{:.0}", found.successes().iter().sum::<f64>()),
        unit: format!("of {}", found.truth.len() * found.learned.len()),
        note: format!(
            "all seeds; true model {} of {}",
            successes(&found.truth),
            found.truth.len()
        ),
        role: Some(Role::Lnn),
    };
    Report {
        title: "Swing-up through a learned energy".into(),
        subtitle: format!(
            "Deep Lagrangian networks from {} s of random motion; the controller has the true model or the learned one",
            scientific(if quick { LITTLE } else { DATA })
        ),
        headlines: found.iter().map(headline).collect(),
        summary: vec![
            "Energy shaping with collocated partial feedback linearisation, then a linear-quadratic regulator: both take \
             all that they know of the machine from the model, also the regulator's gains."
                .into(),
        ],
        figures: found.iter().map(angles).collect(),
        ..Report::default()
    }
}
