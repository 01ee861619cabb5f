//! The low-pass of a machine's log: the cut-off after which a regression explains the forces best.
//!
//! A cut-off that is too high leaves noise in the accelerations, which shrinks the inertias (errors in variables); one that is too low
//! removes the acceleration. A regression after each cut-off predicts the forces of stretches outside of its fit,
//! after each cut-off in turn as the reference: a regression after 5 Hz must predict forces up to 3, 5, 8 … Hz. The best cut-off has the
//! smallest mean logarithm of all these errors (ADR 0070).

use lagrangian_motion::parallel::prelude::*;

use super::Filtered;
use super::least_squares::Part;
use crate::Recording;
use crate::low_pass::candidates;

/// A reference retains this part of the variance of the velocities.
const KEPT: f64 = 0.8;
/// Among nearly equal cut-offs, one that retains this part is preferred: lost motion biases the model of fast motions.
const WHOLE: f64 = 0.99;
/// A reference counts where its unexplained part is at most this many times the smallest one: beyond it, noise would be
/// predicted.
const CLEAR: f64 = 3.0;
/// The result is the lowest cut-off that retains the motion and whose mean error exceeds the best by at most this factor.
const NEARLY: f64 = 1.05;
/// A cut-off is returned only where the regression explains this part of the variance of the forces.
const EXPLAINED: f64 = 0.5;

/// A low-pass chosen for some recordings.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct Cutoff {
    /// The cut-off, Hz.
    pub(in crate::check) hertz: f64,
    /// Part of the variance of the forces that the regression explains after it, on omitted stretches;
    /// the unexplained parts are averaged geometrically over all joints.
    pub(in crate::check) explained: f64,
}

/// The recordings after one low-pass.
struct Candidate {
    hertz: f64,
    /// The root mean squares of the velocities, `[n]`.
    speeds: Vec<f64>,
    /// The sums of each joint over each stretch.
    joints: Vec<Vec<Part>>,
}

/// The cut-off for these recordings; `None` where the motion does not explain the forces, or there is too little of it.
pub(super) fn choose(recordings: &[&Recording]) -> Option<Cutoff> {
    // From the lowest to the highest.
    let hertz = candidates(recordings.iter().copied());
    let margin = 0.5 / hertz.first()?;
    let all = hertz
        .iter()
        .filter_map(|hertz| Candidate::new(recordings, *hertz, margin));
    let all: Vec<Candidate> = all.collect();
    let references: Vec<&Candidate> = all.iter().filter(|c| c.keeps(KEPT, all.last())).collect();
    // Indexed by reference, then by candidate.
    let errors_after = |r: &&Candidate| all.par_iter().map(|c| c.error(r)).collect();
    let table: Vec<Vec<f64>> = references.iter().map(errors_after).collect();
    let least = |errors: &[f64]| errors.iter().copied().fold(f64::INFINITY, f64::min);
    let clearest = table.iter().map(|e| least(e)).fold(f64::INFINITY, f64::min);
    let clear = table
        .iter()
        .filter(|errors| least(errors) <= clearest + CLEAR.ln());
    let count = clear.clone().count() as f64;
    let error = |k: usize| clear.clone().map(|errors| errors[k]).sum::<f64>() / count;
    let errors: Vec<f64> = (0..all.len()).map(error).collect();
    let near = all.iter().zip(&errors);
    let mut near = near
        .filter(|(_, e)| **e <= least(&errors) + NEARLY.ln())
        .map(|own| own.0);
    let lowest = near.next()?;
    let is_whole = |c: &&Candidate| c.keeps(WHOLE, all.last());
    let chosen = std::iter::once(lowest)
        .chain(near)
        .find(is_whole)
        .unwrap_or(lowest);
    let explained = 1.0 - chosen.error(chosen).exp();
    (explained > EXPLAINED).then_some(Cutoff {
        hertz: chosen.hertz,
        explained,
    })
}

impl Candidate {
    /// A margin of `margin` seconds at the ends is omitted, independent of the cut-off.
    fn new(recordings: &[&Recording], hertz: f64, margin: f64) -> Option<Self> {
        let own = (margin - 0.5 / hertz).max(0.0);
        let stretches = Filtered::new(recordings, hertz).signals([own; 2], &[0.0])?;
        let n = stretches.speeds.len();
        let joints = (0..n).into_par_iter().map(|i| stretches.parts(i));
        Some(Self {
            hertz,
            joints: joints.collect(),
            speeds: stretches.speeds,
        })
    }

    /// Whether the velocities retain this part of the variance that they have after the highest cut-off.
    fn keeps(&self, part: f64, highest: Option<&Self>) -> bool {
        let Some(highest) = highest else { return false };
        let pairs = self.speeds.iter().zip(&highest.speeds);
        let parts: f64 = pairs.map(|(own, all)| (own / all).powi(2)).sum();
        parts > part * self.speeds.len() as f64
    }

    /// Logarithm of the unexplained part of the variance, mean over the joints: the regression after this cut-off predicts the
    /// forces after that of the reference, on stretches that were omitted in turn.
    fn error(&self, reference: &Self) -> f64 {
        let joints = self.joints.iter().zip(&reference.joints);
        let errors: Vec<f64> = joints.filter_map(|(own, other)| left(own, other)).collect();
        errors.iter().map(|e| e.ln()).sum::<f64>() / errors.len() as f64
    }
}

/// Unexplained part of the variance of one joint's force; `None` for a force that does not vary.
pub(super) fn left(own: &[Part], reference: &[Part]) -> Option<f64> {
    let mut all = Part::sum(own)?;
    let variance = Part::sum(reference)?.variance();
    // The lowest cut-offs leave fewer stretches.
    let both = own.len().min(reference.len());
    let residuals = all.without_each(&own[..both], |sums, k| {
        Some(reference[k].misfit(&sums.law()?, 0, 1.0))
    });
    Some(residuals?.iter().sum::<f64>() / variance).filter(|e| *e > 0.0 && e.is_finite())
}
