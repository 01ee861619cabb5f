//! The claims that would falsify the method: which laws of mechanics each family obeys on motions that it has not seen, and
//! how much is left of the advantage of a Lagrangian as a machine breaks what it assumes.

mod broken;
mod contestants;
mod obeyed;
mod page;

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian::dataset::Dataset;
use lagrangian::dynamics::Model;
use lagrangian::train::{Budget, FitConfig, Learned, fit};
use serde_json::json;

use super::{Course, Experiment, Findings, Setting};

use contestants::{BROKEN, Contestant, OBEYED};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "plausibility",
    about: "laws of mechanics that each family obeys, and what broken premises cost",
    parts: None,
    run,
};

/// Recordings to learn from, to choose weights by, and to judge by.
const TRAIN: usize = 13;
const HELD: usize = 3;
const TEST: usize = 6;

/// Seed of the recordings that all are judged by.
const TEST_SEED: u64 = 1_000_003;

/// How long, how often.
struct Plan {
    seeds: Vec<u64>,
    /// Time of a fit, s.
    seconds: f64,
    /// Amounts of each broken premise, by their places.
    amounts: Vec<usize>,
}

impl Plan {
    fn of(setting: &Setting) -> Self {
        let quick = setting.args.quick;
        let seconds = if quick { 0.15 } else { 3.0 };
        Self {
            seeds: setting.seeds(),
            seconds: setting.args.seconds.unwrap_or(seconds),
            amounts: if quick { vec![0, 2] } else { vec![0, 1, 2, 3] },
        }
    }

    fn whole(&self) -> f64 {
        let trained = |all: &[Contestant]| all.iter().filter(|c| c.is_trained()).count();
        let fits = trained(OBEYED) * obeyed::SYSTEMS.len()
            + trained(BROKEN)
                * self.amounts.len()
                * lagrangian::experiment::premises::Premise::ALL.len();
        (self.seeds.len() * fits) as f64 * self.seconds
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan::of(setting);
    course.plan(plan.whole());
    let obeyed = obeyed::measure(&plan, course)?;
    let broken = broken::measure(&plan, course)?;
    Ok(Findings {
        figures: json!({
            "laws": obeyed::json(&obeyed),
            "premises": broken::json(&broken),
            "fit_seconds": plan.seconds,
        }),
        summary: page::summary(&obeyed, &broken),
        report: page::report(&plan, &obeyed, &broken),
    })
}

/// One fit to recordings, of which the last are held back.
fn fitted(
    contestant: &Contestant,
    truth: &dyn Model,
    mut recordings: Vec<Trajectory>,
    (plan, seed): (&Plan, u64),
    course: &mut Course,
) -> Result<Learned> {
    let held = recordings.split_off(TRAIN);
    let data = Dataset::new(truth.coordinates().clone(), &recordings, &held)?;
    let config = FitConfig {
        family: (contestant.family)(),
        loss: contestant.loss,
        forces: contestant.forces,
        budget: Budget::Seconds(plan.seconds),
        seed,
        validate_every: 10,
        ..FitConfig::default()
    };
    let model = fit(&data, &config, None, course)?.model;
    course.check()?;
    Ok(model)
}
