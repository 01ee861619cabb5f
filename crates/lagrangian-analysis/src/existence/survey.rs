//! The survey of one data set: three fits, the conditions of Helmholtz, the divergence, and a verdict.

use serde::{Deserialize, Serialize};

use super::damping::{Damping, damping};
use super::divergence::{Divergence, divergence};
use super::errors::HeldOutErrors;
use super::field::FieldScale;
use super::fits::Fits;
use super::helmholtz::{Violation, helmholtz, helmholtz_between};
use super::parts::Parts;
use super::verdict::{Conclusion, hidden, unsupported, verdict};
use lagrangian::{Budget, Coordinates, LnnConfig, Model, Observer, Result, State, Trajectory};

/// Settings of the fits of a survey.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurveyConfig {
    /// The Lagrangian network; the plain network has the same width, layers and activation.
    pub network: LnnConfig,
    /// The budget of each fit. There are five, or nine where the first Lagrangian fits are not good enough.
    pub budget: Budget,
    /// The number of samples of a step.
    pub batch: usize,
    /// The seed of weights, batches and the split.
    pub seed: u64,
}

impl Default for SurveyConfig {
    fn default() -> Self {
        Self {
            network: LnnConfig {
                width: 32,
                ..LnnConfig::default()
            },
            budget: Budget::Steps(300),
            batch: 128,
            seed: 0,
        }
    }
}

/// The violation of the conditions of Helmholtz by the learned field.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Asymmetry {
    /// The median over all motions of [`Violation::asymmetry`].
    pub median: f64,
    /// The asymmetry that errors of learning and noise can explain, the smaller of two medians: that of a field that was
    /// learned in the same manner from the accelerations of the Lagrangian fit, and that of the difference of Φ to a field
    /// that was learned from recordings drawn with replacement.
    pub chance: f64,
    /// The median of [`Violation::regularity`].
    pub regularity: f64,
    /// The number of motions that did not end early.
    pub motions: usize,
    /// The asymmetry of each motion.
    pub all: Vec<f64>,
    /// The asymmetry of each motion that errors can explain.
    pub all_by_chance: Vec<f64>,
}

/// The mean divergence of the learned field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contraction {
    /// The divergence of the field.
    pub divergence: Divergence,
    /// The difference to the divergence of a field that was learned in the same manner from recordings drawn with
    /// replacement, 1/s.
    pub chance: f64,
    /// The divergence of an error of q̈ that is proportional to q̇ and has the size of the error of the unrestricted fit, 1/s.
    pub floor: f64,
}

impl Contraction {
    /// The error of the rate, 1/s: the standard error over motions, the error of learning, and the part that held-out errors
    /// allow.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.divergence.error.hypot(self.chance).hypot(self.floor)
    }
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
    pub contraction: Option<Contraction>,
    /// The damping; none for free motions.
    pub damping: Option<Damping>,
    /// The size of accelerations by an additional force that would not have changed the verdict, m/s² or rad/s², `[n]`.
    pub hidden: Vec<f64>,
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
/// As [`Dataset::new`](lagrangian::Dataset::new) and [`fit`](lagrangian::fit()); [`Error::TooShort`](lagrangian::Error::TooShort) where too little is left to hold out.
pub fn survey(
    coordinates: &Coordinates,
    recordings: &[Trajectory],
    config: &SurveyConfig,
    observer: &mut dyn Observer,
) -> Result<Survey> {
    let parts = Parts::new(coordinates, recordings, config.seed)?;
    let scale = parts.scale()?;
    let (qdd, tau) = (
        parts.dataset.acceleration_scale(),
        parts.dataset.force_scale(),
    );
    let mut fits = Fits::new(&parts, config, observer);
    let held_out = |model: &dyn Model| HeldOutErrors::of(model, &parts.test, &qdd);
    let plain = fits.plain()?;
    let models: [&dyn Model; 2] = [&plain, &fits.plain_drawn()?];
    let mut lagrangians = fits.lagrangians()?;
    let null = fits.plain_of(&lagrangians[0].model, &held_out(&plain).accelerations)?;
    let mut found = Survey {
        verdict: Conclusion::none(),
        hidden: Vec::new(),
        asymmetry: asymmetry(models, &null, &parts.starts(), &scale)?,
        contraction: contraction(models, recordings, &scale, held_out(&plain).relative),
        damping: match parts.dataset.forced {
            true => damping(models, &parts.test, &scale, &tau),
            false => None,
        },
        conservative: held_out(&lagrangians[0].model),
        friction: held_out(&lagrangians[1].model),
        unrestricted: held_out(&plain),
        recordings: parts.recordings,
        samples: parts.test.iter().map(Trajectory::len).sum(),
    };
    if unsupported(&found) {
        lagrangians = fits.otherwise(lagrangians)?;
        found.conservative = held_out(&lagrangians[0].model);
        found.friction = held_out(&lagrangians[1].model);
    }
    found.hidden = hidden(&found);
    found.verdict = verdict(&found, coordinates.dof(), config.seed);
    Ok(found)
}

fn asymmetry(
    models: [&dyn Model; 2],
    null: &dyn Model,
    starts: &[State],
    scale: &FieldScale,
) -> Result<Option<Asymmetry>> {
    if scale.q.len() == 1 {
        return Ok(None);
    }
    let found = helmholtz_between(models, starts, scale)?;
    let values = |of: &dyn Fn(&(Violation, f64)) -> f64| -> Vec<f64> {
        found.iter().map(of).filter(|x| x.is_finite()).collect()
    };
    let all = values(&|(v, _)| v.asymmetry);
    let all_by_chance = values(&|(_, chance)| *chance);
    let of_null = helmholtz(null, starts, scale)?;
    let of_null: Vec<f64> = of_null.iter().map(|v| v.asymmetry).collect();
    // Both are more rather than less than what errors do: the one is a bound, the other that of a field that may be harder.
    let all_by_chance = match (median(&all_by_chance), median(&of_null)) {
        (Some(bound), Some(null)) if null < bound => of_null,
        _ => all_by_chance,
    };
    let regularities = values(&|(v, _)| v.regularity);
    let medians = [&all, &all_by_chance, &regularities].map(|values| median(values));
    let [Some(median), Some(chance), Some(regularity)] = medians else {
        return Ok(None);
    };
    Ok(Some(Asymmetry {
        median,
        chance,
        regularity,
        motions: all.len(),
        all,
        all_by_chance,
    }))
}

fn contraction(
    [own, second]: [&dyn Model; 2],
    recordings: &[Trajectory],
    scale: &FieldScale,
    error: f64,
) -> Option<Contraction> {
    let measured = divergence(own, recordings, scale)?;
    let chance = (divergence(second, recordings, scale)?.rate - measured.rate).abs();
    Some(Contraction {
        divergence: measured,
        chance,
        floor: error / scale.time,
    })
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}
