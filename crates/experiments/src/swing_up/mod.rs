//! Pendulums that are swung up through a learned energy, against the true one.

mod attempts;
mod config;
mod controller;
mod lqr;
#[cfg(test)]
mod tests;

use anyhow::Result;
use lagrangian::TrainingTask;
use lagrangian::{DelanConfig, FitConfig, Loss, Model};
use lagrangian_report::{Axis, Role};

use crate::harness::spread::median;
use crate::harness::{Contestant, Experiment, Lab, Row, contestant, less, more};
use attempts::{Attempt, attempts, excitation, machine};
use config::Machine;

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "swing-up",
    about: "pendulum, cart-pole and Furuta pendulum, swung up through a learned energy",
    run,
    title: "Swing-up through a learned energy",
    text: &[
        "Energy shaping with collocated partial feedback linearisation, then a linear-quadratic regulator: both take all \
         that they know of the machine from the model, the regulator's gains too. The model is learned from minutes of \
         random motion.",
    ],
    quantities: &[
        more("success", "success rate", ""),
        less("up_since", "median time until upright", "s"),
        less("validation_loss", "validation loss", ""),
    ],
    about_quantities: "A swing-up succeeds where the pendulum is upright within 20 s and held for at least 2 s. The loss \
                       is the squared torque error in units of its variance.",
    ..Experiment::EMPTY
};

const TRUTH: Contestant = contestant("truth", "true model", Role::Truth, ());

const LEARNED: Contestant = contestant("learned", "deep Lagrangian network", Role::Lnn, ());

/// The starts are the same for all models and seeds.
const START_SEED: u64 = 5;

fn run(lab: &mut Lab) -> Result<()> {
    lab.plan(Machine::ALL.len() * lab.seeds().len());
    let (starts, seconds) = if lab.quick() { (5, 60.0) } else { (30, 180.0) };
    lab.setting("Starts", starts.to_string());
    lab.setting("Data of a fit", format!("{seconds} s at 100 Hz"));
    for kind in Machine::ALL {
        let system = machine(kind)?;
        let truth: &dyn Model = &*system;
        let runs = attempts(kind, truth, starts, START_SEED)?;
        record(lab.row(kind.system(), &TRUTH), &runs);
        draw(lab, kind, &TRUTH, &runs);
        for seed in lab.seeds() {
            lab.begin(format!("{}, seed {seed}", kind.system()))?;
            let config = FitConfig {
                family: Box::new(DelanConfig::default()),
                training: TrainingTask {
                    loss: Loss::TORQUE,
                    budget: lab.budget(300, 100),
                    batch: 128,
                    seed,
                    ..TrainingTask::default()
                },
            };
            let fitted = lab.fit(&excitation(kind, seconds, seed)?, &config)?;
            // A model whose top is not a top has no controller: none of its swing-ups succeeds.
            let runs = attempts(kind, &fitted.model, starts, START_SEED).unwrap_or_default();
            let row = lab.row(kind.system(), &LEARNED);
            row.add("validation_loss", fitted.best);
            record(row, &runs);
            draw(lab, kind, &LEARNED, &runs);
        }
    }
    Ok(())
}

fn record(row: &mut Row, runs: &[Attempt]) {
    let times: Vec<f64> = runs.iter().filter_map(|a| a.up_since).collect();
    let success = times.len() as f64 / runs.len().max(1) as f64;
    let each: Vec<_> = runs.iter().map(|a| a.up_since).collect();
    row.add("success", success)
        .add("up_since", median(&times))
        .detail("up_since_each", each);
}

/// The pendulum's angle in the first attempt.
fn draw(lab: &mut Lab, kind: Machine, who: &Contestant, runs: &[Attempt]) {
    let Some(attempt) = runs.first() else { return };
    let (pendulum, n) = (kind.config().pendulum, attempt.motion.dof());
    let rows = attempt.motion.q.chunks_exact(n).step_by(10);
    let t: Vec<f64> = attempt.motion.t.iter().step_by(10).copied().collect();
    let caption = "From the first start; π is up, and so is π after whole turns (9.42, −3.14 …).";
    lab.plot(
        format!("angle-{}", kind.system()),
        format!("Angle of the {}", kind.system()),
    )
    .caption(caption)
    .x(Axis::linear("time", "s"))
    .y(Axis::linear("angle from hanging down", "rad"))
    .add(who.name, who.role, &t, rows.map(|q| q[pendulum]).collect());
}
