//! A resumed run: it has the settings and the data with which it began, or is refused.

use anyhow::{Result, anyhow};
use lagrangian::settings::difference;
use lagrangian::text::brief;
use lagrangian_run::{RunFolder, RunRecord};

use crate::cli::{Cli, Command};
use crate::failure::{Context, mistake};
use crate::fit_args::FitArgs;

/// The settings of a run from its record.
pub(crate) fn settings(record: &RunRecord) -> Result<FitArgs> {
    if record.settings.contains_key("asked") {
        return Err(mistake(
            "the run was not begun by `lagrangian fit`, but by a sweep or from Python",
            "continue it there: repeat the sweep, or fit with resume=True",
        ));
    }
    let settings = record.settings.clone().try_into();
    let settings = settings.map_err(|e: toml::de::Error| anyhow!(brief(&e.to_string())));
    let mut args: FitArgs = settings.context(
        "cannot read the settings of the run",
        "run.toml was changed by hand: repeat the fit",
    )?;
    args.model.retain_family_settings();
    Ok(args)
}

/// The settings of the interrupted run, which continue.
pub(crate) fn resumed(folder: &RunFolder, given: &FitArgs) -> Result<FitArgs> {
    refuse_settings(given)?;
    let mut args = settings(&folder.record()?)?;
    args.out.clone_from(&given.out);
    args.resume = true;
    Ok(args)
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
            format!("--resume continues with the settings of the run, but {change}"),
            "omit all flags but --out and --resume, or restart with --force",
        )),
    }
}
