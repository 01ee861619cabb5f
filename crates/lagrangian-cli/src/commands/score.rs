//! `lagrangian score`: a model's figures on recordings that it has not seen.

use anyhow::Result;
use lagrangian::score::{Assessment, Judgement, SignalError};
use lagrangian::text::counted;
use lagrangian::trajectory::Coordinate;
use lagrangian::{Coordinates, Model, Score, Trajectory, score};
use lagrangian_run::ENSEMBLE;
use serde::Serialize;
use serde_json::json;

use super::{OutputMode, ensemble};
use crate::cli::ScoreArgs;
use crate::data;
use crate::failure::Context;
use crate::fitted;
use crate::motion;
use crate::seen;
use crate::task::{Size, Task};
use crate::verdict;

pub(super) fn run(args: &ScoreArgs, mode: OutputMode) -> Result<u8> {
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
    let files = data::read_sample(&args.files, &data, None)?;
    fitted::require_coordinates(&files.recordings, model.coordinates())?;
    let seen = seen::noted(&args.model, &files.hashes);
    let (trajectories, estimates) = data::trajectories(files.recordings, &estimate)?;
    let samples = trajectories.iter().map(Trajectory::len).sum();
    drop(reading);
    let task = Task::of_predictions("score", mode.quiet, samples)?;
    let score = score(&model, &trajectories, &motion::for_comparison()).context(
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
        "seen": seen,
        "estimated": data::estimated_signals(&estimates),
        "score": score,
        "judgements": judgements(&score, &assessment),
        "verdict": assessment.verdict,
        "assessment": assessment,
    });
    let text = || as_text(&score, &assessment, &trajectories, model.coordinates());
    args.output.write_figures(mode, &figures, text)?;
    Ok(verdict::exit_code(&assessment))
}

/// The verdicts on the single numbers of a score.
#[derive(Serialize)]
struct Judgements {
    /// Verdicts on the acceleration of each coordinate; empty where it is unknown.
    acceleration: Vec<Judgement>,
    /// Verdicts on the torque of each coordinate.
    torque: Vec<Judgement>,
    /// Verdicts on the prediction of each motion.
    motions: Vec<Judgement>,
}

fn judgements(score: &Score, assessment: &Assessment) -> Judgements {
    let count = |error: &Option<SignalError>| error.as_ref().map_or(0, |error| error.mse.len());
    let accelerations = 0..count(&score.acceleration);
    let torques = 0..count(&score.torque);
    let motions = 0..score.rollouts.len();
    Judgements {
        acceleration: accelerations
            .filter_map(|i| score.acceleration_judgement(i, assessment))
            .collect(),
        torque: torques
            .filter_map(|i| score.torque_judgement(i, assessment))
            .collect(),
        motions: motions.filter_map(|k| score.motion_judgement(k)).collect(),
    }
}

fn as_text(
    score: &Score,
    assessment: &Assessment,
    trajectories: &[Trajectory],
    coordinates: &Coordinates,
) -> String {
    let judgements = judgements(score, assessment);
    let (samples, count) = (score.samples, trajectories.len());
    let mut text = format!("{samples} samples of {}\n", counted(count, "trajectory"));
    let signals = [
        (
            "acceleration",
            &score.acceleration,
            &judgements.acceleration,
        ),
        ("torque", &score.torque, &judgements.torque),
    ];
    for (name, error, own) in signals {
        let signal = |e| signal(name, e, own, coordinates);
        text += &error.as_ref().map_or(String::new(), signal);
    }
    if score.singular > 0 {
        text += &format!("  mass matrix singular at {} states\n", score.singular);
    }
    for ((trajectory, rollout), judgement) in trajectories
        .iter()
        .zip(&score.rollouts)
        .zip(&judgements.motions)
    {
        let bound = if rollout.exceeded { "" } else { "≥ " };
        let cut = if rollout.outcome.is_stopped() {
            ", then stopped"
        } else {
            ""
        };
        text += &format!(
            "  {:<24} followed for {bound}{:.2} of {:.2} s{cut} ({})\n",
            trajectory.name,
            rollout.valid_seconds,
            rollout.duration,
            judgement.text()
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
    text + &verdict::text(assessment)
}

/// The mean absolute error of the positions of a motion that was simulated from its goals.
fn positions(errors: &[f64], coordinates: &Coordinates) -> String {
    let each = coordinates.0.iter().zip(errors);
    let each = each.map(|(c, error)| format!("{} {error:.4} {}", c.name, c.unit));
    let each = each.collect::<Vec<_>>().join(", ");
    format!("  {:<24} mean absolute error of the position {each}\n", "")
}

/// A line for each coordinate, and one for all of them where there are several.
fn signal(
    name: &str,
    error: &SignalError,
    judgements: &[Judgement],
    coordinates: &Coordinates,
) -> String {
    let all = format!(
        "  {name:<13}{:<11} mean square error {:.3e} (sum), of its variance {:.3e} (mean)\n",
        "all", error.mse_sum, error.nmse_mean
    );
    let line = |(i, c): (usize, &Coordinate)| {
        let (own, mse, nmse) = (&c.name, error.mse[i], error.nmse[i]);
        let judgement = judgements
            .get(i)
            .map_or(String::new(), |own| format!(" ({})", own.text()));
        format!(
            "  {name:<13}{own:<11} mean square error {mse:.3e}, of its variance {nmse:.3e}{judgement}\n"
        )
    };
    let lines = coordinates.0.iter().enumerate().map(line);
    lines
        .chain((coordinates.dof() > 1).then_some(all))
        .collect()
}
