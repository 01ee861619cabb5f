//! `lagrangian rollout`: a predicted motion.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::rollout::{self, free};
use lagrangian::score::predict;
use lagrangian::{EstimateOptions, Model, Rollout};
use serde_json::json;

use super::OutputMode;
use crate::cli::RolloutArgs;
use crate::data::{self, Fitted};
use crate::failure::{Advise, mistake};
use crate::motion;
use crate::output;
use crate::task::Task;

pub(super) fn run(args: &RolloutArgs, mode: OutputMode) -> Result<ExitCode> {
    let output = &args.output;
    let followed: Vec<PathBuf> = args.follow.iter().cloned().collect();
    let mut inputs = args.data.inputs(&followed)?;
    inputs.push(args.model.clone());
    output.refuse_inputs_of_motions(&inputs)?;
    output.refuse_unwritable()?;
    let task = Task::start("rollout", mode.quiet);
    let fitted = data::fitted(&args.model)?;
    let rollout = match &args.follow {
        Some(path) => follow(&fitted, path, args)?,
        None => from_start(&fitted.model, args)?,
    };
    drop(task);
    let model = fitted.model;
    motion::note_early_end("the motion", rollout.outcome);
    let trajectories = std::slice::from_ref(&rollout.trajectory);
    match &output.out {
        Some(path) => {
            let (existing, coordinates) = (output.existing(), model.coordinates());
            output::write_trajectories(path, existing, trajectories, coordinates)?;
        }
        None if mode.json => {}
        None => output::print_trajectories(trajectories)?,
    }
    if mode.json {
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
            "energy": motion::energies(&model, &rollout.trajectory),
        }))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn from_start(model: &dyn Model, args: &RolloutArgs) -> Result<Rollout> {
    if model.driven().is_some() {
        return Err(mistake(
            "the model moves by the goals of its drives",
            "give a recording with goals with --follow",
        ));
    }
    let start = args.motion.start();
    if start.q.is_empty() {
        return Err(mistake(
            "there is no initial state",
            "give one with --q0 and --qd0, or a recording to follow with --follow",
        ));
    }
    let shown = "cannot roll out";
    let times = rollout::times(args.motion.duration, args.motion.step)
        .advise(shown, "give a shorter --duration or a longer --step")?;
    let options = args.motion.options();
    rollout::rollout(model, &start.q, &start.qd, &times, &free, &options).advise(
        shown,
        "give --q0 and --qd0 one value per coordinate of the model",
    )
}

fn follow(fitted: &Fitted, path: &Path, args: &RolloutArgs) -> Result<Rollout> {
    let (data, estimate) = fitted.complete(&args.data, &args.estimate)?;
    let model = &fitted.model;
    let mut recordings = data::read(&[path.into()], &data)?;
    data::require_dof(&recordings, model.coordinates())?;
    recordings.truncate(1);
    let options = EstimateOptions {
        accelerations: false,
        ..estimate.options()
    };
    let (trajectories, _) = data::trajectories(recordings, &options)?;
    Ok(predict(model, &trajectories[0], &args.motion.options())?)
}
