//! `lagrangian rollout`: a predicted motion.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::rollout::{self, free};
use lagrangian::score::{outside, predict};
use lagrangian::{Coordinates, EstimateOptions, Layout, Learned, Model, Rollout, State};
use serde_json::json;

use super::OutputMode;
use crate::cli::{DataArgs, RolloutArgs};
use crate::data;
use crate::failure::{Context, SUCCESS, mistake};
use crate::fitted;
use crate::motion;
use crate::output::{self, Motions};
use crate::task::{Size, Task};

pub(super) fn run(args: &RolloutArgs, mode: OutputMode) -> Result<u8> {
    let output = &args.output;
    args.motion.refuse_idle()?;
    // Checked here, and not in the parser, which requires no --follow beside --q0 if one excludes the other.
    if args.follow.is_some() && !args.motion.q0.is_empty() {
        return Err(mistake(
            "--follow cannot be used with --q0: both say where the motion starts",
            "omit --q0 and --qd0, or --follow",
        ));
    }
    let followed: Vec<PathBuf> = args.follow.iter().cloned().collect();
    let recorded = &args.recorded;
    let mut inputs = recorded.data.inputs(&followed)?;
    inputs.push(args.model.clone());
    output.check_motions(&inputs)?;
    let samples = args.motion.duration / args.motion.step;
    let size = Size::of_files(&inputs).with_samples(samples);
    let task = Task::start("rollout", mode.quiet, size)?;
    let fitted = fitted::fitted(&args.model)?;
    let (data, estimate) = match &args.follow {
        Some(_) => fitted.complete(recorded)?,
        None => (
            fitted.completed(&recorded.data)?,
            recorded.estimate.options(),
        ),
    };
    let layout = data.layout_of(args.follow.as_deref())?;
    let rollout = match &args.follow {
        Some(path) => follow(&fitted.model, path, (&data, estimate), args)?,
        None => from_start(&fitted.model, &layout, args)?,
    };
    drop(task);
    let model = fitted.model;
    motion::note_early_end("the motion", rollout.outcome);
    let trajectories = std::slice::from_ref(&rollout.trajectory);
    motion::note_outside(&model, trajectories);
    let motions = Motions::in_columns(trajectories, model.coordinates(), &layout);
    output.write_motions(mode, &motions)?;
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
            "outside": outside(&model, trajectories),
            "energy": lagrangian_run::energies(&model, &rollout.trajectory),
        }))?;
    }
    Ok(SUCCESS)
}

fn from_start(model: &dyn Model, layout: &Layout, args: &RolloutArgs) -> Result<Rollout> {
    if model.driven().is_some() {
        return Err(mistake(
            "the model moves by the goals of its drives",
            "give a recording with goals with --follow",
        ));
    }
    let start = in_si_units(args.motion.start(), model.coordinates(), layout);
    if start.q.is_empty() {
        return Err(mistake(
            "there is no initial state",
            "give one with --q0 and --qd0, or a recording to follow with --follow",
        ));
    }
    let shown = "cannot roll out";
    let times = rollout::times(args.motion.duration, args.motion.step)
        .context(shown, "give a shorter --duration or a longer --step")?;
    let options = args.motion.options();
    let motion = rollout::rollout(model, &start.q, &start.qd, &times, &free, &options);
    Ok(motion.context(
        shown,
        "give --q0 and --qd0 one value per coordinate of the model",
    )?)
}

/// The SI units of a state that was given in the units of the data.
fn in_si_units(mut start: State, coordinates: &Coordinates, layout: &Layout) -> State {
    if layout.degrees {
        let values = start.q.iter_mut().enumerate();
        for (i, value) in values.chain(start.qd.iter_mut().enumerate()) {
            if i < coordinates.dof() && coordinates.is_circle(i) {
                *value = value.to_radians();
            }
        }
        note!("note: angles are in degrees");
    }
    start
}

fn follow(
    model: &Learned,
    path: &Path,
    (data, estimate): (&DataArgs, EstimateOptions),
    args: &RolloutArgs,
) -> Result<Rollout> {
    let mut recordings = data::read(&[path.into()], data)?;
    fitted::require_coordinates(&recordings, model.coordinates())?;
    if recordings.len() > 1 {
        let (path, count) = (path.display(), recordings.len());
        note!("note: '{path}' holds {count} motions: the first one is followed");
        recordings.truncate(1);
    }
    let options = EstimateOptions {
        accelerations: false,
        ..estimate
    };
    let (trajectories, _) = data::trajectories(recordings, &options)?;
    Ok(predict(model, &trajectories[0], &args.motion.options())?)
}
