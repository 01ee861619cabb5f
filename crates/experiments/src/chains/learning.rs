//! What a model of a chain is told, and how it learns from it.

use crate::data::{with_corrected_accelerations, with_estimated_accelerations};
use anyhow::Result;
use lagrangian::{Budget, Dataset, FitConfig, Learned, Loss, Model, Trajectory};

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

    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Exact => "accelerations",
            Self::States => "states",
            Self::More => "more_data",
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Exact => "with accelerations",
            Self::States => "states alone",
            Self::More => "ten times the data",
        }
    }
}

/// Shares of the budget for the rounds between which accelerations are corrected by the model so far.
const ROUNDS: [f64; 3] = [0.2, 0.2, 0.6];

/// Chunks to fit, and chunks to choose the weights by.
type Chunks = (Vec<Trajectory>, Vec<Trajectory>);

/// A model of chunks in the coordinates of `truth`, which gives nothing else away.
pub(super) fn learn(
    truth: &dyn Model,
    config: &FitConfig,
    teaching: Teaching,
    chunks: Chunks,
    lab: &mut Lab,
) -> Result<Learned> {
    // A rollout needs no accelerations.
    if teaching == Teaching::States && config.loss != Loss::ROLLOUT {
        return from_states(truth, config, &chunks, lab);
    }
    one(truth, config, &chunks, lab)
}

/// Accelerations from the states alone, then again from what the model leaves of them, and again.
fn from_states(
    truth: &dyn Model,
    config: &FitConfig,
    (train, held): &Chunks,
    lab: &mut Lab,
) -> Result<Learned> {
    let mut chunks = (
        with_estimated_accelerations(train),
        with_estimated_accelerations(held),
    );
    let round = |share: f64| FitConfig {
        // Where a mass whips round between two samples an estimate may be wrong by any amount.
        loss: Loss::ACCELERATION_L1,
        budget: part(config.budget, share),
        ..config.clone()
    };
    let mut model = one(truth, &round(ROUNDS[0]), &chunks, lab)?;
    for share in &ROUNDS[1..] {
        let corrected =
            |chunks: &[Trajectory]| with_corrected_accelerations(chunks, &model, &options());
        chunks = (corrected(&chunks.0)?, corrected(&chunks.1)?);
        model = one(truth, &round(*share), &chunks, lab)?;
    }
    Ok(model)
}

fn part(budget: Budget, share: f64) -> Budget {
    match budget {
        Budget::Steps(steps) => Budget::Steps(((share * steps as f64) as usize).max(1)),
        Budget::Seconds(seconds) => Budget::Seconds(share * seconds),
    }
}

fn one(
    truth: &dyn Model,
    config: &FitConfig,
    (train, held): &Chunks,
    lab: &mut Lab,
) -> Result<Learned> {
    let data = Dataset::new(truth.coordinates().clone(), train, held)?;
    Ok(lab.fit(&data, config)?.model)
}
