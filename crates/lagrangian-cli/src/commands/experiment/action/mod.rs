//! The principle itself: the action of true and of learned Lagrangians along varied paths.

mod page;

use anyhow::Result;
use experiments::action::{
    CASES, Case, Comparison, Judged, compare, energy_scale, first_conjugate_time, judge, mass_scale,
};
use lagrangian::experiment::random_states;
use lagrangian::lagrangian::analytic::AnalyticModel;
use lagrangian::train::{Budget, Family, FitConfig, Learned, Loss, fit};
use lagrangian::{Form, Lagrangian, LnnConfig};
use serde_json::{Map, Value, json};

use super::{Course, Experiment, Findings, Setting};
use crate::failure::mistake;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "action",
    about: "stationary paths, their varied neighbours and conjugate points, of true and learned Lagrangians",
    parts: None,
    run,
};

/// States that a model is fitted to, and those of a quick run.
const SAMPLES: usize = 20_000;
const FEW: usize = 4_000;
/// Steps of the natural gradient, and of a quick run.
const STEPS: usize = 1000;
const SHORT: usize = 60;

/// What was found between the ends of one case, by one Lagrangian.
struct Paths {
    short: Judged,
    long: Judged,
    /// First conjugate time of the long path, s.
    conjugate: Option<f64>,
}

/// One fit.
struct Run {
    paths: Paths,
    short: Comparison,
    long: Comparison,
    /// α of the energies over all states, and the part of their variance that is missed.
    energy: (f64, f64),
    loss: f64,
}

struct Found {
    case: Case,
    truth: Paths,
    /// One a seed; `None` where the model has no path near the true one.
    learned: Vec<Option<Run>>,
}

impl Found {
    fn runs(&self) -> impl Iterator<Item = &Run> {
        self.learned.iter().flatten()
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let seeds = setting.seeds();
    let quick = setting.args.quick;
    let cases = if quick { &CASES[..1] } else { &CASES[..] };
    course.plan((cases.len() * (1 + 8 * seeds.len())) as f64);
    let mut found = Vec::new();
    for case in cases {
        course.begin(format!("{}, true", case.system), 1.0)?;
        let system = case.system()?;
        let truth = paths(*case, system.lagrangian())?.ok_or_else(|| no_path(case))?;
        let mut one = Found {
            case: *case,
            truth,
            learned: Vec::new(),
        };
        for &seed in &seeds {
            course.begin(format!("{}, seed {seed}", case.system), 8.0)?;
            let run = learned(&one, &*system, seed, setting, course)?;
            one.learned.push(run);
        }
        found.push(one);
    }
    let figures: Map<String, Value> = found
        .iter()
        .map(|f| (f.case.system.to_string(), json(f)))
        .collect();
    Ok(Findings {
        figures: figures.into(),
        summary: page::summary(&found),
        report: page::report(&found)?,
    })
}

fn no_path(case: &Case) -> anyhow::Error {
    mistake(
        format!("the true system '{}' has no stationary path", case.system),
        "this is a fault of the program: report it",
    )
}

/// Both paths of a case; `None` where one is not found.
fn paths(case: Case, lagrangian: &dyn Lagrangian) -> Result<Option<Paths>> {
    let short = judge(lagrangian, &case.motion(case.short)?)?;
    let long = judge(lagrangian, &case.motion(case.long)?)?;
    let (Some(short), Some(long)) = (short, long) else {
        return Ok(None);
    };
    let conjugate = first_conjugate_time(lagrangian, &long.stationary.path);
    Ok(Some(Paths {
        short,
        long,
        conjugate,
    }))
}

fn learned(
    found: &Found,
    system: &dyn AnalyticModel,
    seed: u64,
    setting: &Setting,
    course: &mut Course,
) -> Result<Option<Run>> {
    let (model, loss) = fitted(system, seed, setting, course)?;
    course.check()?;
    let Some(lagrangian) = model.lagrangian() else {
        return Ok(None);
    };
    let energy = energy_scale(system, &model)?;
    let Some(paths) = paths(found.case, lagrangian)? else {
        return Ok(None);
    };
    let compared = |truth: &Judged, own: &Judged| {
        let path = &truth.stationary.path;
        compare(
            truth,
            own,
            mass_scale(system.lagrangian(), lagrangian, path),
        )
    };
    Ok(Some(Run {
        short: compared(&found.truth.short, &paths.short),
        long: compared(&found.truth.long, &paths.long),
        paths,
        energy,
        loss,
    }))
}

/// A Lagrangian network, fitted to exact accelerations of random states.
fn fitted(
    system: &dyn AnalyticModel,
    seed: u64,
    setting: &Setting,
    course: &mut Course,
) -> Result<(Learned, f64)> {
    let quick = setting.args.quick;
    let samples = if quick { FEW } else { SAMPLES };
    let data = random_states(system, samples, samples / 10, seed)?;
    let steps = if quick { SHORT } else { STEPS };
    let config = FitConfig {
        family: Box::new(LnnConfig {
            form: Form::Free,
            width: if quick { 32 } else { 64 },
            ..LnnConfig::default()
        }),
        loss: Loss::Acceleration,
        budget: setting
            .args
            .seconds
            .map_or(Budget::Steps(steps), Budget::Seconds),
        batch: if quick { 128 } else { 256 },
        seed,
        ..FitConfig::default()
    };
    let fitted = fit(&data, &config, None, course)?;
    Ok((fitted.model, fitted.best))
}

fn json(found: &Found) -> Value {
    let paths = |paths: &Paths| {
        json!({
            "short": paths.short,
            "long": paths.long,
            "first_conjugate_time": paths.conjugate,
        })
    };
    let run = |run: &Option<Run>| match run {
        None => Value::Null,
        Some(run) => json!({
            "loss": run.loss,
            "energy_scale": run.energy.0,
            "energy_missed": run.energy.1,
            "paths": paths(&run.paths),
            "short": run.short,
            "long": run.long,
        }),
    };
    json!({
        "case": {
            "from": found.case.q,
            "velocity": found.case.qd,
            "short_seconds": found.case.short,
            "long_seconds": found.case.long,
        },
        "truth": paths(&found.truth),
        "learned": found.learned.iter().map(run).collect::<Vec<_>>(),
    })
}
