//! The parts of a torque, and a model's error in each.
//!
//! In a motion α times as fast the inertial and the Coriolis part are α² times as large and gravity the same, where L is
//! quadratic in q̇ and nothing rubs.

use lagrangian::torque::{self, TorqueParts};
use lagrangian::trajectory::Signal;
use lagrangian::{Model, Trajectory};

use super::data::Letter;
use crate::data::column;

/// The parts that `model` sees in a motion with accelerations; `None` where it has no inverse dynamics, or the motion no
/// accelerations.
pub(super) fn parts_of(model: &dyn Model, motion: &Trajectory) -> Option<TorqueParts> {
    let qdd = motion.values(Signal::Qdd)?;
    torque::parts(&mut *model.evaluator(), &motion.q, &motion.qd, qdd)
}

/// Those of the same path, `alpha` times as fast, where nothing rubs.
pub(super) fn faster(parts: &TorqueParts, alpha: f64) -> TorqueParts {
    let scaled = |part: &[f64]| part.iter().map(|x| alpha * alpha * x).collect();
    TorqueParts {
        inertial: scaled(&parts.inertial),
        coriolis: scaled(&parts.coriolis),
        ..parts.clone()
    }
}

/// Errors of predicted torques over all samples of some motions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueError {
    /// Mean squared error of τ, summed over the joints, (N·m)².
    pub mse: f64,
    /// Mean squared error by the variance of the true torque, the mean over the joints.
    pub nmse: f64,
    /// As `mse`, of the inertial part.
    pub inertial: f64,
    /// As `mse`, of the Coriolis and centrifugal part.
    pub coriolis: f64,
    /// As `mse`, of gravity.
    pub gravity: f64,
}

/// The error of `model` on some letters; `None` where it has no inverse dynamics.
///
/// Its parts come from its own inverse dynamics, whatever its family.
#[must_use]
pub fn error(model: &dyn Model, letters: &[Letter]) -> Option<TorqueError> {
    let n = model.coordinates().dof().max(1);
    let (mut truth, mut found) = (TorqueParts::default(), TorqueParts::default());
    for Letter { motion, parts } in letters {
        append(&mut truth, parts);
        append(&mut found, &parts_of(model, motion)?);
    }
    let (tau, own) = (truth.total(), found.total());
    let by_joint = |true_: &[f64], found: &[f64]| -> Vec<f64> {
        let joint = |i| mean_square(&column(true_, n, i), &column(found, n, i));
        (0..n).map(joint).collect()
    };
    let sum = |true_: &[f64], found: &[f64]| by_joint(true_, found).iter().sum::<f64>();
    let variances = variances(&tau, n);
    let shares = by_joint(&tau, &own).into_iter().zip(variances);
    Some(TorqueError {
        mse: sum(&tau, &own),
        nmse: shares.map(|(mse, variance)| mse / variance).sum::<f64>() / n as f64,
        inertial: sum(&truth.inertial, &found.inertial),
        coriolis: sum(&truth.coriolis, &found.coriolis),
        gravity: sum(&truth.gravity, &found.gravity),
    })
}

fn append(all: &mut TorqueParts, other: &TorqueParts) {
    all.inertial.extend(&other.inertial);
    all.coriolis.extend(&other.coriolis);
    all.gravity.extend(&other.gravity);
}

fn mean_square(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / x.len() as f64
}

/// Variance of each column of `[m, n]`.
pub(super) fn variances(x: &[f64], n: usize) -> Vec<f64> {
    let count = (x.len() / n) as f64;
    let variance = |i: usize| {
        let column = column(x, n, i);
        let mean = column.iter().sum::<f64>() / count;
        column.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count
    };
    (0..n).map(variance).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::rollout::{free, times};
    use lagrangian::{RolloutOptions, rollout};

    fn motion(model: &dyn Model) -> Trajectory {
        let times = times(2.0, 0.05).unwrap();
        let options = RolloutOptions::default();
        let rollout = rollout(model, &[1.0, 0.4], &[2.0, -1.0], &times, &free, &options);
        rollout.unwrap().trajectory
    }

    #[test]
    fn the_parts_of_a_free_motion_cancel() {
        let arm = by_name("double-pendulum", &[]).unwrap();
        let parts = parts_of(&*arm, &motion(&*arm)).unwrap();
        assert!(parts.total().iter().all(|tau| tau.abs() < 1e-9));
        for part in [&parts.inertial, &parts.coriolis, &parts.gravity] {
            assert!(part.iter().any(|tau| tau.abs() > 1.0));
        }
    }

    #[test]
    fn a_faster_motion_needs_the_scaled_parts() {
        let arm = by_name("double-pendulum", &[]).unwrap();
        let slow = motion(&*arm);
        let alpha = 1.7;
        let fast = slow.faster(alpha);
        let scaled = faster(&parts_of(&*arm, &slow).unwrap(), alpha);
        let truth = parts_of(&*arm, &fast).unwrap();
        for (x, y) in scaled.total().iter().zip(truth.total()) {
            assert!((x - y).abs() < 1e-10 * (1.0 + y.abs()), "{x} {y}");
        }
        let letter = Letter {
            motion: fast,
            parts: scaled,
        };
        let error = error(&*arm, &[letter]).unwrap();
        assert!(error.nmse < 1e-20 && error.coriolis < 1e-18);
    }

    #[test]
    fn the_error_of_heavier_links_lies_in_all_parts_and_sums_over_the_joints() {
        let [arm, heavy] = [1.0, 1.1].map(|mass| {
            let masses = [("mass1", mass), ("mass2", mass)];
            by_name("double-pendulum", &masses).unwrap()
        });
        let motion = motion(&*arm);
        let truth = parts_of(&*arm, &motion).unwrap();
        let letter = Letter {
            motion: motion.clone(),
            parts: truth.clone(),
        };
        let error = error(&*heavy, &[letter]).unwrap();
        // Each part is a tenth too large.
        let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / motion.len() as f64;
        assert!((error.gravity / square(&truth.gravity) - 0.01).abs() < 1e-6);
        assert!((error.inertial / square(&truth.inertial) - 0.01).abs() < 1e-6);
    }
}
