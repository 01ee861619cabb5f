//! `lagrangian score`: a model's figures on recordings that it has not seen.

use anyhow::Result;
use lagrangian::score::{Assessment, Judgement, SignalError};
use lagrangian::text::counted;
use lagrangian::{Model, Score, Trajectory, score};
use lagrangian_report::Report;
use lagrangian_run::{ENSEMBLE, score_tables};
use serde::Serialize;
use serde_json::json;

use super::{OutputMode, ensemble};
use crate::cli::{ModelDataArgs, ScoreArgs};
use crate::failure::Context;
use crate::fitted;
use crate::motion;
use crate::seen;
use crate::task::{Size, Task};
use crate::text;
use crate::verdict;

pub(super) fn run(args: &ScoreArgs, mode: OutputMode) -> Result<u8> {
    let ModelDataArgs {
        model: path,
        files,
        recorded,
    } = &args.given;
    let mut inputs = recorded.data.inputs(files)?;
    inputs.push(path.clone());
    args.output.check(&inputs)?;
    if path.join(ENSEMBLE).is_file() {
        return ensemble::score(args, mode);
    }
    let reading = Task::start("score: reading", mode.quiet, Size::of_files(&inputs))?;
    let fitted = fitted::fitted(path)?;
    let own = fitted.motions(files, recorded)?;
    let (model, trajectories) = (fitted.model, own.motions);
    let seen = seen::noted(path, &own.hashes);
    let samples = trajectories.iter().map(Trajectory::len).sum();
    drop(reading);
    let task = Task::of_predictions("score", mode.quiet, samples)?;
    let score = score(&model, &trajectories, &motion::for_comparison()).context(
        "cannot score",
        "`lagrangian check` shows what is wrong with the data",
    )?;
    let assessment = Assessment::of_learned(&model, &trajectories, &score);
    drop(task);
    motion::note_stopped(&score);
    motion::note_outside(&model, &trajectories);
    let figures = json!({
        "command": "score",
        "model": path,
        "files": files,
        "seen": seen,
        "estimated": own.estimated,
        "score": score,
        "judgements": judgements(&score, &assessment),
        "verdict": assessment.verdict,
        "assessment": assessment,
    });
    let text = || {
        let counted = counted(trajectories.len(), "trajectory");
        let facts = Report {
            subtitle: format!("{} samples of {counted}", score.samples),
            tables: score_tables(model.coordinates(), &trajectories, &score, &assessment),
            ..Report::default()
        };
        text::of(&facts) + &verdict::text(&assessment)
    };
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
    let acceleration = |i| score.acceleration_judgement(i, assessment);
    let torque = |i| score.torque_judgement(i, assessment);
    Judgements {
        acceleration: (0..count(&score.acceleration))
            .filter_map(acceleration)
            .collect(),
        torque: (0..count(&score.torque)).filter_map(torque).collect(),
        motions: (0..score.rollouts.len())
            .filter_map(|k| score.motion_judgement(k))
            .collect(),
    }
}
