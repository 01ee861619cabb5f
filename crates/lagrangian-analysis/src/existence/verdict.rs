//! From measurements to a verdict, never more certain than they are.

use std::fmt::{Display, Formatter};

use serde::Serialize;

use super::errors::shares;
use super::reasons::reasons;
use super::survey::Survey;

/// Errors within this factor are alike: training has its luck.
const ALIKE: f64 = 2.0;
/// Starts alone have made errors of the same fit differ tenfold; this is on the safe side.
const LUCK: f64 = 30.0;
/// A law that predicts accelerations to this part of their size is taken for the law.
const NEGLIGIBLE: f64 = 0.01;
/// A fit whose error is beyond this part of the accelerations has found nothing.
const NOTHING: f64 = 0.5;
/// Where only the fits speak against a Lagrangian, they must miss this part of the accelerations.
const MUCH: f64 = 0.1;
/// Sure enough: standard errors of a rate, and times what errors of learning can make (of 18 learned fields of Lagrangian systems,
/// clean and noisy, none left more than 1.0 times that; ADR 0046).
const SURE: f64 = 4.0;
const TIMES_CHANCE: f64 = 1.5;

/// Whether a Lagrangian exists for what was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Existence {
    /// A Lagrangian alone.
    Lagrangian,
    /// A Lagrangian and friction of its coordinates.
    WithFriction,
    /// Neither: the law exists, its Lagrangian was not found.
    NoneFound,
    /// The recordings do not decide it.
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

/// A verdict, how sure it is, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// What was found.
    pub existence: Existence,
    /// 0…1; see [`survey`](super::survey()).
    pub confidence: f64,
    /// A sentence for each reason.
    pub reasons: Vec<String>,
}

impl Verdict {
    pub(super) fn none() -> Self {
        Self {
            existence: Existence::Undecided,
            confidence: 0.0,
            reasons: Vec::new(),
        }
    }
}

/// What the errors of the conservative fit, that with friction and the unrestricted one say alone.
fn judged([conservative, friction, unrestricted]: [f64; 3]) -> Existence {
    let best = conservative.min(friction).min(unrestricted);
    let enough = |e: f64| e <= f64::max(ALIKE * best, NEGLIGIBLE);
    if best > NOTHING {
        Existence::Undecided
    } else if enough(conservative) && conservative <= ALIKE * friction {
        Existence::Lagrangian
    } else if enough(friction) {
        Existence::WithFriction
    } else {
        Existence::NoneFound
    }
}

/// Whether only the fits speak against a Lagrangian alone, or one with friction: perhaps they were unlucky.
pub(super) fn unsupported(found: &Survey) -> bool {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    match judged(fits.map(|f| f.relative)) {
        Existence::WithFriction => contracts(found) != Some(true),
        // Friction draws motions together and leaves no multiplier either.
        Existence::NoneFound => !excluded(found) || least(found) < MUCH,
        Existence::Lagrangian | Existence::Undecided => false,
    }
}

/// The error of the better one of the two Lagrangian fits.
fn least(found: &Survey) -> f64 {
    found.conservative.relative.min(found.friction.relative)
}

/// Whether a test that does not depend on how well a Lagrangian network learns excludes one.
fn excluded(found: &Survey) -> bool {
    [asymmetric(found), contracts(found), coupled(found)].contains(&Some(true))
}

const CLASSES: [Existence; 4] = [
    Existence::Lagrangian,
    Existence::WithFriction,
    Existence::NoneFound,
    Existence::Undecided,
];

/// The verdict on what was found of `n` coordinates.
pub(super) fn verdict(found: &Survey, n: usize, seed: u64) -> Verdict {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    let existence = judged(fits.map(|f| f.relative));
    let class = |e| CLASSES.iter().position(|c| *c == judged(e)).unwrap_or(3);
    let votes = shares(fits, CLASSES.len(), class, seed);
    let own = CLASSES.iter().zip(&votes).find(|(c, _)| **c == existence);
    let share = own.map_or(0.0, |(_, share)| *share);
    let (existence, confidence) = weighed(found, existence, share);
    Verdict {
        existence,
        confidence: confidence.min(most_certain(found.recordings)),
        reasons: reasons(found, existence, n),
    }
}

