//! Two real machines: torques, accelerations and predictions of motions that were kept from training, for learned
//! Lagrangians with friction, plain networks and identified rigid bodies.

mod contestants;
mod machines;

use anyhow::Result;
use lagrangian::TrainingTask;
use lagrangian::{FitConfig, Learned, RolloutOptions, Score, Trajectory, score};

use crate::harness::failure::Context;
use crate::harness::{Contestant, Experiment, Lab, less, more};
use contestants::{CONTESTANTS, Candidate, Recipe};
pub(crate) use machines::double_pendulum;
use machines::{MACHINES, Machine, Recordings};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "real",
    about: "a real pendulum and a real double pendulum: torques, accelerations, predictions",
    run,
    title: "Two real machines",
    text: &[
        "A torque loss is attenuated where a machine swings nearly freely: its torque is a small difference of inertia and \
         gravity, both computed from noisy accelerations, and least squares shrinks the two together. A loss of \
         accelerations has the noise where it averages out.",
        "Each model's validation samples choose among its candidates by the error of their accelerations (of torques for a \
         model without any), for each seed. Deep Lagrangian networks of 2 × 16 with viscous and Coulomb friction and rotor \
         inertias; black-box Lagrangians in the convex form, 2 × 16, with friction; plain networks of 2 × 32; Adam, batches \
         of 512.",
        "Data: torque_limited_simple_pendulum and double_pendulum of the DFKI underactuated lab (BSD-3).",
    ],
    quantities: &[
        less("torque_nmse_1", "torque nMSE, joint 1", ""),
        less("torque_nmse_2", "joint 2", ""),
        less("acceleration_nmse_1", "acceleration nMSE, joint 1", ""),
        less("acceleration_nmse_2", "joint 2", ""),
        more("followed_seconds", "followed for", "s"),
        less("q_rms_1", "q after 0.5 s, joint 1", "rad"),
        less("q_rms_2", "joint 2", "rad"),
    ],
    about_quantities: "Logs that were kept from training. Errors over the variance of the signal (1: no better than its \
                       mean; a constant torque has none).",
    ..Experiment::EMPTY
};

/// Names of the quantities of each joint.
const JOINTS: [[&str; 3]; 2] = [
    ["torque_nmse_1", "acceleration_nmse_1", "q_rms_1"],
    ["torque_nmse_2", "acceleration_nmse_2", "q_rms_2"],
];

fn run(lab: &mut Lab) -> Result<()> {
    let fits: usize = CONTESTANTS
        .iter()
        .map(|who| who.config.candidates.len())
        .sum();
    lab.plan(fits * MACHINES.len() * lab.seeds().len());
    for machine in MACHINES {
        let about = format!(
            "{}, after a low-pass of {} Hz.",
            machine.about, machine.low_pass
        );
        lab.results.text.push(about);
        let recordings = machine.read(lab)?;
        for who in CONTESTANTS {
            for seed in lab.seeds() {
                compete(lab, machine, &recordings, who, seed)?;
            }
        }
    }
    Ok(())
}

/// Fits all candidates of a contestant and measures that with the least error on the validation samples.
fn compete(
    lab: &mut Lab,
    machine: &Machine,
    recordings: &Recordings,
    who: &Contestant<Recipe>,
    seed: u64,
) -> Result<()> {
    let recipe = &who.config;
    let mut best: Option<(f64, &Candidate, Learned)> = None;
    for candidate in recipe.candidates {
        let part = format!("{}, {}, {}", machine.name, who.name, candidate.name);
        lab.begin(part)?;
        let config = FitConfig {
            family: (recipe.family)(recipe.width),
            training: TrainingTask {
                loss: candidate.loss,
                forces: (recipe.forces)(),
                optimizer: candidate.optimizer(),
                budget: lab.budget(3000, 200),
                batch: 512,
                seed,
                ..TrainingTask::default()
            },
        };
        let model = lab.fit(&recordings.dataset, &config)?.model;
        let error = validation_error(&model, &recordings.validation);
        if best.as_ref().is_none_or(|(least, ..)| error < *least) {
            best = Some((error, candidate, model));
        }
    }
    let Some((_, candidate, model)) = best else {
        return Ok(());
    };
    for log in &recordings.test {
        let duration = log.t[log.len() - 1] - log.t[0];
        let group = format!("{}: {}, {duration:.1} s", machine.name, log.name);
        let score = scored(&model, std::slice::from_ref(log))?;
        let row = lab.row(&group, who);
        let followed = score.rollouts.first().map(|r| r.valid_seconds);
        row.detail("chosen", candidate.name)
            .add("followed_seconds", followed);
        let signals = [
            score.torque.as_ref().map(|e| &e.nmse),
            score.acceleration.as_ref().map(|e| &e.nmse),
            score.restarts.first().map(|r| &r.q_rms_end),
        ];
        for (joint, names) in JOINTS.iter().enumerate().take(log.dof()) {
            for (name, signal) in names.iter().zip(&signals) {
                row.add(name, signal.and_then(|x| x.get(joint).copied()));
            }
        }
    }
    Ok(())
}

fn scored(model: &Learned, trajectories: &[Trajectory]) -> Result<Score> {
    let options = RolloutOptions {
        rtol: 1e-6,
        atol: 1e-6,
        ..RolloutOptions::default()
    };
    score(model, trajectories, &options)
        .context("cannot measure a fit", "please report this with the data")
}

/// What a candidate is chosen by: the error of the accelerations of the validation samples, for a model without any
/// that of the torques. Accelerations, because a machine that swings freely has torques near 0 whatever its scale.
fn validation_error(model: &Learned, validation: &[Trajectory]) -> f64 {
    let mean = |error: &[f64]| error.iter().sum::<f64>() / error.len() as f64;
    let score = scored(model, validation).ok();
    let error = score.and_then(|score| score.acceleration.or(score.torque));
    error.map_or(f64::INFINITY, |e| mean(&e.nmse))
}
