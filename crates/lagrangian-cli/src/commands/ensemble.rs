//! Ensembles: their fit beside that of a model, and the part of other recordings in their bands.

use anyhow::Result;
use lagrangian::Model;
use lagrangian::ensemble::{Coverage, Covered};
use lagrangian::train::Ending;
use lagrangian_run::{FinishedFit, SavedEnsemble};
use serde_json::json;

use super::OutputMode;
use crate::cli::ScoreArgs;
use crate::command_line::command_line;
use crate::data;
use crate::failure::{Context, SUCCESS};
use crate::fitted::{self, Fitted};
use crate::frontend::ProgressDisplay;
use crate::motion;
use crate::seen;
use crate::task::{Size, Task};

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

/// The part of some motions that lies in the bands.
pub(super) fn as_text(coverage: &Coverage) -> String {
    let signals = [
        ("acceleration", &coverage.acceleration),
        ("torque", &coverage.torque),
        ("position in 1 s", &coverage.position),
    ];
    let line = |(name, covered): (&str, &Option<Covered>)| {
        let all = &covered.as_ref()?.all;
        let parts: Vec<String> = all.iter().map(|x| format!("{:5.1} %", 100.0 * x)).collect();
        Some(format!("  {name:<16} {}", parts.join("  ")))
    };
    let lines: Vec<String> = signals.into_iter().filter_map(line).collect();
    let levels: Vec<String> = Coverage::LEVELS
        .iter()
        .map(|level| format!("{:5.0} %", 100.0 * level))
        .collect();
    format!(
        "samples in the bands of\n  {:<16} {}\n{}",
        "",
        levels.join("  "),
        lines.join("\n")
    )
}

/// Measures the ensemble of a folder on recordings.
pub(super) fn score(args: &ScoreArgs, mode: OutputMode) -> Result<u8> {
    let task = Task::start("score", mode.quiet, Size::of_files(&args.files))?;
    let saved = SavedEnsemble::read(&args.model)?;
    let first = &saved.ensemble.members()[0];
    let preparation = saved.provenance.preparation.clone().unwrap_or_default();
    let fitted = Fitted {
        model: first.clone(),
        preparation,
    };
    let (data, estimate) = fitted.complete(&args.data, &args.estimate)?;
    let files = data::read_sample(&args.files, &data, None)?;
    fitted::require_coordinates(&files.recordings, first.coordinates())?;
    let seen = seen::noted(&args.model, &files.hashes);
    let (motions, estimates) = data::trajectories(files.recordings, &estimate)?;
    let coverage = saved.ensemble.coverage(&motions);
    drop(task);
    motion::note_outside(first, &motions);
    let figures = json!({
        "command": "score",
        "model": args.model,
        "files": args.files,
        "seen": seen,
        "estimated": data::estimated_signals(&estimates),
        "members": saved.ensemble.members().len(),
        "coverage": coverage,
    });
    args.output
        .write_figures(mode, &figures, || as_text(&coverage) + "\n")?;
    Ok(SUCCESS)
}
