//! The survey of one data set: three fits, the conditions of Helmholtz, the divergence, and a verdict.

use serde::Serialize;

use super::damping::{Damping, damping};
use super::divergence::{Divergence, divergence};
use super::errors::HeldOutErrors;
use super::fits::Fits;
use super::helmholtz::{Asymmetry, asymmetry};
use super::parts::{Parts, thinned};
use super::verdict::{Conclusion, conclude, unsupported};
use lagrangian::{Budget, Coordinates, Model, Observer, Result, Trajectory};

/// The numbers of held-out states at which the damping is measured, and from which motions start for the conditions of
/// Helmholtz.
const STATES: usize = 200;
const MOTIONS: usize = 24;

/// Settings of the fits of a survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyConfig {
    /// The budget of each fit. There are five, or nine where the first Lagrangian fits are not good enough.
    pub budget: Budget,
    /// The seed of weights, batches and the split.
    pub seed: u64,
}

/// The result of a survey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// Whether a Lagrangian exists, with a confidence and reasons.
    pub verdict: Conclusion,
    /// The errors of a Lagrangian alone.
    pub conservative: HeldOutErrors,
    /// The errors of a Lagrangian with viscous and dry friction of each coordinate.
    pub friction: HeldOutErrors,
    /// The errors of a plain network, which fits any force.
    pub unrestricted: HeldOutErrors,
    /// The conditions of Helmholtz; none for one coordinate, and where all motions of the learned field end early.
    pub asymmetry: Option<Asymmetry>,
    /// The mean divergence; none where too few motions return.
    pub divergence: Option<Divergence>,
    /// The damping; none for free motions.
    pub damping: Option<Damping>,
    /// The number of held-out recordings.
    pub recordings: usize,
    /// The number of held-out samples.
    pub samples: usize,
}

/// Tests whether a Lagrangian exists for these recordings, which need accelerations.
///
/// 1. Three fits of the same size, optimiser and budget: a Lagrangian alone, one with friction of each coordinate, and a
///    plain network, which any force fits. A restriction that costs nothing on held-out recordings holds.
/// 2. The conditions of Helmholtz on the plain network's field: is there a multiplier that makes it a Lagrangian's? They
///    do not depend on whether a Lagrangian network learns well. The fourth fit, a plain network of recordings
///    drawn with replacement, measures what errors of learning can make of them.
///    Driven motions show the multiplier itself, M: there the damping D is measured, and where it couples coordinates no
///    friction of single coordinates is enough.
/// 3. The mean divergence along motions that return, which is 0 for a Lagrangian.
///
/// The confidence is the part of resamplings of the held-out recordings with the same verdict, at most 1 − 2⁻ᵏ for k of
/// them, and less where the other two tests do not support the verdict.
///
/// # Errors
/// As [`Dataset::new`](lagrangian::Dataset::new) and [`fit`](lagrangian::fit());
/// [`Error::TooShort`](lagrangian::Error::TooShort) where too little is left to hold out, and
/// [`Error::Argument`](lagrangian::Error::Argument) for recordings at rest.
pub fn survey(
    coordinates: &Coordinates,
    recordings: &[Trajectory],
    config: &SurveyConfig,
    observer: &mut dyn Observer,
) -> Result<Survey> {
    let parts = Parts::new(coordinates, recordings, config.seed)?;
    let (scale, qdd) = (parts.scale()?, parts.dataset.acceleration_scale());
    let held_out = |model: &dyn Model| HeldOutErrors::of(model, &parts.test, &qdd);
    let mut fits = Fits::new(&parts, config, observer);
    let plain = fits.plain(&parts.dataset)?;
    let unrestricted = held_out(&plain);
    let models: [&dyn Model; 2] = [&plain, &fits.plain(&parts.drawn(config.seed)?)?];
    let mut lagrangians = fits.lagrangians()?;
    let noise = &unrestricted.accelerations;
    let imitated = parts.imitated(&lagrangians[0].model, noise, config.seed);
    let null = fits.plain(&imitated)?;
    let states = |most| thinned(&parts.test, most);
    let damped = || damping(models, &states(STATES), &scale);
    let mut found = Survey {
        verdict: Conclusion::default(),
        asymmetry: asymmetry(models, &null, &states(MOTIONS), &scale)?,
        divergence: divergence(models, recordings, &scale, unrestricted.relative),
        damping: parts.dataset.forced.then(damped).flatten(),
        conservative: held_out(&lagrangians[0].model),
        friction: held_out(&lagrangians[1].model),
        unrestricted,
        recordings: parts.recordings,
        samples: parts.test.iter().map(Trajectory::len).sum(),
    };
    if unsupported(&found) {
        lagrangians = fits.otherwise(lagrangians)?;
        found.conservative = held_out(&lagrangians[0].model);
        found.friction = held_out(&lagrangians[1].model);
    }
    found.verdict = conclude(&found, coordinates.dof(), config.seed);
    Ok(found)
}
