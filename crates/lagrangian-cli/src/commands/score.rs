//! `lagrangian score`: a model's figures on recordings that it has not seen.

use std::process::ExitCode;

use anyhow::Result;
use lagrangian::score::{Assessment, SignalError};
use lagrangian::{Coordinate, Coordinates, Model, Score, Trajectory, score};
use lagrangian_run::ENSEMBLE;
use serde_json::json;

use super::{OutputMode, ensemble};
use crate::cli::ScoreArgs;
use crate::data;
use crate::failure::Advise;
use crate::fitted;
use crate::motion;
use crate::output;
use crate::task::{Size, Task};
use crate::verdict;

pub(super) fn run(args: &ScoreArgs, mode: OutputMode) -> Result<ExitCode> {
    let mut inputs = args.data.inputs(&args.files)?;
    inputs.push(args.model.clone());
    args.output.refuse_inputs(&inputs)?;
    args.output.refuse_existing()?;
    if args.model.join(ENSEMBLE).is_file() {
        return ensemble::score(args, mode);
    }
    let reading = Task::start("score: reading", mode.quiet, Size::of_files(&inputs))?;
    let fitted = fitted::fitted(&args.model)?;
    let (data, estimate) = fitted.complete(&args.data, &args.estimate)?;
    let model = fitted.model;
    let recordings = data::read(&args.files, &data)?;
    fitted::require_coordinates(&recordings, model.coordinates())?;
    let (trajectories, estimates) = data::trajectories(recordings, &estimate)?;
    let samples = trajectories.iter().map(Trajectory::len).sum();
    drop(reading);
    let task = Task::of_predictions("score", mode.quiet, samples)?;
    let score = score(&model, &trajectories, &motion::for_comparison()).advise(
        "cannot score",
        "`lagrangian check` shows what is wrong with the data",
    )?;
    let assessment = Assessment::new(&model, &trajectories, &score);
    drop(task);
    motion::note_stopped(&score);
    motion::note_outside(&model, &trajectories);
    let figures = json!({
        "command": "score",
        "model": args.model,
        "files": args.files,
        "estimated": data::estimated_signals(&estimates),
        "score": score,
        "verdict": assessment.verdict,
        "assessment": assessment,
    });
    let text = || as_text(&score, &trajectories, model.coordinates()) + &verdict::text(&assessment);
    args.output.write_figures(mode, &figures, text)?;
    Ok(verdict::exit_code(&assessment))
}

fn as_text(score: &Score, trajectories: &[Trajectory], coordinates: &Coordinates) -> String {
    let (samples, count) = (score.samples, trajectories.len());
    let mut text = format!("{samples} samples of {}\n", output::trajectories(count));
    let signals = [
        ("acceleration", &score.acceleration),
        ("torque", &score.torque),
    ];
    for (name, error) in signals {
        text += &error
            .as_ref()
            .map_or(String::new(), |e| signal(name, e, coordinates));
    }
    if score.singular > 0 {
        text += &format!("  mass matrix singular at {} states\n", score.singular);
    }
    for (trajectory, rollout) in trajectories.iter().zip(&score.rollouts) {
        let bound = if rollout.exceeded { "" } else { "≥ " };
        let cut = if rollout.outcome.is_stopped() {
            ", then stopped"
        } else {
            ""
        };
        text += &format!(
            "  {:<24} followed for {bound}{:.2} of {:.2} s{cut}\n",
            trajectory.name, rollout.valid_seconds, rollout.duration
        );
        if !trajectory.goal.is_empty() {
            text += &positions(&rollout.q_mean_absolute, coordinates);
        }
    }
    for restart in &score.restarts {
        let errors = coordinates.0.iter().zip(&restart.q_rms_end);
        let errors = errors.map(|(c, error)| format!("{} {error:.3} {}", c.name, c.unit));
        let errors = errors.collect::<Vec<_>>().join(", ");
        let (seconds, starts) = (restart.seconds, restart.starts);
        text += &format!(
            "  after {seconds:.1} s from {starts} starts: root mean square error {errors}\n"
        );
        if restart.unfinished > 0 {
            text += &format!("  {} of these diverged\n", restart.unfinished);
        }
    }
    text
}

/// The mean absolute error of the positions of a motion that was simulated from its goals.
fn positions(errors: &[f64], coordinates: &Coordinates) -> String {
    let each = coordinates.0.iter().zip(errors);
    let each = each.map(|(c, error)| format!("{} {error:.4} {}", c.name, c.unit));
    let each = each.collect::<Vec<_>>().join(", ");
    format!("  {:<24} mean absolute error of the position {each}\n", "")
}

/// A line for each coordinate, and one for all of them where there are several.
fn signal(name: &str, error: &SignalError, coordinates: &Coordinates) -> String {
    let all = format!(
        "  {name:<13}{:<11} mean square error {:.3e} (sum), of its variance {:.3e} (mean)\n",
        "all", error.mse_sum, error.nmse_mean
    );
    let line = |(c, (mse, nmse)): (&Coordinate, (&f64, &f64))| {
        let own = &c.name;
        format!("  {name:<13}{own:<11} mean square error {mse:.3e}, of its variance {nmse:.3e}\n")
    };
    let errors = error.mse.iter().zip(&error.nmse);
    let lines = coordinates.0.iter().zip(errors).map(line);
    lines
        .chain((coordinates.dof() > 1).then_some(all))
        .collect()
}
