//! `lagrangian fit`: from recordings to a run folder with a model.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::check::IMPACTS;
use lagrangian::mechanics::Evaluation;
use lagrangian::models::Parameter;
use lagrangian::score::Assessment;
use lagrangian::text::counted;
use lagrangian::{Fit, Layout, Model as _, Prepared, Score, Trajectory, Verdict};
use lagrangian::{
    fit::ResolvedConfig,
    score::CandidateResult,
    train::{AutoSetting, Ending},
};
use lagrangian_run::{
    Columns, Data, DataFile, Error, ExistingRun, Figures, FileHash, FinishedFit, FitReport, MODEL,
    PreparedFit, REPORT, RunFolder, RunRecord, RunTarget, Tensorboard, coverage_table, files_of,
};
use serde_json::json;

use super::{OutputMode, ensemble};
use crate::cli::DataArgs;
use crate::command_line::command_line;
use crate::data;
use crate::failure::{self, FAILED, mistake};
use crate::fit_args::FitArgs;
use crate::fitted;
use crate::frontend::{Flags, ProgressDisplay};
use crate::interrupt;
use crate::motion;
use crate::output;
use crate::resumed::{resumed, settings};
use crate::task::{Size, Task};
use crate::text;
use crate::verdict;

/// The label of the predictions for a page.
pub(super) const PREDICTIONS: &str = "predictions for the page";

pub(super) fn run(args: &FitArgs, mode: OutputMode) -> Result<u8> {
    // A new folder is removed if the program ends before the fit begins.
    interrupt::listen()?;
    let existing = match args.resume {
        true => ExistingRun::Resume,
        false => ExistingRun::from_force(args.force),
    };
    let folder = RunFolder::open(&args.out, existing)?;
    run_in(&folder, args, mode).inspect_err(|_| folder.remove_if_new_and_empty())
}

fn run_in(folder: &RunFolder, args: &FitArgs, mode: OutputMode) -> Result<u8> {
    let args = match args.resume {
        true => resumed(folder, args)?,
        false => args.clone(),
    };
    let inputs = inputs(&args)?;
    folder.refuse_inputs(&inputs)?;
    let ready = ready(&args, &inputs, mode)?;
    let place = RunTarget {
        folder,
        frontend: &Flags,
        command: command_line(),
        settings: serde_json::to_value(&args)?,
        tensorboard: Tensorboard::Written,
        figures: Figures::Omitted,
    };
    let kept = fit(ready, &place, mode)?;
    note_failures(&kept.selection.tried);
    let ensemble = match args.training.ensemble {
        Some(members) => ensemble::fitted(&kept, members, mode)?,
        None => None,
    };
    let report = kept.ended(ensemble);
    let (score, assessment) = assessed(&report, &place, mode)?;
    if report.samples.forces && report.tried.len() > 1 && score.torque.is_none() {
        note!("note: this model tells accelerations, and no torques; --model delan tells both");
    }
    if !mode.json {
        note_result(folder, &report.fit, &assessment);
        if let Some(coverage) = report.ensemble.as_ref().and_then(|own| own.coverage()) {
            let table = coverage_table(&coverage, report.fit.model.coordinates());
            note!("{}", text::table(&table).trim());
        }
        return Ok(exit_code(&report.fit, report.improved, &assessment));
    }
    let mut figures = report.summary(&score, &assessment);
    figures["command"] = json!("fit");
    figures["out"] = json!(args.out);
    figures["model"] = json!(folder.file(MODEL));
    figures["report"] = json!(folder.file(REPORT));
    output::print_json(&figures)?;
    Ok(exit_code(&report.fit, report.improved, &assessment))
}

/// Writes the page, and reports the reliability of the model; predictions end when their time is up.
fn assessed(run: &FitReport, place: &RunTarget, mode: OutputMode) -> Result<(Score, Assessment)> {
    let motions = &run.evaluation.motions;
    let samples = motions.iter().map(Trajectory::len).sum();
    let _task = Task::of_predictions(PREDICTIONS, mode.quiet, samples)?;
    let (score, assessment) = run.assessed(Some(place), &motion::for_comparison())?;
    motion::note_stopped(&score);
    Ok((score, assessment))
}

/// Reports the models that could not be fitted.
fn note_failures(tried: &[CandidateResult]) {
    for candidate in tried {
        if let Some(failure) = &candidate.failure {
            let what = match candidate.acceleration_nmse {
                Some(_) => "is not kept",
                None => "was not fitted",
            };
            note!("note: {} {what}: {failure}", candidate.family);
        }
    }
}

/// The files that a fit reads.
fn inputs(args: &FitArgs) -> Result<Vec<PathBuf>> {
    let recordings = [&args.files[..], &args.training.validate].concat();
    let mut inputs = args.data.inputs(&recordings)?;
    inputs.extend(args.robot.urdf.iter().chain(&args.robot.nominal).cloned());
    Ok(inputs)
}

