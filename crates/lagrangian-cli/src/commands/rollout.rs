//! `lagrangian rollout`: a predicted motion.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::rollout::{self, free};
use lagrangian::score::predict;
use lagrangian::{EstimateOptions, Model, Outcome, Rollout};
use serde_json::json;

use super::Manner;
use crate::cli::RolloutArgs;
use crate::data;
use crate::failure::{Advise, mistake};
use crate::output;

pub(super) fn run(args: &RolloutArgs, manner: Manner) -> Result<ExitCode> {
    let output = &args.output;
    output.refuse_unwritable()?;
    let model = data::model(&args.model)?;
    let rollout = match &args.follow {
        Some(path) => follow(&model, path, args)?,
        None => from_start(&model, args)?,
    };
    note(rollout.outcome);
    let trajectories = std::slice::from_ref(&rollout.trajectory);
    match &output.out {
        Some(path) => {
            let (existing, coordinates) = (output.existing(), model.coordinates());
            output::write_trajectories(path, existing, trajectories, coordinates)?;
        }
        None if manner.json => {}
        None => output::print_trajectories(trajectories)?,
    }
    if manner.json {
        output::print_json(&json!({
            "command": "rollout",
            "model": args.model,
            "out": output.out,
            "samples": rollout.trajectory.len(),
            "outcome": rollout.outcome,
            "steps": rollout.steps,
            "rejected": rollout.rejected,
            "evaluations": rollout.evaluations,
            "singular": rollout.singular,
            "energy": energies(&model, &rollout),
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn from_start(model: &dyn Model, args: &RolloutArgs) -> Result<Rollout> {
    let start = args.motion.start();
    if start.q.is_empty() {
        return Err(mistake(
            "there is no initial state",
            "give one with --q0 and --qd0, or a recording to follow with --follow",
        ));
    }
    let times = rollout::times(args.motion.duration, args.motion.step).advise(
        "cannot roll out",
        "give a shorter --duration or a longer --step",
    )?;
    rollout::rollout(
        model,
        &start.q,
        &start.qd,
        &times,
        &free,
        &args.motion.options(),
    )
    .advise(
        "cannot roll out",
        "give --q0 and --qd0 one value per coordinate of the model",
    )
}

fn follow(model: &dyn Model, path: &Path, args: &RolloutArgs) -> Result<Rollout> {
    let mut recordings = data::read(&[path.into()], &args.data)?;
    data::require_dof(&recordings, model.coordinates())?;
    recordings.truncate(1);
    let options = EstimateOptions {
        accelerations: false,
        ..args.estimate.options()
    };
    let (trajectories, _) = data::trajectories(recordings, &options)?;
    Ok(predict(model, &trajectories[0], &args.motion.options())?)
}

/// H at every sample, J; null for a model that has none.
fn energies(model: &dyn Model, rollout: &Rollout) -> Option<Vec<f64>> {
    let t = &rollout.trajectory;
    let mut energy = vec![0.0; t.len()];
    let outcome = model.evaluator().energy(&t.q, &t.qd, &mut energy);
    outcome.is_supported().then_some(energy)
}

fn note(outcome: Outcome) {
    match outcome {
        Outcome::Finished => {}
        Outcome::Diverged { t, reason } => {
            eprintln!("note: the motion ends at t = {t} s: {reason}")
        }
        Outcome::StepLimit { t } => {
            eprintln!("note: the motion ends at t = {t} s: too many steps; loosen --tolerance")
        }
    }
}
