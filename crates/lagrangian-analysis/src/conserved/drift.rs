//! The drift of charges along motions, less the work of forces and friction.

use serde::Serialize;

use super::Physics;
use super::charge::Charge;
use lagrangian::mechanics::{Jet, dot};
use lagrangian::trajectory::Signal;
use lagrangian::{Result, Trajectory};

/// Change of a quantity along motions.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Drift {
    /// Value at the start of each motion, in the unit of the quantity.
    pub start: Vec<f64>,
    /// Largest change from the start over all motions.
    pub largest: f64,
    /// Root mean square of the change at the end of a motion.
    pub at_end: f64,
    /// Largest change relative to the scale of the quantity.
    pub relative: f64,
    /// Length of the longest motion, s.
    pub seconds: f64,
    /// Change over time along the first motions.
    #[serde(skip)]
    pub changes: Vec<Change>,
}

/// Change of a quantity along one motion, less the work of forces and friction.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Times, s, `[len]`.
    pub t: Vec<f64>,
    /// Value less that at the start, relative to the scale of the quantity, `[len]`.
    pub relative: Vec<f64>,
}

/// Maximum number of motions whose change over time is kept.
const KEPT: usize = 10;

/// Drift of each charge along motions under their recorded forces.
pub(super) fn along(
    physics: &Physics<'_>,
    charges: &[Charge],
    motions: &[Trajectory],
) -> Result<Vec<Drift>> {
    let mut drifts = vec![Drift::default(); charges.len()];
    let coordinates = physics.lagrangian.coordinates();
    let mut jets = physics.lagrangian.jets();
    let (mut jet, mut at_rest) = (Jet::default(), Jet::default());
    for motion in motions.iter().filter(|motion| motion.len() > 1) {
        jets.jet(&motion.q, &motion.qd, &mut jet);
        jets.jet(&motion.q, &vec![0.0; motion.qd.len()], &mut at_rest);
        let force = forces(physics, motion);
        for (charge, drift) in charges.iter().zip(&mut drifts) {
            let state = (&motion.q[..], &motion.qd[..]);
            let mut values = charge.values(state, &jet, &at_rest.momentum, coordinates);
            subtract_work(charge, motion, &force, &mut values);
            drift.add(&values, motion);
        }
    }
    for (charge, drift) in charges.iter().zip(&mut drifts) {
        drift.finish(charge.scale);
    }
    Ok(drifts)
}

/// Forces τ − d at every sample, `[len, n]`.
fn forces(physics: &Physics<'_>, motion: &Trajectory) -> Vec<f64> {
    let zeros = vec![0.0; motion.q.len()];
    let mut force = zeros.clone();
    let recorded = motion.values(Signal::Tau).unwrap_or(&zeros);
    physics.applied.exerted(&motion.qd, recorded, &mut force);
    force
}

/// Subtracts ∫ ξ·(τ − d) dt from the values, by the trapezoidal rule; ξ is q̇ for the energy.
fn subtract_work(charge: &Charge, motion: &Trajectory, force: &[f64], values: &mut [f64]) {
    let n = motion.dof();
    let row = |x: &[f64], k: usize| -> Vec<f64> { x[k * n..(k + 1) * n].to_vec() };
    let power = |k: usize| match &charge.symmetry {
        None => dot(&row(&motion.qd, k), &row(force, k)),
        Some(symmetry) => dot(&symmetry.at(&row(&motion.q, k)), &row(force, k)),
    };
    let (mut work, mut before) = (0.0, power(0));
    for (k, value) in values.iter_mut().enumerate().skip(1) {
        let now = power(k);
        work += 0.5 * (motion.t[k] - motion.t[k - 1]) * (before + now);
        before = now;
        *value -= work;
    }
}

impl Drift {
    fn add(&mut self, values: &[f64], motion: &Trajectory) {
        let (Some(&first), Some(&last)) = (values.first(), values.last()) else {
            return;
        };
        self.start.push(first);
        let change = values.iter().map(|x| (x - first).abs());
        // NaN counts as an unbounded change.
        self.largest = change.fold(self.largest, |l, x| if x <= l { l } else { x });
        self.at_end += (last - first).powi(2);
        self.seconds = self.seconds.max(motion.t[motion.len() - 1] - motion.t[0]);
        if self.changes.len() < KEPT {
            self.changes.push(Change {
                t: motion.t.clone(),
                relative: values.iter().map(|x| x - first).collect(),
            });
        }
    }

    fn finish(&mut self, scale: f64) {
        self.at_end = (self.at_end / self.start.len().max(1) as f64).sqrt();
        self.relative = self.largest / scale;
        let changes = self.changes.iter_mut().flat_map(|own| &mut own.relative);
        changes.for_each(|change| *change /= scale);
    }
}
