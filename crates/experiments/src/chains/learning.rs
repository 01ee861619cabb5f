//! What the data of a chain contain, and how a model learns from them.

use crate::data::{Chunks, with_corrected_accelerations, with_estimated_accelerations};
use anyhow::Result;
use lagrangian::TrainingTask;
use lagrangian::{Budget, Dataset, FitConfig, Learned, Loss, Model};

use super::protocol::options;
use crate::harness::Lab;

/// What the chunks hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Teaching {
    /// States and true accelerations.
    Exact,
    /// States alone, as those whose figures are published had.
    States,
    /// As exact, and more of it.
    More,
}

impl Teaching {
    pub(super) const ALL: [Self; 3] = [Self::Exact, Self::States, Self::More];

    /// Its key in figures and its name on the page.
    pub(super) fn words(self) -> [&'static str; 2] {
        match self {
            Self::Exact => ["accelerations", "with accelerations"],
            Self::States => ["states", "states alone"],
            Self::More => ["more_data", "ten times the data"],
        }
    }
}

/// Shares of the budget for the rounds between which accelerations are corrected by the model so far.
const ROUNDS: [f64; 3] = [0.2, 0.2, 0.6];

/// A model of chunks in the coordinates of `truth`, of which nothing else is used.
pub(super) fn learn(
    truth: &dyn Model,
    config: &FitConfig,
    teaching: Teaching,
    chunks: &Chunks,
    lab: &mut Lab,
) -> Result<Learned> {
    let mut fit = |config: &FitConfig, Chunks { train, held }: &Chunks| {
        let data = Dataset::new(truth.coordinates().clone(), train, held)?;
        Ok(lab.fit(&data, config)?.model)
    };
    // A rollout needs no accelerations.
    if teaching != Teaching::States || config.loss == Loss::ROLLOUT {
        return fit(config, chunks);
    }
    // Accelerations from the states alone, then again from what the model leaves of them, and again.
    let round = |share: f64| FitConfig {
        training: TrainingTask {
            // Where a mass whips round between two samples an estimate may be wrong by any amount.
            loss: Loss::ACCELERATION_L1,
            budget: part(config.budget, share),
            ..config.clone().training
        },
        ..config.clone()
    };
    let mut chunks = chunks.map(|motions| Ok(with_estimated_accelerations(motions)))?;
    let mut model: Learned = fit(&round(ROUNDS[0]), &chunks)?;
    for share in &ROUNDS[1..] {
        chunks = chunks.map(|motions| with_corrected_accelerations(motions, &model, &options()))?;
        model = fit(&round(*share), &chunks)?;
    }
    Ok(model)
}

fn part(budget: Budget, share: f64) -> Budget {
    match budget {
        Budget::Steps(steps) => Budget::Steps(((share * steps as f64) as usize).max(1)),
        Budget::Seconds(seconds) => Budget::Seconds(share * seconds),
    }
}
