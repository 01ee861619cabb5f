//! How far a model is from recordings: in torque, and in motion over a short time.

use crate::data::shorter;
use lagrangian::integrate::Method;
use lagrangian::rollout::{Hold, rollout_recorded};
use lagrangian::trajectory::Signal;
use lagrangian::{Model, Result, RolloutOptions, Trajectory};

/// Root mean square over samples and coordinates of the recorded torque less the model's, N·m; `None` where it has no
/// inverse dynamics or nothing is recorded.
pub(crate) fn torque_misfit(model: &dyn Model, recordings: &[Trajectory]) -> Option<f64> {
    let mut evaluator = model.evaluator();
    let (mut sum, mut count) = (0.0, 0);
    for recording in recordings {
        let (qdd, tau) = (
            recording.values(Signal::Qdd)?,
            recording.values(Signal::Tau)?,
        );
        let mut own = vec![0.0; tau.len()];
        let outcome = evaluator.inverse_dynamics(&recording.q, &recording.qd, qdd, &mut own);
        if !outcome.is_supported() {
            return None;
        }
        sum += own
            .iter()
            .zip(tau)
            .map(|(x, y)| (x - y).powi(2))
            .sum::<f64>();
        count += own.len();
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Root mean square of the error of q, rad or m, at the end of predictions of `samples` intervals that begin one behind the
/// other at recorded states, by RK4 under the recorded torques on straight lines between the samples; infinite where one
/// diverges, `None` where the model does not move.
pub(crate) fn motion_misfit(
    model: &dyn Model,
    recordings: &[Trajectory],
    samples: usize,
) -> Result<Option<f64>> {
    if !model.moves() {
        return Ok(None);
    }
    let options = RolloutOptions {
        method: Method::Rk4,
        step: 0.01,
        ..RolloutOptions::default()
    };
    let n = model.coordinates().dof();
    let (mut sum, mut count) = (0.0, 0);
    for recording in recordings {
        for start in (0..recording.len().saturating_sub(samples)).step_by(samples.max(1)) {
            let window = recording.part(start..start + samples + 1);
            let found = rollout_recorded(model, &window, Hold::Linear, &options)?;
            if !found.outcome.is_finished() {
                return Ok(Some(f64::INFINITY));
            }
            let last = window.q.len() - n;
            let pairs = window.q[last..].iter().zip(&found.trajectory.q[last..]);
            for (i, (q, own)) in pairs.enumerate() {
                sum += shorter(own - q, model.coordinates(), i).powi(2);
                count += 1;
            }
        }
    }
    Ok((count > 0).then(|| (sum / f64::from(count)).sqrt()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::plausibility::premises::Premise;

    #[test]
    fn the_exact_arm_predicts_its_unbroken_recordings_and_not_those_with_friction() {
        let arm = Premise::Friction.unbroken();
        let misfit = |amount| {
            let recordings = Premise::Friction.recordings(amount, 2, 4).unwrap();
            motion_misfit(&*arm, &recordings, 25).unwrap().unwrap()
        };
        // Torques on straight lines between samples of 0.02 s are those of sines to 1e-3.
        let unbroken = misfit(0.0);
        assert!(unbroken < 2e-3, "{unbroken}");
        assert!(misfit(1.0) > 50.0 * unbroken);
    }
}