/// Whether friction may have won by a better start: nothing but the fits speaks for it, and they are not far apart.
fn lucky(found: &Survey) -> bool {
    contracts(found) != Some(true)
        && found.damping.is_none()
        && found.conservative.relative <= LUCK * found.friction.relative
}

/// The other tests do not depend on whether a Lagrangian network learns well; they support the fits or not.
fn weighed(found: &Survey, existence: Existence, share: f64) -> (Existence, f64) {
    match existence {
        Existence::NoneFound if !excluded(found) && least(found) < MUCH => {
            (Existence::Undecided, 0.5)
        }
        Existence::NoneFound if !excluded(found) => (existence, 0.7 * share),
        Existence::Lagrangian if contracts(found) == Some(true) => (existence, 0.5 * share),
        // The fits alone: that with friction may have had the luckier start.
        Existence::WithFriction if lucky(found) => (existence, 0.7 * share),
        _ => (existence, share),
    }
}

/// k recordings that all agree do so by chance once in 2ᵏ; pieces of fewer than four count as one recording more.
fn most_certain(recordings: usize) -> f64 {
    let k = if recordings < 4 {
        recordings + 1
    } else {
        recordings
    };
    1.0 - 0.5_f64.powi(i32::try_from(k).unwrap_or(i32::MAX))
}

/// Whether no multiplier makes the field that of a Lagrangian; `None` where nothing was measured.
pub(super) fn asymmetric(found: &Survey) -> Option<bool> {
    found
        .asymmetry
        .as_ref()
        .map(|a| a.median > TIMES_CHANCE * a.chance)
}

/// Whether volume shrinks or grows.
pub(super) fn contracts(found: &Survey) -> Option<bool> {
    found
        .contraction
        .map(|c| c.found.rate.abs() > SURE * c.error())
}

/// Whether damping couples coordinates, as no friction of single ones does.
pub(super) fn coupled(found: &Survey) -> Option<bool> {
    found
        .damping
        .as_ref()
        .map(|d| d.coupled > TIMES_CHANCE * d.chance)
}

/// Accelerations below which a force would have changed no verdict, `[n]`: what the best fit would have to leave more.
pub(super) fn hidden(found: &Survey) -> Vec<f64> {
    let fits = [&found.conservative, &found.friction, &found.unrestricted];
    let best = fits
        .into_iter()
        .min_by(|a, b| a.relative.total_cmp(&b.relative));
    let Some(best) = best.filter(|b| b.relative > 0.0) else {
        return Vec::new();
    };
    let bound = f64::max(NEGLIGIBLE, (ALIKE * ALIKE - 1.0).sqrt() * best.relative);
    best.accelerations
        .iter()
        .map(|a| a * bound / best.relative)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restriction_that_costs_nothing_holds() {
        assert_eq!(judged([1e-3, 1e-3, 2e-3]), Existence::Lagrangian);
        assert_eq!(judged([0.03, 0.01, 0.01]), Existence::WithFriction);
        // Friction of a thousandth of the forces is seen where the fits are better than that.
        assert_eq!(judged([1e-3, 1e-5, 1e-4]), Existence::WithFriction);
        assert_eq!(judged([0.2, 0.2, 0.01]), Existence::NoneFound);
        assert_eq!(judged([0.9, 0.9, 0.8]), Existence::Undecided);
    }

    #[test]
    fn one_recording_is_never_more_than_three_quarters_sure() {
        assert!((most_certain(1) - 0.75).abs() < 1e-12);
        assert!((most_certain(6) - 63.0 / 64.0).abs() < 1e-12);
    }
}
