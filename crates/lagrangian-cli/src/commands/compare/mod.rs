//! `lagrangian compare`: runs side by side on the same motions, with the other differences between them.

mod motions;

use std::path::PathBuf;

use anyhow::Result;
use lagrangian_report::Command;
use lagrangian_run::compare::{Comparison, LoadedRun, Row, RunSummary};
use lagrangian_run::{MODEL, RUN, brief_hash};
use serde_json::{Value, json};

use super::OutputMode;
use crate::command_line::command_line;
use crate::compare_args::CompareArgs;
use crate::failure::SUCCESS;
use crate::motion;
use crate::task::{Size, Task};

pub(super) fn run(args: &CompareArgs, mode: OutputMode) -> Result<u8> {
    let mut inputs = args.data.inputs(&args.on)?;
    for run in &args.runs {
        inputs.push(run.clone());
        inputs.extend([MODEL, RUN].map(|name| run.join(name)));
    }
    args.output.refuse_inputs(&inputs)?;
    args.output.refuse_unwritable_figures()?;
    let runs = LoadedRun::read_all(&args.runs)?;
    inputs.extend(runs.iter().flat_map(files));
    args.output.refuse_inputs(&inputs)?;
    let reading = Task::start("compare: reading", mode.quiet, Size::of_files(&inputs))?;
    let on = motions::comparison_data(args, &runs)?;
    drop(reading);
    let samples: usize = on.motions.iter().map(lagrangian::Trajectory::len).sum();
    let task = Task::of_predictions("compare", mode.quiet, samples * runs.len())?;
    let (comparison, mut report) = Comparison::of(&runs, &on, &motion::for_comparison())?;
    drop(task);
    args.output.draw(|| {
        report.commands = vec![Command::new("This page", command_line())];
        report
    })?;
    let mut figures = json!({ "command": "compare", "plot": args.output.plot });
    if let (Value::Object(all), Value::Object(own)) = (&mut figures, json!(comparison)) {
        all.extend(own);
    }
    (args.output.file).write_figures(mode, &figures, || as_text(&comparison))?;
    Ok(SUCCESS)
}

/// The data of a run.
fn files(run: &LoadedRun) -> Vec<PathBuf> {
    let files = run.record.iter().flat_map(|record| &record.data);
    files.map(|file| PathBuf::from(&file.path)).collect()
}

fn as_text(comparison: &Comparison) -> String {
    let mut text = format!("{}\non {}\n", comparison.answer, comparison.on);
    for row in &comparison.figures {
        text += &format!("  {}\n", row.label());
        text += &each(comparison, row);
    }
    // The values of the runs that have one, or `absent` for the others.
    let values = |values: &[Option<String>], absent: Option<&str>| {
        let pairs = comparison.runs.iter().zip(values);
        let known =
            pairs.filter_map(|(run, value)| Some((&run.name, value.as_deref().or(absent)?)));
        let words = known.map(|(name, value)| format!("{name} {value}"));
        words.collect::<Vec<_>>().join(", ")
    };
    let settings = comparison.settings.iter();
    let settings =
        settings.map(|own| format!("{}: {}", own.name, values(&own.values, Some("none"))));
    let data = comparison.data.iter().map(|own| {
        let hash = brief_hash(&own.sha256);
        format!("{} {hash}: {}", own.role, values(&own.paths, None))
    });
    for (heading, lines) in [
        ("settings that differ", settings.collect()),
        ("data that differ", data.collect()),
        ("verdict", comparison.verdict.clone()),
    ] {
        let lines: Vec<String> = lines;
        if !lines.is_empty() {
            text += &format!("{heading}\n  {}\n", lines.join("\n  "));
        }
    }
    text
}

/// The values of a figure, a line for each run.
fn each(comparison: &Comparison, row: &Row) -> String {
    let line = |(k, run): (usize, &RunSummary)| {
        let difference = row.difference(k);
        let difference = difference.map(|[own, finding]| format!("   {own}: {finding}"));
        let difference = difference.unwrap_or_default();
        format!("    {:<24} {:>12}{difference}\n", run.name, row.shown(k))
    };
    comparison.runs.iter().enumerate().map(line).collect()
}
