//! `lagrangian fit`: from recordings to a run folder with a model.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::models::Parameter;
use lagrangian::saved::Preparation;
use lagrangian::score::Assessment;
use lagrangian::train::{self, Choice, Chosen, Contestant, Ending, Selection};
use lagrangian::trajectory::Sampling;
use lagrangian::{
    CheckOptions, CheckReport, Checkpoint, Coordinates, Dataset, Estimate, EstimateOptions, Fit,
    FitConfig, Learned, Provenance, Recording, Trajectory, Verdict, check_validation, split,
};
use lagrangian_report::draw;
use serde_json::json;

use super::OutputMode;
use crate::cli::{EstimateArgs, Links};
use crate::data;
use crate::failure::{self, Advise, FAILED, mistake};
use crate::fit_args::FitArgs;
use crate::fit_config::Needs;
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

/// Looks at the loss after which a fit should have improved.
const VALIDATIONS: usize = 4;

/// A loss that needs no improvement, as a part of that of a model that predicts nothing.
const SMALL: f64 = 0.1;

pub(super) fn run(args: &FitArgs, mode: OutputMode) -> Result<ExitCode> {
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
    let dataset = dataset(&args, &data)?;
    let mut record = record(&args, &data, robot.as_ref())?;
    let resolved = Resolved::of(&args, &data.preparation)?;
    let warnings = data.check.count(Verdict::Warn);
    let of_data: Vec<Choice> = data.low_pass.iter().cloned().collect();
    let preparation = data.preparation.clone();
    let (evaluation, estimates) = data.evaluation();
    let candidates = candidates(&args, &dataset, &estimates, robot)?;
    if let [Chosen { config, choices }] = &candidates[..] {
        record.choices = [&of_data[..], choices].concat();
        config.validate(&dataset).advise(
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
    let selection = fit(candidates, folder, &dataset, checkpoint.as_ref(), mode)?;
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
    drop(dataset);
    folder.write(MODEL, &fit.model.save(provenance)?.to_bytes()?)?;
    let assessment = assessed(folder, &begun, &fit.model, &evaluation, mode)?;
    let improved = improved(&fit, &config, &args);
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
        "estimates": estimates.len(),
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

/// Whether the loss became finite and better than that of a model that predicts nothing, which is 1 on motions like
/// those it was fitted to; and, where there was time for several validations, fell after the first or was small by then.
fn improved(fit: &Fit, config: &FitConfig, args: &FitArgs) -> bool {
    let useless = fit.best >= 1.0 && args.training.validate.is_empty();
    let time_enough = fit.steps >= VALIDATIONS * config.validate_every;
    let stuck = fit.best_step <= config.validate_every && fit.best > SMALL;
    fit.best.is_finite() && !useless && !(time_enough && stuck)
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
    Ok(read(&settings(record)?)?.evaluation().0)
}

/// The data of a fit and of its evaluation.
struct Data {
    coordinates: Coordinates,
    train: Vec<Trajectory>,
    validation: Vec<Trajectory>,
    estimates: Vec<Estimate>,
    files: Vec<DataFile>,
    /// What the check of the training data found.
    check: CheckReport,
    /// The low-pass, where it was chosen from the data.
    low_pass: Option<Choice>,
    /// How they were prepared.
    preparation: Preparation,
}

impl Data {
    /// The evaluation data, and how signals were estimated; training data that it does not need are dropped.
    fn evaluation(self) -> (Evaluation, Vec<Estimate>) {
        let held_out = !self.validation.is_empty();
        let motions = match held_out {
            true => self.validation,
            false => self.train,
        };
        let evaluation = Evaluation {
            motions,
            held_out,
            check: self.check,
        };
        (evaluation, self.estimates)
    }
}

/// Rows of a stretch of a long log: few where each sample is learned from for itself.
fn stretch(args: &FitArgs, needs: Needs) -> usize {
    let estimate = &args.estimate;
    // Space for several windows, segments or neighbours side by side.
    let horizon = 4 * needs.horizon;
    let neighbours = if needs.positions {
        8 * args.training.baseline as usize
    } else {
        0
    };
    if !(estimate.smooth || estimate.low_pass == Some(0.0)) || !args.data.delay.is_empty() {
        Sampling::LONGEST.max(horizon).max(neighbours)
    } else if estimate.smooth || horizon + neighbours > 0 || needs.momenta {
        Sampling::LONG.max(horizon).max(neighbours)
    } else {
        Sampling::SHORT
    }
}

fn read(args: &FitArgs) -> Result<Data> {
    let needs = args.needs()?;
    let mut options = EstimateOptions {
        momenta: needs.momenta,
        ..args.estimate.options()
    };
    let stretch = stretch(args, needs);
    let sampling = args.sample.sampling(args.training.seed, stretch);
    let own = data::read_sample(&args.files, &args.data, sampling)?;
    let check = refuse_meaningless(&own.recordings, &options)?;
    let of_samples = !needs.positions && needs.horizon == 0;
    let low_pass = of_samples.then(|| low_pass(&args.estimate, &check, &mut options));
    let low_pass = low_pass.flatten();
    let coordinates = own.recordings[0].coordinates.clone();
    let mut files = data_files("training", own.hashes);
    let other = match args.training.validate.is_empty() {
        true => None,
        false => Some(validation(args, &own.recordings, &coordinates, sampling)?),
    };
    let (trajectories, mut estimates) = data::estimated(own.recordings, &options)?;
    let (train, validation) = if let Some(other) = other {
        files.extend(data_files("validation", other.hashes));
        let (validation, how) = data::estimated(other.recordings, &options)?;
        estimates.extend(how);
        (trajectories, validation)
    } else {
        let (fraction, seed) = (args.training.validate_fraction, args.training.seed);
        split(trajectories, fraction, seed)?
    };
    if options.low_pass.is_none() {
        data::note_estimates(&estimates);
    }
    Ok(Data {
        coordinates,
        train,
        validation,
        estimates,
        files,
        check,
        low_pass,
        preparation: args.data.preparation(&args.files, &options)?,
    })
}

/// The validation files, none of whose samples the model is fitted to.
fn validation(
    args: &FitArgs,
    training: &[Recording],
    coordinates: &Coordinates,
    sampling: Option<Sampling>,
) -> Result<data::Files> {
    let other = data::read_sample(&args.training.validate, &args.data, sampling)?;
    fitted::require_dof(&other.recordings, coordinates)?;
    refuse_failed(&check_validation(training, &other.recordings))?;
    Ok(other)
}

/// The low-pass that the check of the data found, where noise spoils the accelerations and nothing else was asked for;
/// sets it and says so.
pub(super) fn low_pass(
    asked: &EstimateArgs,
    check: &CheckReport,
    options: &mut EstimateOptions,
) -> Option<Choice> {
    if asked.smooth || asked.low_pass.is_some() {
        return None;
    }
    let mut items = check.items.iter();
    let item = items.find(|i| i.name == "acceleration" && i.verdict == Verdict::Warn)?;
    let hertz = *item.values.get("low_pass_hz")?;
    let reason = format!(
        "{}: a low-pass of {hertz} Hz for motion and forces",
        item.finding
    );
    options.low_pass = Some(hertz);
    tell!("note: {reason} (--low-pass overrides it, 0 for none)");
    Some(Choice::new("low_pass", hertz, reason))
}

fn data_files(role: &str, hashes: Vec<(PathBuf, FileHash)>) -> Vec<DataFile> {
    let file = |(path, hash): (PathBuf, FileHash)| DataFile::new(role, &path, hash);
    hashes.into_iter().map(file).collect()
}

/// Refuses data that `lagrangian check` fails.
pub(super) fn refuse_meaningless(
    recordings: &[Recording],
    options: &EstimateOptions,
) -> Result<CheckReport> {
    let low_pass = options.low_pass;
    let report = data::check(recordings, &CheckOptions { low_pass });
    refuse_failed(&report)?;
    Ok(report)
}

/// Refuses data with an item that fails.
fn refuse_failed(report: &CheckReport) -> Result<()> {
    let mut items = report.items.iter();
    let Some(item) = items.find(|item| item.verdict == Verdict::Fail) else {
        return Ok(());
    };
    let (check, finding) = (item.name, &item.finding);
    let about = item
        .trajectory
        .as_ref()
        .map(|name| format!("trajectory '{name}': "));
    let about = about.unwrap_or_default();
    let remedy = item.remedy.clone();
    Err(mistake(
        format!("a fit of this data would be meaningless: {about}{check}: {finding}"),
        remedy.unwrap_or_else(|| "`lagrangian check` says more".into()),
    ))
}

fn dataset(args: &FitArgs, data: &Data) -> Result<Dataset> {
    let (coordinates, training) = (data.coordinates.clone(), &args.training);
    if !args.needs()?.positions {
        if training.baseline > 1 {
            return Err(mistake(
                "--baseline: not for this loss",
                "omit it, or take --loss positions",
            ));
        }
        return Ok(Dataset::new(coordinates, &data.train, &data.validation)?);
    }
    let baseline = training.baseline as usize;
    Dataset::of_positions(coordinates, &data.train, &data.validation, baseline).advise(
        "cannot fit positions",
        "record a longer motion, or take a shorter --baseline",
    )
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
