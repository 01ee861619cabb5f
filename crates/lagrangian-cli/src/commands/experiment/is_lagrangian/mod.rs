//! Systems of which it is known whether a Lagrangian exists, and what their recordings say.

mod page;

use anyhow::Result;
use experiments::existence::{System, noisy};
use lagrangian::train::Budget;
use lagrangian_analysis::existence::{Survey, SurveyConfig, survey};
use serde_json::{Map, Value, json};

use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "is-lagrangian",
    about: "does any Lagrangian exist? eleven systems of which it is known",
    parts: None,
    run,
};

/// Recordings of each system.
const RECORDINGS: usize = 24;
/// Steps of a fit, and in a quick run.
const STEPS: usize = 300;
const FEW: usize = 80;
/// Noise of the accelerations, as parts of their root mean squares.
const NOISES: [f64; 2] = [0.0, 0.01];
/// Systems of a quick run.
const QUICK: [System; 4] = [
    System::Pendulum,
    System::ChargedParticle,
    System::CoulombPendulum,
    System::VanDerPol,
];

/// What was found of one system.
struct Found {
    system: System,
    noise: f64,
    /// `[seed]`.
    surveys: Vec<Survey>,
}

impl Found {
    fn right(&self) -> usize {
        let truth = self.system.truth();
        let right = |s: &&Survey| s.verdict.existence == truth;
        self.surveys.iter().filter(right).count()
    }

    fn json(&self) -> Value {
        json!({
            "truth": self.system.truth(),
            "right": self.right(),
            "surveys": self.surveys,
        })
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let quick = setting.args.quick;
    let systems: &[System] = if quick { &QUICK } else { &System::ALL };
    let noises: &[f64] = if quick { &NOISES[..1] } else { &NOISES };
    course.plan((systems.len() * noises.len() * setting.seeds().len()) as f64);
    let mut found = Vec::new();
    for &noise in noises {
        for &system in systems {
            found.push(measure(system, noise, setting, course)?);
        }
    }
    Ok(Findings {
        figures: figures(&found),
        summary: page::summary(&found),
        report: page::report(&found, quick),
    })
}

fn measure(system: System, noise: f64, setting: &Setting, course: &mut Course) -> Result<Found> {
    let steps = if setting.args.quick { FEW } else { STEPS };
    let coordinates = system.coordinates()?;
    let mut surveys = Vec::new();
    for seed in setting.seeds() {
        let part = format!("{}, noise {noise}, seed {seed}", system.name());
        course.begin(part, 1.0)?;
        let recordings = noisy(system.recordings(RECORDINGS, seed)?, noise, seed);
        let config = SurveyConfig {
            budget: setting
                .args
                .seconds
                .map_or(Budget::Steps(steps), Budget::Seconds),
            seed,
            ..SurveyConfig::default()
        };
        surveys.push(survey(&coordinates, &recordings, &config, course)?);
        course.check()?;
    }
    Ok(Found {
        system,
        noise,
        surveys,
    })
}

fn figures(found: &[Found]) -> Value {
    let mut by_noise: Map<String, Value> = Map::new();
    for one in found {
        let name = format!("noise_{}", one.noise);
        let systems = by_noise.entry(name).or_insert_with(|| json!({}));
        systems[one.system.name()] = one.json();
    }
    let of: usize = found.iter().map(|f| f.surveys.len()).sum();
    by_noise.insert("of".into(), of.into());
    let right: usize = found.iter().map(Found::right).sum();
    by_noise.insert("right".into(), right.into());
    by_noise.into()
}
