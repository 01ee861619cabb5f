//! `lagrangian fit`: from recordings to a run folder with a model.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::models::Parameter;
use lagrangian::saved::Preparation;
use lagrangian::score::Assessment;
use lagrangian::train::{self, Choice, Chosen, Contestant, Ending, Selection};
use lagrangian::{
    Checkpoint, Dataset, Estimate, Fit, FitConfig, Learned, Prepared, Provenance, Verdict,
};
use lagrangian_report::draw;
use serde_json::json;

use super::OutputMode;
use crate::cli::Links;
use crate::data;
use crate::failure::{self, Advise, FAILED, mistake};
use crate::fit_args::FitArgs;
use crate::fitted;
use crate::hashed::FileHash;
use crate::interrupt;
use crate::output;
use crate::progress::Progress;
use crate::resolved::Resolved;
use crate::resumed::{resumed, same_run, settings};
use crate::robot::Robot;
use crate::run_folder::{DataFile, MODEL, Occupied, REPORT, RunFolder, RunRecord, command_line};
use crate::run_page::{Evaluation, Run};
use crate::task::{Size, Task};
use crate::verdict;
use crate::watch::Watch;

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
    let resolved = Resolved::of(&args, &preparation)?;
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
    record.resolved = resolved.with(&candidates)?;
    if warnings > 0 {
        tell!("note: warnings about the data: {warnings}; the page lists them");
    }
    let mut begun = match args.resume {
        true => same_run(&record, folder.record()?)?,
        false => {
            folder.write_record(&record)?;
            record.clone()
        }
    };
    let selection = fit(candidates, folder, dataset, checkpoint.as_ref(), mode)?;
    let Selection {
        fit,
        chosen: Chosen { config, choices },
        contestants,
    } = selection;
    let choices = [of_data, choices].concat();
    note_failures(&contestants);
    if contestants.len() > 1 {
        begun.choices.clone_from(&choices);
        begun.tried.clone_from(&contestants);
        folder.update_record(&begun)?;
    }
    let provenance = provenance(&record, preparation);
    let samples = json!({ "train": dataset.train.len(), "validation": dataset.validation.len() });
    let forced = dataset.forced;
    let (estimates, evaluation) = (estimates.len(), evaluation_of(data.prepared));
    folder.write(MODEL, &fit.model.save(provenance)?.to_bytes()?)?;
    let assessment = assessed(folder, &begun, &fit.model, &evaluation, mode)?;
    let improved = fit.improved(&config, args.training.validate.is_empty());
    if !mode.json {
        tell(folder, &fit, &assessment);
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
    }))?;
    Ok(exit_code(&fit, improved, &assessment))
}

/// Writes the page, and says how far the model can be trusted.
fn assessed(
    folder: &RunFolder,
    record: &RunRecord,
    model: &Learned,
    evaluation: &Evaluation,
    mode: OutputMode,
) -> Result<Assessment> {
    let page = Run {
        folder: folder.path(),
        record,
        metrics: &folder.read_metrics()?,
        model,
        evaluation,
    };
    let scored = page.scored(mode)?;
    let assessment = scored.assessment.clone();
    let page = draw::html(&page.report(scored, Links::default()));
    folder.write(REPORT, page.as_bytes())?;
    Ok(assessment)
}

/// Where a model comes from.
fn provenance(record: &RunRecord, preparation: Preparation) -> Provenance {
    let hashes = record.data.iter();
    let hashes = hashes.map(|file| (file.path.clone(), file.sha256.clone()));
    Provenance {
        data: hashes.collect(),
        command: Some(record.command.clone()),
        preparation: Some(preparation),
        ..Provenance::of_seed(record.seed)
    }
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
    Ok(evaluation_of(read(&settings(record)?)?.prepared))
}

/// What is left of the data when the fit has ended.
fn evaluation_of(data: Prepared) -> Evaluation {
    Evaluation {
        motions: data.motions,
        held_out: data.held_out,
        check: data.check,
    }
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
    RunRecord::now(args.training.seed, args, files)
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
    let metrics = folder.metrics(checkpoint.map_or(0, |c| c.step as u64))?;
    let bar = Progress::start("fit", mode.quiet);
    interrupt::listen()?;
    let mut watch = Watch::new(folder, metrics, bar);
    let fitted = train::select(dataset, candidates, checkpoint, &mut watch);
    let result = match &fitted {
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
    };
    watch.finish(&result)?;
    fitted.advise(
        format!("cannot fit (`{}`)", command_line()),
        "`lagrangian fit --help` lists the flags and their values",
    )
}
