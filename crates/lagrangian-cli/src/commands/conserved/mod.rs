//! `lagrangian conserved`: energy, momenta and Noether's charges of a model, and their drift.

mod page;

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{Coordinates, RolloutOptions, Trajectory};
use lagrangian_analysis::conserved::{
    ConservedOptions, Quantity, candidates, conserved, points_by_name,
};
use lagrangian_report::Report;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::json;

use super::OutputMode;
use crate::cli::RecordedArgs;
use crate::data;
use crate::failure::{Context, SUCCESS, mistake};
use crate::fitted;
use crate::law_args::ConservedArgs;
use crate::subject::{Subject, coordinate};
use crate::task::{Size, Task};
use crate::text;

/// The number of motions of a system that is rolled out, and of their samples in a second.
const MOTIONS: usize = 20;
const RATE: f64 = 50.0;

pub(super) fn run(args: &ConservedArgs, mode: OutputMode) -> Result<u8> {
    let recorded = &args.recorded;
    let mut inputs = recorded.data.inputs(&args.files)?;
    inputs.push(PathBuf::from(&args.subject.subject));
    args.output.check(&inputs)?;
    let samples = MOTIONS as f64 * RATE * args.duration;
    let size = Size::of_files(&inputs).with_samples(samples);
    let task = Task::start("conserved", mode.quiet, size)?;
    let subject = args.subject.open()?;
    let coordinates = subject.coordinates()?;
    let points = points(args, coordinates)?;
    let symmetries = candidates(coordinates, &points).context(
        "cannot turn these points",
        "correct --points, e.g. --points x1:y1,x2:y2",
    )?;
    let motions = motions(args, &subject)?;
    let options = ConservedOptions {
        tolerance: args.tolerance,
        rollouts: args.rollouts,
    };
    let found = conserved(&subject.physics()?, &symmetries, &motions, &options).context(
        "cannot measure what is conserved",
        "`lagrangian check` shows what is wrong with the data",
    )?;
    drop(task);
    let facts = page::facts(args, &found);
    args.output.draw(|| Report {
        figures: page::figures(&found),
        ..facts.clone()
    })?;
    let judgements: Vec<_> = found.quantities.iter().map(Quantity::judgement).collect();
    let figures = json!({
        "command": "conserved",
        "answer": facts.answer,
        "subject": args.subject.subject,
        "files": args.files,
        "motions": motions.len(),
        "tolerance": args.tolerance,
        "conserved": found,
        "judgements": judgements,
        "plot": args.output.plot,
    });
    let text = || text::of(&facts);
    args.output.file.write_figures(mode, &figures, text)?;
    Ok(SUCCESS)
}

fn points(args: &ConservedArgs, coordinates: &Coordinates) -> Result<Vec<Vec<usize>>> {
    match args.points.is_empty() {
        true => Ok(points_by_name(coordinates)),
        false => named_points(&args.points, coordinates),
    }
}

/// Points as their coordinates, `x1:y1`.
pub(super) fn named_points(
    points: &[String],
    coordinates: &Coordinates,
) -> Result<Vec<Vec<usize>>> {
    let point = |text: &String| {
        let names = text.split(':');
        names.map(|name| coordinate(coordinates, name)).collect()
    };
    points.iter().map(point).collect()
}

fn motions(args: &ConservedArgs, subject: &Subject) -> Result<Vec<Trajectory>> {
    if !args.files.is_empty() {
        let RecordedArgs { data, estimate } = &args.recorded;
        let recordings = data::read(&args.files, data)?;
        fitted::require_dof(&recordings, subject.coordinates()?)?;
        return Ok(data::trajectories(recordings, &estimate.options())?.0);
    }
    let Subject::System(system) = subject else {
        return Err(mistake(
            "a model needs motions to be measured along",
            "give recordings after the model, e.g. those that it was not fitted on",
        ));
    };
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let starts = (0..MOTIONS).map(|_| system.sample_state(&mut rng));
    let starts: Vec<_> = starts.collect();
    let shown = "cannot roll the system out";
    let times = times(args.duration, 1.0 / RATE).context(shown, "give a shorter --duration")?;
    let options = RolloutOptions::default();
    let rolled = rollout_many(&**system, &starts, &times, &free, &options)
        .context(shown, "give other parameters with --set")?;
    Ok(rolled.into_iter().map(|r| r.trajectory).collect())
}
