//! Ensembles: their fit beside that of a model, and the part of other recordings in their bands.

use anyhow::Result;
use lagrangian::Model;
use lagrangian::train::Ending;
use lagrangian_run::{FinishedFit, SavedEnsemble, coverage_table};
use serde_json::json;

use super::OutputMode;
use crate::cli::{ModelDataArgs, ScoreArgs};
use crate::command_line::command_line;
use crate::failure::{Context, SUCCESS};
use crate::fitted::Fitted;
use crate::frontend::ProgressDisplay;
use crate::motion;
use crate::seen;
use crate::task::{Size, Task};
use crate::text;

/// Fits an ensemble of models like the one that was kept; `None` after Ctrl-C.
pub(super) fn fitted(
    kept: &FinishedFit,
    members: u32,
    mode: OutputMode,
) -> Result<Option<SavedEnsemble>> {
    if kept.selection.fit.ending == Ending::Interrupted {
        note!("note: the fit was interrupted, so there is no ensemble; --resume continues it");
        return Ok(None);
    }
    let mut shown = ProgressDisplay::start("ensemble", mode.quiet);
    let fitted = kept.fit_ensemble(members as usize, &mut shown).context(
        format!("cannot fit an ensemble (`{}`)", command_line()),
        "record more, or omit --ensemble",
    )?;
    shown.finish(&format!("{} members", fitted.ensemble.members().len()));
    Ok(Some(fitted))
}

/// Measures the ensemble of a folder on recordings.
pub(super) fn score(args: &ScoreArgs, mode: OutputMode) -> Result<u8> {
    let ModelDataArgs {
        model: path,
        files,
        recorded,
    } = &args.given;
    let task = Task::start("score", mode.quiet, Size::of_files(files))?;
    let saved = SavedEnsemble::read(path)?;
    let fitted = Fitted {
        model: saved.ensemble.members()[0].clone(),
        preparation: saved.provenance.preparation.clone().unwrap_or_default(),
    };
    let own = fitted.motions(files, recorded)?;
    let seen = seen::noted(path, &own.hashes);
    let coverage = saved.ensemble.coverage(&own.motions);
    drop(task);
    motion::note_outside(&fitted.model, &own.motions);
    let figures = json!({
        "command": "score",
        "model": path,
        "files": files,
        "seen": seen,
        "estimated": own.estimated,
        "members": saved.ensemble.members().len(),
        "coverage": coverage,
    });
    args.output.write_figures(mode, &figures, || {
        text::table(&coverage_table(&coverage, fitted.model.coordinates()))
    })?;
    Ok(SUCCESS)
}
