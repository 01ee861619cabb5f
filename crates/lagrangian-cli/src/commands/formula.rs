//! `lagrangian formula`: the law of a motion in closed form, found in recordings, or that of a saved model.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::models::{Parameter, WrittenLaw};
use lagrangian::{FitSpec, Layout, Learned, PrepareOptions, distil};
use lagrangian_report::{Report, Table};
use lagrangian_run::{Data, MODEL, PreparedFit};
use serde_json::{Value, json};

use super::OutputMode;
use crate::data;
use crate::failure::{self, FAILED, SUCCESS, mistake};
use crate::fitted;
use crate::frontend::ProgressDisplay;
use crate::interrupt;
use crate::law_args::FormulaArgs;
use crate::task::{Size, Task};
use crate::text;

/// The family whose models are formulas.
const FAMILY: &str = "formula";

pub(super) fn run(args: &FormulaArgs, mode: OutputMode) -> Result<u8> {
    let (model, distilled) = match saved(&args.files) {
        Some(path) => of_model(path, args, mode)?,
        None => (found(args, mode)?, None),
    };
    let written = model.written().ok_or_else(|| {
        mistake(
            format!("a model of the family {} is no formula", model.family()),
            "give the recordings that it was fitted to instead: `lagrangian formula motion.csv`",
        )
    })?;
    let parameters = model.parameters();
    let figures = json!({
        "command": "formula",
        "files": args.files,
        "law": written,
        "parameters": parameters,
        "distilled": distilled,
    });
    mode.print(&figures, || shown(&written, &parameters, args.latex))?;
    Ok(if written.verdict == "none" {
        FAILED
    } else {
        SUCCESS
    })
}

/// The saved model that is named, or that of a run.
fn saved(files: &[PathBuf]) -> Option<&Path> {
    let [path] = files else { return None };
    let is_model = path.extension().is_some_and(|own| own == "safetensors");
    (is_model || path.join(MODEL).is_file()).then_some(path)
}

/// The formula that a model is, or that which its motions obey, with the noise that hides what it says differently.
fn of_model(path: &Path, args: &FormulaArgs, mode: OutputMode) -> Result<(Learned, Option<Value>)> {
    let model = fitted::model(path)?;
    if model.written().is_some() {
        return Ok((model, None));
    }
    interrupt::listen()?;
    let mut display = ProgressDisplay::start("formula", mode.quiet);
    let found = distil(&model, args.seed, &mut display);
    display.finish(if found.is_ok() { "done" } else { "failed" });
    let found = found.map_err(failure::of_data)?;
    note!(
        "note: found in motions of this model (family {}), with white noise of {} % of their deviation",
        model.family(),
        100.0 * found.noise
    );
    let facts = json!({ "family": model.family(), "noise": found.noise });
    Ok((found.model, Some(facts)))
}

/// The formula that is found in recordings.
fn found(args: &FormulaArgs, mode: OutputMode) -> Result<Learned> {
    interrupt::listen()?;
    let recorded = &args.recorded;
    let inputs = recorded.data.inputs(&args.files)?;
    let task = Task::start(
        "formula: preparing the data",
        mode.quiet,
        Size::of_files(&inputs),
    )?;
    let own = data::read_sample(&args.files, &recorded.data, None)?;
    let layout = match args.files.first() {
        Some(path) => recorded.data.layout_for(path)?,
        None => Layout::default(),
    };
    let data = Data {
        training: own.recordings,
        layout: Layout { every: 0, ..layout }.to_toml()?,
        ..Data::default()
    };
    let spec = FitSpec {
        seed: args.seed,
        prepare: PrepareOptions {
            delay: recorded.data.delays(),
            ..recorded.estimate.prepare()
        },
        ..FitSpec::of(FAMILY)
    };
    let ready = PreparedFit::new(spec, data).map_err(failure::of_data)?;
    drop(task);
    let mut display = ProgressDisplay::start("formula", mode.quiet);
    let kept = ready.fit(None, &mut display);
    display.finish(if kept.is_ok() { "done" } else { "failed" });
    Ok(kept.map_err(failure::of_data)?.selection.fit.model)
}

fn shown(written: &WrittenLaw, parameters: &[Parameter], latex: bool) -> String {
    if latex {
        return written.latex.clone() + "\n";
    }
    let row = |own: &Parameter| {
        let error = own
            .standard_error
            .map_or(String::new(), |error| format!("{error:.1e}"));
        let name = if own.name.is_empty() { "1" } else { &own.name };
        vec![
            name.to_owned(),
            format!("{:.8}", own.value),
            error,
            own.unit.clone(),
        ]
    };
    let rows = parameters.iter().map(row).collect();
    let facts = Report {
        answer: written.text.clone(),
        subtitle: written.meaning.clone(),
        tables: vec![Table::new(
            "Coefficients.",
            &["term", "value", "standard error", "unit"],
            rows,
        )],
        ..Report::default()
    };
    text::of(&facts)
}
