//! The survey of one data set: three fits, the Helmholtz conditions, the divergence, and a verdict.

use serde::Serialize;

use super::damping::{Damping, damping};
use super::divergence::{Divergence, divergence};
use super::errors::HeldOutErrors;
use super::fits::Fits;
use super::helmholtz::{Asymmetry, asymmetry};
use super::parts::{Parts, thinned};
use super::verdict::{Conclusion, conclude, unsupported};
use lagrangian::{Budget, Coordinates, Model, Observer, Result, Trajectory};

/// Numbers of held-out states at which the damping is measured, and from which motions start for the Helmholtz
/// conditions.
const STATES: usize = 200;
const MOTIONS: usize = 24;

/// Settings of the fits of a survey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyConfig {
    /// Budget of each fit. There are five fits, or nine if the first Lagrangian fits are not good enough.
    pub budget: Budget,
    /// Seed of weights, batches and the split.
    pub seed: u64,
}

/// Result of a survey.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// Whether a Lagrangian exists, with a confidence and reasons.
    pub verdict: Conclusion,
    /// Errors of a Lagrangian alone.
    pub conservative: HeldOutErrors,
    /// Errors of a Lagrangian with viscous and dry friction of each coordinate.
    pub friction: HeldOutErrors,
    /// Errors of a plain network, which fits any force.
    pub unrestricted: HeldOutErrors,
    /// Helmholtz conditions; `None` for one coordinate, and if all motions of the learned field end early.
    pub asymmetry: Option<Asymmetry>,
    /// Mean divergence; `None` if too few motions return.
    pub divergence: Option<Divergence>,
    /// Damping; `None` for free motions.
    pub damping: Option<Damping>,
    /// Number of held-out recordings.
    pub recordings: usize,
    /// Number of held-out samples.
    pub samples: usize,
}

/// Tests whether a Lagrangian exists for these recordings, which need accelerations.
///
/// 1. Three fits of equal size, optimiser and budget: a Lagrangian alone, one with friction of each coordinate, and a
///    plain network, which fits any force. A restriction that costs nothing on held-out recordings holds.
/// 2. The Helmholtz conditions on the plain network's field, which test for a multiplier that makes it a Lagrangian's. They
///    do not depend on whether a Lagrangian network learns well. The fourth fit, a plain network of recordings
///    drawn with replacement, measures the effect of errors of learning on them.
///    Driven motions reveal the multiplier itself, M: there the damping D is measured, and if it couples coordinates,
///    friction of single coordinates is not sufficient.
/// 3. The mean divergence along motions that return, which is 0 for a Lagrangian.
///
/// The confidence is the fraction of resamplings of the held-out recordings with the same verdict, at most 1 − 2⁻ᵏ for k of
/// them, and less where the other two tests do not support the verdict.
///
/// # Errors
/// As [`Dataset::new`](lagrangian::Dataset::new) and [`fit`](lagrangian::fit());
/// [`Error::TooShort`](lagrangian::Error::TooShort) for too few recordings to hold some out, and
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
