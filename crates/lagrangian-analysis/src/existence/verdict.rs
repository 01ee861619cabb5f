//! The verdict from the measurements of a survey, and its confidence.

use std::fmt::{Display, Formatter};

use serde::Serialize;

use super::errors::frequency;
use super::report::reasons;
use super::survey::Survey;

/// Factor within which errors count as equal, because training depends on its initial weights.
const EQUAL: f64 = 2.0;
/// Largest factor between errors of one fit due to initial weights: tenfold was observed, and this has a margin.
const INITIAL_WEIGHTS: f64 = 30.0;
/// Relative error of the accelerations below which a fit is exact enough.
const NEGLIGIBLE: f64 = 0.01;
/// Relative error of the accelerations above which a fit has failed.
const FAILED: f64 = 0.5;
/// Relative error of the accelerations that must be exceeded if only the fits contradict a Lagrangian.
const MUCH: f64 = 0.1;
/// Multiple of the effect of errors of learning beyond which an asymmetry or a coupling is significant (18 learned fields of
/// Lagrangian systems, clean and noisy, did not exceed 1.0 times that effect; ADR 0046).
pub(super) const TIMES_CHANCE: f64 = 1.5;

/// Whether a Lagrangian exists for recorded motions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Existence {
    /// A Lagrangian exists.
    Lagrangian,
    /// A Lagrangian with friction of its coordinates exists.
    WithFriction,
    /// The motions follow a law, but a Lagrangian of it was not found, with or without friction.
    NoneFound,
    /// The recordings do not decide it.
    #[default]
    Undecided,
}

impl Display for Existence {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Lagrangian => "Lagrangian",
            Self::WithFriction => "Lagrangian with friction",
            Self::NoneFound => "none found",
            Self::Undecided => "undecided",
        })
    }
}

/// Verdict of a survey, with its confidence and reasons.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Conclusion {
    /// Whether a Lagrangian exists.
    pub existence: Existence,
    /// Confidence from 0 to 1; see [`survey`](super::survey()).
    pub confidence: f64,
    /// Reasons, one sentence each.
    pub reasons: Vec<String>,
}

/// Verdict on a survey of `n` coordinates.
pub(super) fn conclude(found: &Survey, n: usize, seed: u64) -> Conclusion {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    let existence = by_errors(fits.map(|f| f.relative));
    let frequency = frequency(fits, |errors| by_errors(errors) == existence, seed);
    let (existence, confidence) = weighed(found, existence, frequency);
    Conclusion {
        existence,
        confidence: confidence.min(most_certain(found.recordings)),
        reasons: reasons(found, existence, n),
    }
}

/// Verdict from the errors of the conservative fit, the fit with friction and the unrestricted fit alone.
fn by_errors([conservative, friction, unrestricted]: [f64; 3]) -> Existence {
    let best = conservative.min(friction).min(unrestricted);
    let enough = |e: f64| e <= f64::max(EQUAL * best, NEGLIGIBLE);
    if best > FAILED {
        Existence::Undecided
    } else if enough(conservative) && conservative <= EQUAL * friction {
        Existence::Lagrangian
    } else if enough(friction) {
        Existence::WithFriction
    } else {
        Existence::NoneFound
    }
}

/// Whether only the fits contradict a Lagrangian, with or without friction: better initial weights might change that.
pub(super) fn unsupported(found: &Survey) -> bool {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    match by_errors(fits.map(|f| f.relative)) {
        Existence::WithFriction => !contracts(found),
        // Friction draws motions together and excludes a multiplier, too.
        Existence::NoneFound => !excluded(found) || least(found) < MUCH,
        Existence::Lagrangian | Existence::Undecided => false,
    }
}

/// Verdict and confidence after the other tests, which do not depend on how well a Lagrangian network learns.
fn weighed(found: &Survey, existence: Existence, frequency: f64) -> (Existence, f64) {
    // Without a divergence or a damping, the fit with friction may be better by its initial weights alone.
    let lucky = found.damping.is_none()
        && found.conservative.relative <= INITIAL_WEIGHTS * found.friction.relative;
    match existence {
        Existence::NoneFound if !excluded(found) && least(found) < MUCH => {
            (Existence::Undecided, 0.5)
        }
        Existence::NoneFound if !excluded(found) => (existence, 0.7 * frequency),
        Existence::Lagrangian if contracts(found) => (existence, 0.5 * frequency),
        Existence::WithFriction if lucky && !contracts(found) => (existence, 0.7 * frequency),
        _ => (existence, frequency),
    }
}

/// Error of the better one of the two Lagrangian fits.
fn least(found: &Survey) -> f64 {
    found.conservative.relative.min(found.friction.relative)
}

/// Whether volume shrinks or grows.
fn contracts(found: &Survey) -> bool {
    found.divergence.is_some_and(|d| d.is_significant())
}

/// Whether a test that does not depend on how well a Lagrangian network learns excludes one.
fn excluded(found: &Survey) -> bool {
    contracts(found)
        || found.asymmetry.is_some_and(|a| a.is_significant())
        || found.damping.is_some_and(|d| d.is_significant())
}

/// k recordings agree by chance once in 2ᵏ; pieces of fewer than four recordings count as one recording more.
fn most_certain(recordings: usize) -> f64 {
    let k = recordings + usize::from(recordings < 4);
    1.0 - 0.5_f64.powi(i32::try_from(k).unwrap_or(i32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restriction_that_costs_nothing_holds() {
        assert_eq!(by_errors([1e-3, 1e-3, 2e-3]), Existence::Lagrangian);
        assert_eq!(by_errors([0.03, 0.01, 0.01]), Existence::WithFriction);
        // Friction of a thousandth of the forces is detected if the fits are more exact than that.
        assert_eq!(by_errors([1e-3, 1e-5, 1e-4]), Existence::WithFriction);
        assert_eq!(by_errors([0.2, 0.2, 0.01]), Existence::NoneFound);
        assert_eq!(by_errors([0.9, 0.9, 0.8]), Existence::Undecided);
    }

    #[test]
    fn one_recording_is_never_more_than_three_quarters_sure() {
        assert!((most_certain(1) - 0.75).abs() < 1e-12);
        assert!((most_certain(6) - 63.0 / 64.0).abs() < 1e-12);
    }
}
