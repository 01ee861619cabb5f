//! The laws that models of unbroken machines obey.

use anyhow::Result;
use lagrangian::State;
use lagrangian::dynamics::Model;
use lagrangian::experiment::premises::{Premise, driven};
use lagrangian::experiment::{Laws, laws};
use lagrangian::lagrangian::analytic::by_name;
use serde_json::{Value, json};

use super::contestants::{Contestant, OBEYED};
use super::{Course, HELD, Plan, TEST, TEST_SEED, TRAIN, fitted};

/// The machines.
pub(super) const SYSTEMS: [&str; 3] = ["pendulum", "double-pendulum", "arm"];

/// Starts of the free motions.
const STARTS: usize = 8;

/// One machine: the truth's own figures, and those of each family, `[seeds]`.
pub(super) struct System {
    pub(super) name: &'static str,
    pub(super) truth: Laws,
    pub(super) families: Vec<(&'static Contestant, Vec<Laws>)>,
}

fn truth(name: &str) -> Result<Box<dyn Model>> {
    Ok(match name {
        "arm" => Premise::Friction.unbroken(),
        name => by_name(name, &[])?,
    })
}

pub(super) fn measure(plan: &Plan, course: &mut Course) -> Result<Vec<System>> {
    let system = |name| one(name, plan, course);
    SYSTEMS.into_iter().map(system).collect()
}

fn one(name: &'static str, plan: &Plan, course: &mut Course) -> Result<System> {
    let truth = truth(name)?;
    let test = driven(&*truth, TEST, TEST_SEED)?;
    let n = truth.coordinates().dof();
    // At rest where other motions begin, so that the energy is one that was seen.
    let starts: Vec<State> = driven(&*truth, STARTS, TEST_SEED + 1)?
        .iter()
        .map(|motion| State::new(motion.q[..n].to_vec(), vec![0.0; n]))
        .collect();
    let mut families = Vec::new();
    for contestant in OBEYED {
        let mut runs = Vec::new();
        for &seed in &plan.seeds {
            let weight = if contestant.is_trained() {
                plan.seconds
            } else {
                0.0
            };
            course.begin(format!("{name}, {}, seed {seed}", contestant.name), weight)?;
            let recordings = driven(&*truth, TRAIN + HELD, seed)?;
            let model = fitted(contestant, &*truth, recordings, (plan, seed), course)?;
            runs.push(laws(&model, &*truth, &test, &starts)?);
        }
        families.push((contestant, runs));
    }
    Ok(System {
        name,
        truth: laws(&*truth, &*truth, &test, &starts)?,
        families,
    })
}

pub(super) fn json(systems: &[System]) -> Value {
    let mut all = json!({});
    for system in systems {
        all[system.name]["truth"] = json!(system.truth);
        for (contestant, runs) in &system.families {
            all[system.name][contestant.key] = json!(runs);
        }
    }
    all
}
