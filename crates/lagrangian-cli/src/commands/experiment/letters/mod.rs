//! The 2-joint arm that writes letters: torques of letters that no model has seen, learning curves, faster writing and
//! noisy torques, for learned Lagrangians, a plain network and the identified chain.

mod contestants;
mod curve;
mod figures;
mod main_fit;
mod noise;
mod page;

use std::fs;

use anyhow::Result;
use lagrangian::experiment::letters::Letters;
use lagrangian::train::{Budget, FitConfig};
use serde_json::{Map, Value, json};

use super::{Course, Experiment, Findings, Setting};
use crate::failure::Advise;

use contestants::{CONTESTANTS, Contestant};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "letters",
    about: "2-joint arm: torques of unseen letters, learning curve, faster writing, noise",
    parts: None,
    run,
};

/// How many times as fast the test letters are written.
const SPEEDS: [f64; 7] = [1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5];

/// How long, how often.
struct Plan {
    seeds: Vec<u64>,
    /// Time of a main fit, s.
    main: f64,
    /// Time of a fit of the curves, s.
    short: f64,
    /// Numbers of training letters of the learning curve.
    counts: Vec<usize>,
    /// Deviations of the noise, as parts of the torques' own.
    noise: Vec<f64>,
}

impl Plan {
    fn of(setting: &Setting) -> Self {
        let quick = setting.args.quick;
        let main = setting
            .args
            .seconds
            .unwrap_or(if quick { 1.5 } else { 60.0 });
        Self {
            seeds: setting.seeds(),
            main,
            short: if quick { 0.2 * main } else { 0.1 * main },
            counts: if quick {
                vec![1, 4, 17]
            } else {
                vec![1, 2, 3, 4, 6, 8, 12, 17]
            },
            noise: vec![0.01, 0.05],
        }
    }

    /// Expected seconds of the whole.
    fn seconds(&self) -> f64 {
        let trained = CONTESTANTS.iter().filter(|c| c.is_trained()).count() as f64;
        let main = (trained + main_fit::COMPANION) * self.main;
        let curve = trained * self.counts.len() as f64 * self.short;
        let noise = trained * (self.noise.len() * noise::CANDIDATES.len()) as f64 * self.short;
        self.seeds.len() as f64 * (main + curve + noise)
    }
}

/// The settings of a fit of this length.
fn config(contestant: &Contestant, seconds: f64, seed: u64) -> FitConfig {
    FitConfig {
        family: (contestant.family)(),
        loss: contestant.loss,
        budget: Budget::Seconds(seconds),
        seed,
        validate_every: 10,
        ..FitConfig::default()
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let path = setting.data("characters")?.join("characters.csv");
    let shown = format!("cannot read '{}'", path.display());
    let file = fs::read(&path).advise(&shown, "check that the file may be read")?;
    let letters = Letters::read(&file).advise(shown, "give the reference data with --data")?;
    let plan = Plan::of(setting);
    course.plan(plan.seconds());
    let main = main_fit::measure(&letters, &plan, setting.folder, course)?;
    let curve = curve::measure(&letters, &plan, course)?;
    let noise = noise::measure(&letters, &plan, course)?;
    let mut figures: Map<String, Value> = main
        .iter()
        .map(|found| (found.contestant.key.to_string(), found.json()))
        .collect();
    figures.insert("learning_curve".into(), curve.json());
    figures.insert("extrapolation".into(), main_fit::extrapolation(&main));
    figures.insert("noise".into(), noise.json());
    figures.insert(
        "truth".into(),
        json!({ "valid_seconds": page::truth(&main) }),
    );
    Ok(Findings {
        figures: figures.into(),
        summary: page::summary(&main),
        report: page::report(&plan, &main, &curve, &noise),
    })
}
