//! `lagrangian compare`: runs side by side on the same motions, with what else differs between them.

mod motions;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian_report::Command;
use lagrangian_run::compare::{About, Comparison, Row, Run, Runs};
use lagrangian_run::{MODEL, RUN};
use serde_json::{Value, json};

use super::OutputMode;
use crate::command_line::command_line;
use crate::compare_args::CompareArgs;
use crate::motion;
use crate::task::{Size, Task};

pub(super) fn run(args: &CompareArgs, mode: OutputMode) -> Result<ExitCode> {
    let mut inputs = args.data.inputs(&args.on)?;
    for run in &args.runs {
        inputs.push(run.clone());
        inputs.extend([MODEL, RUN].map(|name| run.join(name)));
    }
    args.output.refuse_inputs(&inputs)?;
    args.output.refuse_unwritable_figures()?;
    let runs = Runs::read(&args.runs)?;
    inputs.extend(runs.all().iter().flat_map(files));
    args.output.refuse_inputs(&inputs)?;
    let reading = Task::start("compare: reading", mode.quiet, Size::of_files(&inputs))?;
    let ground = motions::ground(args, &runs)?;
    drop(reading);
    let samples: usize = ground.motions.iter().map(lagrangian::Trajectory::len).sum();
    let task = Task::of_predictions("compare", mode.quiet, samples * runs.all().len())?;
    let (comparison, mut report) = Comparison::of(&runs, &ground, &motion::for_comparison())?;
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
    Ok(ExitCode::SUCCESS)
}

/// The data of a run.
fn files(run: &Run) -> Vec<PathBuf> {
    let files = run.record.iter().flat_map(|record| &record.data);
    files.map(|file| PathBuf::from(&file.path)).collect()
}

fn as_text(comparison: &Comparison) -> String {
    let mut text = format!("{}\non {}\n", comparison.answer, comparison.on);
    for row in &comparison.figures {
        text += &format!("  {}\n", row.label());
        text += &each(comparison, row);
    }
    if !comparison.settings.is_empty() {
        text += "settings that differ\n";
    }
    for setting in &comparison.settings {
        let values = setting.values.iter().zip(&comparison.runs);
        let values = values.map(|(value, run)| {
            let value = value.as_deref().unwrap_or("none");
            format!("{} {value}", run.name)
        });
        let values = values.collect::<Vec<_>>().join(", ");
        text += &format!("  {}: {values}\n", setting.name);
    }
    if !comparison.data.is_empty() {
        text += "data that differ\n";
    }
    for data in &comparison.data {
        let of = data.paths.iter().zip(&comparison.runs);
        let of = of.filter_map(|(path, run)| Some(format!("{} {}", run.name, path.as_ref()?)));
        let hash = data.sha256.get(..12).unwrap_or(&data.sha256);
        let of = of.collect::<Vec<_>>().join(", ");
        text += &format!("  {} {hash}…: {of}\n", data.role);
    }
    text + "verdict\n"
        + &comparison
            .verdict
            .iter()
            .map(|s| format!("  {s}\n"))
            .collect::<String>()
}

/// The values of a figure, a line for each run.
fn each(comparison: &Comparison, row: &Row) -> String {
    let line = |(k, run): (usize, &About)| {
        let value = row.values[k].map_or("–".into(), |value| row.shown(value));
        let difference = row.differences[k].as_ref().map(|own| {
            let finding = row.word(own);
            format!("   {}: {finding}", row.difference(own))
        });
        format!(
            "    {:<24} {value:>12}{}\n",
            run.name,
            difference.unwrap_or_default()
        )
    };
    comparison.runs.iter().enumerate().map(line).collect()
}
