//! What a model of a chain is told, and how it learns from it.

use anyhow::Result;
use lagrangian::dynamics::Model;
use lagrangian::experiment::chains::options;
use lagrangian::experiment::{with_corrected_accelerations, with_estimated_accelerations};
use lagrangian::train::{Budget, Family, FitConfig, Learned, Loss, fit};
use lagrangian::{Dataset, Trajectory};

use super::Course;

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

/// Shares of the time for the rounds between which accelerations are corrected by the model so far.
const ROUNDS: [f64; 3] = [0.2, 0.2, 0.6];

/// A model of chunks to fit and chunks to choose the weights by.
pub(super) fn learn(
    truth: &dyn Model,
    family: Family,
    teaching: Teaching,
    chunks: (Vec<Trajectory>, Vec<Trajectory>),
    time: (f64, u64),
    course: &mut Course,
) -> Result<Learned> {
    if teaching == Teaching::States {
        return from_states(truth, family, chunks, time, course);
    }
    one(truth, family, Loss::Acceleration, &chunks, time, course)
}

/// Accelerations from the states alone, then again from what the model leaves of them, and again.
fn from_states(
    truth: &dyn Model,
    family: Family,
    (train, held): (Vec<Trajectory>, Vec<Trajectory>),
    (seconds, seed): (f64, u64),
    course: &mut Course,
) -> Result<Learned> {
    let mut chunks = (
        with_estimated_accelerations(&train),
        with_estimated_accelerations(&held),
    );
    // Where a mass whips round between two samples an estimate may be wrong by any amount.
    let loss = Loss::AccelerationL1;
    let mut model = one(
        truth,
        family.clone(),
        loss,
        &chunks,
        (ROUNDS[0] * seconds, seed),
        course,
    )?;
    for share in &ROUNDS[1..] {
        let corrected =
            |chunks: &[Trajectory]| with_corrected_accelerations(chunks, &model, &options());
        chunks = (corrected(&chunks.0)?, corrected(&chunks.1)?);
        model = one(
            truth,
            family.clone(),
            loss,
            &chunks,
            (share * seconds, seed),
            course,
        )?;
    }
    Ok(model)
}

fn one(
    truth: &dyn Model,
    family: Family,
    loss: Loss,
    (train, held): &(Vec<Trajectory>, Vec<Trajectory>),
    (seconds, seed): (f64, u64),
    course: &mut Course,
) -> Result<Learned> {
    let data = Dataset::new(truth.coordinates().clone(), train, held)?;
    let config = FitConfig {
        family,
        loss,
        budget: Budget::Seconds(seconds),
        seed,
        validate_every: 10,
        ..FitConfig::default()
    };
    let model = fit(&data, &config, None, course)?.model;
    course.check()?;
    Ok(model)
}
