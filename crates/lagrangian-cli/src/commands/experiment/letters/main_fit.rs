//! The main figure: each family trained for the full time on all training letters.

use anyhow::Result;
use lagrangian::dataset::Dataset;
use lagrangian::dynamics::Model;
use lagrangian::experiment::letters::{Letter, Letters, error, valid_seconds};
use lagrangian::experiment::{History, TorqueError, fit_with_history};
use lagrangian::saved::Provenance;
use lagrangian::train::{Learned, Loss, fit};
use serde_json::{Value, json};

use super::contestants::{CONTESTANTS, Contestant};
use super::{Course, Plan, SPEEDS, config};
use crate::run_folder::RunFolder;

/// Time of the forward network that stands in where a torque network cannot move, in parts of a main fit.
pub(super) const COMPANION: f64 = 1.0 / 3.0;

/// The public code's figure, and the one to reach, (N·m)².
const BOUNDS: [(&str, f64); 2] = [("seconds_to_1_5e-5", 1.5e-5), ("seconds_to_1e-8", 1e-8)];

/// One family with one seed.
pub(super) struct Fitted {
    pub(super) error: TorqueError,
    pub(super) history: History,
    pub(super) valid_seconds: f64,
    /// nMSE at each of [`SPEEDS`].
    pub(super) by_speed: Vec<f64>,
    pub(super) steps: usize,
    pub(super) seconds: f64,
}

/// One family with all seeds.
pub(super) struct Found {
    pub(super) contestant: &'static Contestant,
    pub(super) runs: Vec<Fitted>,
}

pub(super) fn measure(
    letters: &Letters,
    plan: &Plan,
    folder: &RunFolder,
    course: &mut Course,
) -> Result<Vec<Found>> {
    let motions = letters.chosen(usize::MAX, 0);
    // Nothing is held back: the weights are those of the least training loss.
    let data = Dataset::new(letters.coordinates.clone(), &motions, &motions)?;
    let mut found = Vec::new();
    for contestant in CONTESTANTS {
        let mut runs = Vec::new();
        for &seed in &plan.seeds {
            let (run, model) = one(letters, &data, contestant, (plan, seed), course)?;
            let model = model.save(Provenance::of_seed(seed))?.to_bytes()?;
            folder.write(&format!("{}-{seed}.safetensors", contestant.key), &model)?;
            runs.push(run);
        }
        found.push(Found { contestant, runs });
    }
    Ok(found)
}

fn one(
    letters: &Letters,
    data: &Dataset,
    contestant: &Contestant,
    (plan, seed): (&Plan, u64),
    course: &mut Course,
) -> Result<(Fitted, Learned)> {
    let trained = f64::from(u8::from(contestant.is_trained()));
    let part = format!("{}, seed {seed}", contestant.name);
    course.begin(part.clone(), trained * plan.main)?;
    let settings = config(contestant, plan.main, seed);
    let mse = |model: &Learned| error(model, &letters.test).map_or(f64::NAN, |e| e.mse);
    let (fitted, history) = fit_with_history(data, &settings, course, &mse)?;
    course.check()?;
    let model = &fitted.model;
    let valid_seconds = if model.moves() {
        valid_seconds(model, &letters.test)?
    } else {
        course.begin(format!("{part}, forward"), COMPANION * plan.main)?;
        let mut settings = config(contestant, COMPANION * plan.main, seed);
        settings.loss = Loss::Acceleration;
        let forward = fit(data, &settings, None, course)?.model;
        course.check()?;
        valid_seconds(&forward, &letters.test)?
    };
    let nmse = |speed: &f64| {
        let fast: Vec<Letter> = letters.test.iter().map(|l| l.faster(*speed)).collect();
        error(model, &fast).map_or(f64::NAN, |e| e.nmse)
    };
    let known = error(model, &letters.test);
    let run = Fitted {
        error: known.ok_or_else(|| anyhow::anyhow!("the {} has no torques", contestant.name))?,
        history,
        valid_seconds,
        by_speed: SPEEDS.iter().map(nmse).collect(),
        steps: fitted.steps,
        seconds: fitted.seconds,
    };
    Ok((run, fitted.model))
}

impl Found {
    /// One figure of each seed.
    pub(super) fn each(&self, figure: impl Fn(&Fitted) -> f64) -> Vec<f64> {
        self.runs.iter().map(figure).collect()
    }

    /// Seconds of training to each bound, for each seed.
    pub(super) fn seconds_to(&self, bound: usize) -> Vec<Option<f64>> {
        let seconds = |run: &Fitted| run.history.seconds_to(BOUNDS[bound].1);
        self.runs.iter().map(seconds).collect()
    }

    pub(super) fn json(&self) -> Value {
        let mut all = json!({
            "torque_mse": self.each(|run| run.error.mse),
            "torque_nmse": self.each(|run| run.error.nmse),
            "components": {
                "inertial": self.each(|run| run.error.inertial),
                "coriolis": self.each(|run| run.error.coriolis),
                "gravity": self.each(|run| run.error.gravity),
            },
            "valid_seconds": self.each(|run| run.valid_seconds),
            "steps": self.runs.iter().map(|run| run.steps).collect::<Vec<_>>(),
            "train_seconds": self.each(|run| run.seconds),
            "size": self.contestant.size(),
        });
        for (k, (name, _)) in BOUNDS.iter().enumerate() {
            all[*name] = json!(self.seconds_to(k));
        }
        all
    }
}

/// nMSE over speed, `[seeds][speeds]` for each family.
pub(super) fn extrapolation(all: &[Found]) -> Value {
    let mut figures = json!({ "speed": SPEEDS });
    for found in all {
        let runs: Vec<&Vec<f64>> = found.runs.iter().map(|run| &run.by_speed).collect();
        figures[found.contestant.key] = json!(runs);
    }
    figures
}
