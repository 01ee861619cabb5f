//! A run that goes on: with the settings and the data that it began with, or not at all.

use std::fs;

use anyhow::{Context, Result, anyhow};
use lagrangian::settings::difference;
use lagrangian::{Checkpoint, brief};

use crate::cli::{Cli, Command};
use crate::failure::{Advise, mistake};
use crate::fit_args::FitArgs;
use crate::run_folder::{CHECKPOINT, DataFile, RunFolder, RunRecord};

/// The settings of a run from its record.
pub(crate) fn settings(record: &RunRecord) -> Result<FitArgs> {
    let settings = record.settings.clone().try_into();
    let settings = settings.map_err(|e: toml::de::Error| anyhow!(brief(&e.to_string())));
    let mut args: FitArgs = settings.advise(
        "cannot read the settings of the run",
        "run.toml was changed by hand: repeat the fit",
    )?;
    args.model.keep_own();
    Ok(args)
}

/// The settings of the interrupted run, and the state to go on from if it came so far.
pub(crate) fn resumed(
    folder: &RunFolder,
    given: &FitArgs,
) -> Result<(FitArgs, Option<Checkpoint>)> {
    refuse_settings(given)?;
    let mut args = settings(&folder.record()?)?;
    args.out.clone_from(&given.out);
    args.resume = true;
    let path = folder.file(CHECKPOINT);
    if !path.is_file() {
        return Ok((args, None));
    }
    let bytes = fs::read(&path).with_context(|| format!("cannot read '{}'", path.display()))?;
    let checkpoint = Checkpoint::from_bytes(&bytes).advise(
        format!("cannot resume from '{}'", path.display()),
        "restart with --force",
    )?;
    Ok((args, Some(checkpoint)))
}

/// Refuses settings beside --resume, which would be ignored.
fn refuse_settings(given: &FitArgs) -> Result<()> {
    let plain = Cli::of_words(["lagrangian", "fit", "--resume"]).map(|cli| cli.command);
    let Some(Command::Fit(mut plain)) = plain else {
        return Ok(());
    };
    plain.out.clone_from(&given.out);
    let (plain, given) = (serde_json::to_value(plain)?, serde_json::to_value(given)?);
    match difference(&plain, &given) {
        None => Ok(()),
        Some(change) => Err(mistake(
            format!("--resume goes on with the settings of the run, but {change}"),
            "omit all flags but --out and --resume, or restart with --force",
        )),
    }
}

/// The record of the run that is resumed, whose data and settings must be those of now.
pub(crate) fn same_run(now: &RunRecord, then: RunRecord) -> Result<RunRecord> {
    let restart = "bring the old state back, or restart with --force";
    if now.data.len() != then.data.len() {
        let (now, then) = (now.data.len(), then.data.len());
        let finding = format!("the run began with {then} files, and there are {now} now");
        return Err(mistake(finding, restart));
    }
    let mut pairs = now.data.iter().zip(&then.data);
    if let Some((DataFile { path, .. }, _)) = pairs.find(|(now, then)| now.sha256 != then.sha256) {
        let finding = format!("'{path}' is no longer the file that the run began with");
        return Err(mistake(finding, restart));
    }
    if !then.resolved.is_empty() {
        let tables = [&then.resolved, &now.resolved].map(serde_json::to_value);
        let [old, new] = tables;
        if let Some(change) = difference(&old?, &new?) {
            let finding = format!("the run began with other settings: {change}");
            return Err(mistake(finding, restart));
        }
    }
    Ok(then)
}
