//! Friction by joint: the force of a joint contains the friction of that joint, which dissipates energy.

use lagrangian_motion::parallel::prelude::*;

use super::least_squares::{Part, RIDGE};
use super::terms::{FrictionCoupling, RUBBING, Terms, friction_at};
use super::{Filtered, Stretches};
use lagrangian_motion::statistics::jackknife;

/// The friction in the force of one coordinate that depends on the velocity of one coordinate.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct FrictionTerm {
    /// Size at the root mean square of the velocity, relative to the deviation of the force; positive where the force overcomes it.
    pub(in crate::check) size: f64,
    /// Standard error of the size.
    pub(in crate::check) error: f64,
}

impl FrictionTerm {
    /// Whether the size times `sign` is positive beyond this many standard errors, and at least this part of the force.
    pub(in crate::check) fn is_certain(self, sign: f64, errors: f64, part: f64) -> bool {
        sign * self.size > errors * self.error && sign * self.size > part
    }
}

/// Friction in each force by velocity, `[n][n]`; empty where the recordings are too short.
pub(super) fn rubs(filtered: &Filtered<'_>) -> Vec<Vec<FrictionTerm>> {
    let Some(stretches) = filtered.signals([0.0; 2], &[0.0]) else {
        return Vec::new();
    };
    let forces = (0..stretches.speeds.len()).into_par_iter();
    let all: Option<_> = forces.map(|i| of_force(&stretches, i)).collect();
    all.unwrap_or_default()
}

/// The friction in the force of coordinate `i`, with errors from omitting one stretch after another.
fn of_force(stretches: &Stretches<'_>, i: usize) -> Option<Vec<FrictionTerm>> {
    let terms = Terms {
        rubbing: FrictionCoupling::All,
        ..stretches.terms()
    };
    let parts = stretches.parts_with(&terms, i, &[(0, i)]);
    let mut all = Part::sum(&parts)?;
    let deviation = (all.variance() / all.rows()).sqrt();
    let sizes = |sums: &Part| -> Option<Vec<f64>> {
        let found = sums.coefficients(RIDGE)?;
        let columns: Vec<usize> = terms.friction(found.nrows()).collect();
        let of_velocity = |(columns, speed): (&[usize], &f64)| {
            let pairs = columns.iter().zip(friction_at(*speed, *speed));
            pairs.map(|(&k, x)| found[(k, 0)] * x).sum::<f64>() / deviation
        };
        let velocities = columns.chunks_exact(RUBBING).zip(&stretches.speeds);
        Some(velocities.map(of_velocity).collect())
    };
    let whole = sizes(&all)?;
    let left = all.without_each(&parts, |sums, _| sizes(sums))?;
    let rub = |(j, size): (usize, f64)| FrictionTerm {
        size,
        error: jackknife(left.iter().map(|l| l[j])),
    };
    let rubs: Vec<FrictionTerm> = whole.into_iter().enumerate().map(rub).collect();
    let finite = |r: &FrictionTerm| r.size.is_finite() && r.error.is_finite();
    rubs.iter().all(finite).then_some(rubs)
}
