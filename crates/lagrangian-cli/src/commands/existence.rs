//! `lagrangian check --lagrangian`: the existence of a Lagrangian for these motions.

use anyhow::Result;
use lagrangian::check::Item;
use lagrangian::{Budget, CheckReport, EstimateOptions, Recording};
use lagrangian_analysis::existence::{SurveyConfig, check_item, survey};

use super::OutputMode;
use crate::cli::CheckArgs;
use crate::failure::{Context, mistake};
use crate::frontend::ProgressDisplay;
use crate::{data, interrupt};

/// The item of recordings that passed the other items of `report`; `None` where the search was interrupted.
///
/// # Errors
/// If these failed, or the fits cannot begin.
pub(super) fn item(
    args: &CheckArgs,
    recordings: &[Recording],
    report: &CheckReport,
    mode: OutputMode,
) -> Result<Option<Item>> {
    let Some(first) = recordings.first().filter(|_| report.passed()) else {
        return Err(mistake(
            "the recordings fail the check, so that no fit would say whether a Lagrangian exists",
            "run `lagrangian check` without --lagrangian, and correct what fails",
        ));
    };
    let options = EstimateOptions {
        low_pass: args.low_pass,
        momenta: false,
        ..EstimateOptions::default()
    };
    let (trajectories, _) = data::trajectories(recordings.to_vec(), &options)?;
    let config = SurveyConfig {
        budget: Budget::Seconds(args.seconds),
        seed: 0,
    };
    let mut shown = ProgressDisplay::start("searching for a Lagrangian", mode.quiet);
    interrupt::listen()?;
    let found = survey(&first.coordinates, &trajectories, &config, &mut shown).context(
        "cannot search for a Lagrangian",
        "omit --lagrangian, or give more recordings of the same system",
    )?;
    if interrupt::is_pressed() {
        note!("note: the search for a Lagrangian was stopped; its item is omitted");
        return Ok(None);
    }
    shown.finish("done");
    Ok(Some(check_item(&found)))
}
