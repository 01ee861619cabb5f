//! `lagrangian fit`: from recordings to a run folder with a model.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::models::Parameter;
use lagrangian::saved::Preparation;
use lagrangian::score::Assessment;
use lagrangian::train::{Choice, Chosen, Contestant, Ending, Selection};
use lagrangian::{
    Checkpoint, Dataset, Estimate, Fit, FitConfig, Learned, Prepared, Trajectory, Verdict,
};
use lagrangian_run::{
    Columns, DataFile, Evaluation, FileHash, Links, MODEL, Occupied, Page, REPORT, RunFolder,
    RunRecord, Scored, Tensorboard, bag_files, provenance, resolved,
};
use serde_json::json;

use super::{OutputMode, ensemble};
use crate::command_line::command_line;
use crate::data;
use crate::failure::{self, Advise, FAILED, mistake};
use crate::fit_args::FitArgs;
use crate::fitted;
use crate::interrupt;
use crate::motion;
use crate::output;
use crate::resumed::{resumed, settings};
use crate::robot::Robot;
use crate::skin::{Flags, Shown};
use crate::task::{Size, Task};
use crate::verdict;

pub(super) fn run(args: &FitArgs, mode: OutputMode) -> Result<ExitCode> {
    // A folder that is made is removed if the fit ends before it began.
    interrupt::listen()?;
    let folder = RunFolder::open(&args.out, occupied(args))?;
    run_in(&folder, args, mode).inspect_err(|_| folder.remove_if_new_and_empty())
}

fn run_in(folder: &RunFolder, args: &FitArgs, mode: OutputMode) -> Result<ExitCode> {
    let (args, checkpoint) = match args.resume {
        true => resumed(folder, args)?,
        false => (args.clone(), None),
    };
    let inputs = inputs(&args)?;
    folder.refuse_inputs(&inputs)?;
    let reading = Task::start(
        "fit: preparing the data",
        mode.quiet,
        Size::of_files(&inputs),
    )?;
    let data = read(&args)?;
    let robot = args.robot.read()?;
    let mut record = record(&args, &data, robot.as_ref())?;
    let preparation = data.preparation;
    let warnings = data.prepared.check.count(Verdict::Warn);
    let Prepared {
        dataset,
        estimates,
        low_pass,
        ..
    } = &data.prepared;
    let of_data: Vec<Choice> = low_pass.iter().cloned().collect();
    let candidates = candidates(&args, dataset, estimates, robot)?;
    if let [Chosen { config, choices }] = &candidates[..] {
        record.choices = [&of_data[..], choices].concat();
        config.validate(dataset).advise(
            format!("cannot fit (`{}`)", command_line()),
            "`lagrangian fit --help` lists the flags and their values",
        )?;
    }
    drop(reading);
    let held_back = args.training.validate.is_empty();
    record.resolved = resolved(
        columns(&args)?,
        &preparation,
        &args.prepare(),
        held_back,
        &candidates,
    )?;
    if warnings > 0 {
        tell!("note: warnings about the data: {warnings}; the page lists them");
    }
    let mut begun = folder.begin(&record)?;
    let selection = fit(candidates, folder, dataset, checkpoint.as_ref(), mode)?;
    let choices = [of_data, selection.chosen.choices.clone()].concat();
    note_failures(&selection.contestants);
    let provenance = provenance(&record, preparation);
    folder.keep(&mut begun, &selection, &choices, provenance.clone())?;
    let ensemble = match args.training.ensemble {
        Some(members) => ensemble::fitted(&data.prepared, &selection, members, &provenance, mode)?,
        None => None,
    };
    let samples = json!({ "train": dataset.train.len(), "validation": dataset.validation.len() });
    let forced = dataset.forced;
    let (estimates, evaluation) = (estimates.len(), data.prepared.into());
    let page = Page {
        skin: &Flags,
        folder,
        record: &begun,
        metrics: &folder.read_metrics()?,
        model: &selection.fit.model,
        evaluation: &evaluation,
    };
    let assessment = assessed(&page, mode)?;
    let Selection {
        fit,
        chosen,
        contestants,
    } = selection;
    let improved = fit.improved(&chosen.config, held_back);
    if let Some(ensemble) = &ensemble {
        ensemble.saved.write(folder.path())?;
    }
    if !mode.json {
        tell(folder, &fit, &assessment);
        ensemble
            .iter()
            .for_each(|own| tell!("{}", ensemble::as_text(&own.coverage)));
        return Ok(exit_code(&fit, improved, &assessment));
    }
    output::print_json(&json!({
        "command": "fit",
        "out": args.out,
        "model": folder.file(MODEL),
        "report": folder.file(REPORT),
        "family": fit.model.family(),
        "ending": fit.ending,
        "improved": improved,
        "steps": fit.steps,
        "seconds": fit.seconds,
        "loss": fit.best,
        "loss_step": fit.best_step,
        "samples": samples,
        "forces": forced,
        "estimates": estimates,
        "choices": choices,
        "tried": contestants,
        "verdict": assessment.verdict,
        "assessment": assessment,
        "parameters": fit.model.parameters(),
        "ensemble": ensemble.map(|own| own.saved.summary),
    }))?;
    Ok(exit_code(&fit, improved, &assessment))
}