/// Reports a fit on standard error.
fn note_result(folder: &RunFolder, fit: &Fit, assessment: &Assessment) {
    let (model, step) = (folder.file(MODEL), fit.best_step);
    note!(
        "model: {} (loss {:.3e} at step {step})",
        model.display(),
        fit.best
    );
    if let Some(written) = fit.model.written() {
        // A series that describes the data is not announced as their law.
        let what = if written.is_law() { "law" } else { "formula" };
        note!("{:<9}{}", format!("{what}:"), written.text);
        note!("{:<9}{}", "", written.meaning);
    }
    let all = fit.model.parameters();
    for p in all.iter().filter(is_shown) {
        let error = p.standard_error.map(|e| format!(" ± {e:.1e}"));
        let error = error.unwrap_or_default();
        note!("  {:<20} {:>10.3e}{error} {}", p.name, p.value, p.unit);
    }
    note!("{}", verdict::text(assessment).trim_end());
    let still = vec![0.0; fit.model.coordinates().dof()];
    let asked = fit.model.evaluator().energy(&still, &still, &mut [0.0]);
    if asked == Evaluation::Unsupported {
        note!(
            "  {} tells accelerations alone: it has no Lagrangian, and no energy that it could keep (--model lnn seeks one)",
            fit.model.family()
        );
    }
    note!("page:  {}", folder.file(REPORT).display());
}

/// The exit code of a fit; notes one that did not improve.
fn exit_code(fit: &Fit, improved: bool, assessment: &Assessment) -> u8 {
    if fit.ending == Ending::Interrupted || interrupt::is_pressed() {
        return interrupt::INTERRUPTED;
    }
    if improved {
        return verdict::exit_code(assessment);
    }
    let finding = format!(
        "the fit did not improve: its best loss is {:.3e}, at step {}; the model is kept",
        fit.best, fit.best_step
    );
    let remedy = "check the data with `lagrangian check`; use a smaller --learning-rate, --optimizer adam, or --form convex";
    note!("{}", failure::describe(&mistake(finding, remedy)));
    FAILED
}

/// Ten inertial parameters of each link are for `--json`: most mean something only together.
fn is_shown(parameter: &&Parameter) -> bool {
    let is_of_a_body = |kind: &&str| parameter.name.starts_with(kind);
    !["mass_", "inertia_"].iter().any(is_of_a_body)
}

/// The data of a run, read again from the files that it names.
pub(super) fn data_of(record: &RunRecord) -> Result<Prepared> {
    let args = settings(record)?;
    let (data, spec) = (read(&args)?, args.spec(None)?);
    // A description of a robot, which is not read again, is the last of the files.
    record.refuse_changed(&data.hashes, "bring the old file back, or repeat the fit")?;
    let prepared = lagrangian_run::prepared(&spec, data.training, data.validation);
    let mut prepared = prepared.map_err(failure::of_data)?;
    note_prepared(&mut prepared);
    Ok(prepared)
}

/// Reads and prepares the data, and chooses the settings that were not given.
fn ready(args: &FitArgs, inputs: &[PathBuf], mode: OutputMode) -> Result<PreparedFit> {
    let size = Size::of_files(inputs);
    let _task = Task::start("fit: preparing the data", mode.quiet, size)?;
    let mut data = read(args)?;
    let robot = args.robot.read()?;
    data.columns = Some(columns(args)?);
    let file = robot.as_ref().and_then(|robot| args.robot.file(robot));
    data.hashes.extend(file);
    let ready = PreparedFit::new(args.spec(robot.as_ref())?, data);
    let mut ready = ready.map_err(failure::of_data)?;
    note_prepared(&mut ready.prepared);
    note_candidates(&ready.candidates);
    let timed = [
        args.training.steps.map(|_| "--steps"),
        args.training.seconds.map(|_| "--seconds"),
    ];
    if let ([only], Some(flag)) = (&ready.candidates[..], timed.into_iter().flatten().next())
        && only.config.family.abilities().solved
    {
        let name = only.config.family.name();
        note!("note: {flag} changes nothing: {name} is solved for at once");
    }
    ready.validate().map_err(fit_error)?;
    Ok(ready)
}

