//! Errors of models of machines that break a premise, beside how much they break it.

use anyhow::Result;
use lagrangian::experiment::premises::{Premise, motion_misfit, torque_misfit};
use serde_json::{Value, json};

use super::contestants::{BROKEN, Contestant};
use super::{Course, HELD, Plan, TEST, TEST_SEED, TRAIN, fitted};

/// Length of a short prediction in samples, which is half a second.
const AHEAD: usize = 25;

/// One premise, broken by growing amounts.
pub(super) struct Broken {
    pub(super) premise: Premise,
    pub(super) amounts: Vec<f64>,
    /// Root mean square of what the exact Lagrangian misses, N·m, `[amounts]`.
    pub(super) violation: Vec<f64>,
    pub(super) families: Vec<Errors>,
}

/// Errors of one family on recordings that it has not seen, `[seeds][amounts]`.
pub(super) struct Errors {
    pub(super) contestant: &'static Contestant,
    /// Root mean square of the torque error, N·m.
    pub(super) torque: Vec<Vec<f64>>,
    /// Root mean square of the error of q after half a second; NaN for a network that does not move.
    pub(super) ahead: Vec<Vec<f64>>,
}

pub(super) fn measure(plan: &Plan, course: &mut Course) -> Result<Vec<Broken>> {
    let premise = |premise| one(premise, plan, course);
    Premise::ALL.into_iter().map(premise).collect()
}

/// The same recordings for every family.
fn one(premise: Premise, plan: &Plan, course: &mut Course) -> Result<Broken> {
    let amounts: Vec<f64> = plan.amounts.iter().map(|k| premise.amounts()[*k]).collect();
    // The body on a blade is no chain of links.
    let meets = |c: &&Contestant| !(c.is_chain() && premise == Premise::Rolling);
    let errors = |contestant| Errors {
        contestant,
        torque: vec![Vec::new(); plan.seeds.len()],
        ahead: vec![Vec::new(); plan.seeds.len()],
    };
    let mut families: Vec<Errors> = BROKEN.iter().filter(meets).map(errors).collect();
    let mut violation = Vec::new();
    for &amount in &amounts {
        let test = premise.recordings(amount, TEST, TEST_SEED)?;
        violation.push(premise.violation(&test));
        for (k, &seed) in plan.seeds.iter().enumerate() {
            let recordings = premise.recordings(amount, TRAIN + HELD, seed)?;
            for family in &mut families {
                let contestant = family.contestant;
                let name = format!("{} {amount} {}", premise.name(), premise.unit());
                course.begin(
                    format!("{name}, {}, seed {seed}", contestant.name),
                    if contestant.is_trained() {
                        plan.seconds
                    } else {
                        0.0
                    },
                )?;
                let truth = premise.unbroken();
                let recordings = recordings.clone();
                let model = fitted(contestant, &*truth, recordings, (plan, seed), course)?;
                family.torque[k].push(torque_misfit(&model, &test).unwrap_or(f64::NAN));
                let ahead = motion_misfit(&model, &test, AHEAD)?;
                family.ahead[k].push(ahead.unwrap_or(f64::NAN));
            }
        }
    }
    Ok(Broken {
        premise,
        amounts,
        violation,
        families,
    })
}

pub(super) fn json(all: &[Broken]) -> Value {
    let mut figures = json!({});
    for broken in all {
        let name = broken.premise.name();
        figures[name] = json!({
            "amount": broken.amounts,
            "unit": broken.premise.unit(),
            "violation": broken.violation,
        });
        for errors in &broken.families {
            figures[name][errors.contestant.key] = json!({
                "torque_rms": errors.torque,
                "ahead_rms": errors.ahead,
            });
        }
    }
    figures
}