/// Writes the page, and says how far the model can be trusted.
fn assessed(page: &Page, mode: OutputMode) -> Result<Assessment> {
    let scored = scored(page, mode)?;
    let assessment = scored.assessment.clone();
    page.write(&page.report(scored, Links::default()))?;
    Ok(assessment)
}

/// The predictions for a page, which end when their time is up.
pub(super) fn scored(page: &Page, mode: OutputMode) -> Result<Scored> {
    let samples = page.evaluation.motions.iter().map(Trajectory::len).sum();
    let _task = Task::of_predictions("predictions for the page", mode.quiet, samples)?;
    let scored = page.scored(&motion::for_comparison())?;
    motion::note_stopped(&scored.score);
    Ok(scored)
}

/// Says which models could not be fitted.
fn note_failures(contestants: &[Contestant]) {
    for contestant in contestants {
        if let Some(failure) = &contestant.failure {
            tell!("note: {} was not fitted: {failure}", contestant.family);
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
fn tell(folder: &RunFolder, fit: &Fit, assessment: &Assessment) {
    let (model, step) = (folder.file(MODEL), fit.best_step);
    tell!(
        "model: {} (loss {:.3e} at step {step})",
        model.display(),
        fit.best
    );
    let all = fit.model.parameters();
    for p in all.iter().filter(|p| shown(&fit.model, p)) {
        let error = p.standard_error.map(|e| format!(" ± {e:.1e}"));
        let error = error.unwrap_or_default();
        tell!("  {:<20} {:>10.3e}{error} {}", p.name, p.value, p.unit);
    }
    tell!("{}", verdict::text(assessment).trim_end());
    tell!("page:  {}", folder.file(REPORT).display());
}

/// The exit code of a fit; notes one that did not improve.
fn exit_code(fit: &Fit, improved: bool, assessment: &Assessment) -> ExitCode {
    if fit.ending == Ending::Interrupted || interrupt::is_pressed() {
        return ExitCode::from(interrupt::INTERRUPTED);
    }
    if improved {
        return verdict::exit_code(assessment);
    }
    let finding = format!(
        "the fit did not improve: its best loss is {:.3e}, at step {}; the model is kept",
        fit.best, fit.best_step
    );
    let remedy = "check the data with `lagrangian check`; use a smaller --learning-rate, --optimizer adam, or --form convex";
    tell!("{}", failure::describe(&mistake(finding, remedy)));
    ExitCode::from(FAILED)
}

/// Ten inertial parameters of each link are for `--json`: most mean something only together.
fn shown(model: &Learned, parameter: &Parameter) -> bool {
    let is_of_a_body = |kind: &&str| parameter.name.starts_with(kind);
    model.family() != "rigid" || !["mass_", "inertia_"].iter().any(is_of_a_body)
}

fn occupied(args: &FitArgs) -> Occupied {
    match (args.resume, args.force) {
        (true, _) => Occupied::Resume,
        (false, true) => Occupied::Restart,
        (false, false) => Occupied::Refuse,
    }
}

/// The motions of a run's evaluation, read again from the files that it names.
pub(super) fn evaluation(record: &RunRecord) -> Result<Evaluation> {
    Ok(read(&settings(record)?)?.prepared.into())
}

/// The data of a fit and of its evaluation.
struct Data {
    prepared: Prepared,
    files: Vec<DataFile>,
    /// How they were prepared.
    preparation: Preparation,
}

fn read(args: &FitArgs) -> Result<Data> {
    let (request, options) = (args.request(None)?, args.prepare());
    let stretch = request.needs()?.stretch(&options);
    let sampling = args.sample.sampling(args.training.seed, stretch);
    let own = data::read_sample(&args.files, &args.data, sampling)?;
    let mut files = data_files("training", own.hashes);
    let validation = match args.training.validate.is_empty() {
        true => Vec::new(),
        false => {
            let other = data::read_sample(&args.training.validate, &args.data, sampling)?;
            fitted::require_dof(&other.recordings, &own.recordings[0].coordinates)?;
            files.extend(data_files("validation", other.hashes));
            other.recordings
        }
    };
    let prepared = Prepared::new(own.recordings, validation, &request, &options);
    let mut prepared = prepared.map_err(failure::of_data)?;
    data::with_remedies(&mut prepared.check);
    tell_low_pass(prepared.low_pass.as_ref());
    if prepared.options.low_pass.is_none() {
        data::note_estimates(&prepared.estimates);
    }
    let preparation = args.data.preparation(&args.files, &prepared.options)?;
    Ok(Data {
        prepared,
        files,
        preparation,
    })
}

/// Says which low-pass was chosen from the data; its cut-off, Hz.
pub(super) fn tell_low_pass(choice: Option<&Choice>) -> Option<f64> {
    let choice = choice?;
    tell!(
        "note: {} (--low-pass overrides it, 0 for none)",
        choice.reason
    );
    choice.value.as_f64()
}

fn data_files(role: &str, hashes: Vec<(PathBuf, FileHash)>) -> Vec<DataFile> {
    let file = |(path, hash): (PathBuf, FileHash)| DataFile::new(role, &path, hash);
    hashes.into_iter().map(file).collect()
}

fn record(args: &FitArgs, data: &Data, robot: Option<&Robot>) -> Result<RunRecord> {
    let robot = robot.and_then(|robot| args.robot.file(robot));
    let files = data.files.iter().cloned().chain(robot).collect();
    let record = RunRecord::now(command_line(), args.training.seed, args, files);
    Ok(record?)
}

/// All settings of the fits; notes a choice of the optimiser from the data.
fn candidates(
    args: &FitArgs,
    dataset: &Dataset,
    estimates: &[Estimate],
    robot: Option<Robot>,
) -> Result<Vec<Chosen>> {
    let request = args.request(robot.map(|robot| robot.config))?;
    let candidates = FitConfig::candidates(dataset, estimates, &request)?;
    let adam = |choice: &&Choice| choice.setting == "optimizer" && choice.value == "adam";
    if let [chosen] = &candidates[..]
        && let Some(choice) = chosen.choices.iter().find(adam)
    {
        tell!("note: {} (--optimizer overrides it)", choice.reason);
    }
    if candidates.len() > 1 {
        let names = candidates.iter().map(|c| c.config.family.name());
        let names: Vec<&str> = names.collect();
        tell!(
            "note: {} are tried and compared by their torque errors on held-out samples (--model chooses one)",
            names.join(", ")
        );
    }
    Ok(candidates)
}

fn fit(
    candidates: Vec<Chosen>,
    folder: &RunFolder,
    dataset: &Dataset,
    checkpoint: Option<&Checkpoint>,
    mode: OutputMode,
) -> Result<Selection> {
    interrupt::listen()?;
    let mut shown = Shown::start("fit", mode.quiet);
    let events = Tensorboard::Written;
    let fitted = folder.fit(dataset, candidates, checkpoint, events, &mut shown)?;
    shown.finish(&match &fitted {
        Ok(Selection {
            chosen,
            contestants,
            ..
        }) if contestants.len() > 1 => {
            let (count, kept) = (contestants.len(), chosen.config.family.name());
            format!("{count} models were tried, {kept} is kept")
        }
        Ok(Selection { fit, .. }) => format!("{} steps, loss {:.3e}", fit.steps, fit.best),
        Err(_) => "failed".into(),
    });
    fitted.advise(
        format!("cannot fit (`{}`)", command_line()),
        "`lagrangian fit --help` lists the flags and their values",
    )
}

/// How the data of a fit are read.
fn columns(args: &FitArgs) -> Result<Columns> {
    let named = [&args.files[..], &args.training.validate].concat();
    let layout = |path: PathBuf| Ok((path.clone(), args.data.layout_for(&path)?));
    let layouts = bag_files(&named)?.into_iter().map(layout);
    let layouts = layouts.collect::<Result<Vec<_>>>()?;
    let rows = args.sample.sampling(0, 0).map(|sampling| sampling.rows);
    Ok(Columns::of(layouts, rows)?)
}