/// Reads the recordings without shifting forces: delays are applied by the fit.
fn read(args: &FitArgs) -> Result<Data> {
    let spec = args.spec(None)?;
    let stretch = spec.needs()?.stretch(&spec.prepare);
    let sampling = args.sample.sampling(args.training.seed, stretch);
    let columns = DataArgs {
        delay: Vec::new(),
        ..args.data.clone()
    };
    let own = data::read_sample(&args.files, &columns, sampling)?;
    let mut hashes = data_files("training", own.hashes);
    let validation = match args.training.validate.is_empty() {
        true => Vec::new(),
        false => {
            let other = data::read_sample(&args.training.validate, &columns, sampling)?;
            fitted::require_dof(&other.recordings, &own.recordings[0].coordinates)?;
            hashes.extend(data_files("validation", other.hashes));
            other.recordings
        }
    };
    let layout = match args.files.first() {
        Some(path) => columns.layout_for(path)?,
        None => Layout::default(),
    };
    Ok(Data {
        training: own.recordings,
        validation,
        layout: Layout { every: 0, ..layout }.to_toml()?,
        columns: None,
        hashes,
    })
}

/// Reports the chosen settings and the estimates; remedies name flags.
fn note_prepared(prepared: &mut Prepared) {
    data::with_remedies(&mut prepared.check);
    let items = prepared.check.items.iter();
    for item in items.filter(|item| item.name == IMPACTS) {
        note!("note: {}", item.finding);
    }
    if let Some(delay) = &prepared.delay {
        note_delay(delay);
    }
    if let Some(cyclic) = &prepared.cyclic {
        note!("note: cyclic: {} (--cyclic overrides it)", cyclic.reason);
    }
    note_low_pass(prepared.low_pass.as_ref());
    if prepared.options.low_pass.is_none() {
        data::note_estimates(&prepared.estimates);
    }
}

/// Reports a low-pass that was chosen from the data; returns its cut-off, Hz.
pub(super) fn note_delay(choice: &AutoSetting) {
    note!("note: {} (--delay overrides it, 0 for none)", choice.reason);
}

pub(super) fn note_low_pass(choice: Option<&AutoSetting>) -> Option<f64> {
    let choice = choice?;
    note!(
        "note: {} (--low-pass overrides it, 0 for none)",
        choice.reason
    );
    choice.value.as_f64()
}

fn data_files(role: &str, hashes: Vec<(PathBuf, FileHash)>) -> Vec<DataFile> {
    let file = |(path, hash): (PathBuf, FileHash)| DataFile::new(role, &path, hash);
    hashes.into_iter().map(file).collect()
}

/// Reports a choice of the optimiser from the data, and that several models are tried.
fn note_candidates(candidates: &[ResolvedConfig]) {
    let adam = |choice: &&AutoSetting| choice.setting == "optimizer" && choice.value == "adam";
    if let [chosen] = candidates
        && let Some(choice) = chosen.choices.iter().find(adam)
    {
        note!("note: {} (--optimizer overrides it)", choice.reason);
    }
    let mut all = candidates.iter().flat_map(|chosen| &chosen.choices);
    if let Some(choice) = all.find(|choice| choice.setting == "dissipation") {
        note!(
            "note: friction is identified: {}",
            failure::with_flags(&choice.reason)
        );
    }
    if candidates.len() > 1 {
        let names: Vec<&str> = candidates.iter().map(|c| &*c.name).collect();
        note!(
            "note: {} are tried and compared on held-out samples (--model chooses one)",
            names.join(", ")
        );
    }
}

fn fit(ready: PreparedFit, place: &RunTarget, mode: OutputMode) -> Result<FinishedFit> {
    let warnings = ready.prepared.check.count(Verdict::Warn);
    if warnings > 0 {
        note!("note: warnings about the data: {warnings}; the page lists them");
    }
    interrupt::listen()?;
    let mut shown = ProgressDisplay::start("fit", mode.quiet);
    let kept = ready.fit(Some(place), &mut shown);
    shown.finish(&match kept.as_ref().map(|kept| &kept.selection) {
        Ok(own) if own.tried.len() > 1 => {
            let (count, kept) = (own.tried.len(), &own.chosen.name);
            format!("{count} models were tried, {kept} is kept")
        }
        Ok(own) => format!(
            "{}, loss {:.3e}",
            counted(own.fit.steps, "step"),
            own.fit.best
        ),
        Err(_) => "failed".into(),
    });
    Ok(kept.map_err(fit_error)?)
}

/// An error that names the command to use instead, where the library refuses a fit; any other error unchanged.
fn fit_error(error: Error) -> Error {
    match error {
        Error::Library(error) => Error::of(
            error,
            format!("cannot fit (`{}`)", command_line()),
            "`lagrangian fit --help` lists the flags and their values",
        ),
        other => other,
    }
}

/// The columns of the data of a fit.
fn columns(args: &FitArgs) -> Result<Columns> {
    let named = [&args.files[..], &args.training.validate].concat();
    let layout = |path: PathBuf| Ok((path.clone(), args.data.layout_for(&path)?));
    let layouts = files_of(&named)?.into_iter().map(layout);
    let layouts = layouts.collect::<Result<Vec<_>>>()?;
    let rows = args.sample.sampling(0, 0).map(|sampling| sampling.rows);
    Ok(Columns::of(layouts, rows)?)
}
