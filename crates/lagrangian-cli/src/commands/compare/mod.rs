//! `lagrangian compare`: runs side by side on the same motions, with the other differences between them.

mod motions;

use std::path::PathBuf;

use anyhow::Result;
use lagrangian_run::compare::{Comparison, LoadedRun};
use lagrangian_run::{MODEL, RUN};
use serde_json::{Value, json};

use super::OutputMode;
use crate::compare_args::CompareArgs;
use crate::failure::SUCCESS;
use crate::motion;
use crate::task::{Size, Task};
use crate::text;

pub(super) fn run(args: &CompareArgs, mode: OutputMode) -> Result<u8> {
    let mut inputs = args.recorded.data.inputs(&args.on)?;
    for run in &args.runs {
        inputs.push(run.clone());
        inputs.extend([MODEL, RUN].map(|name| run.join(name)));
    }
    args.output.check(&inputs)?;
    let runs = LoadedRun::read_all(&args.runs)?;
    inputs.extend(runs.iter().flat_map(files));
    args.output.check(&inputs)?;
    let reading = Task::start("compare: reading", mode.quiet, Size::of_files(&inputs))?;
    let on = motions::comparison_data(args, &runs)?;
    drop(reading);
    let samples: usize = on.motions.iter().map(lagrangian::Trajectory::len).sum();
    let task = Task::of_predictions("compare", mode.quiet, samples * runs.len())?;
    let (comparison, report) = Comparison::of(&runs, &on, &motion::for_comparison())?;
    drop(task);
    args.output.draw(|| report.clone())?;
    let mut figures = json!({ "command": "compare", "plot": args.output.plot });
    if let (Value::Object(all), Value::Object(own)) = (&mut figures, json!(comparison)) {
        all.extend(own);
    }
    (args.output.file).write_figures(mode, &figures, || text::of(&report))?;
    Ok(SUCCESS)
}

/// The data of a run.
fn files(run: &LoadedRun) -> Vec<PathBuf> {
    let files = run.record.iter().flat_map(|record| &record.data);
    files.map(|file| PathBuf::from(&file.path)).collect()
}
