//! Rollouts under recorded forces.

use serde::{Deserialize, Serialize};

use super::{Force, Rollout, RolloutOptions, RolloutState, check};
use crate::dynamics::Model;
use crate::integrate::Ending;
use lagrangian_motion::Signal;
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};

/// Repeats a recording: from its first state under its forces, sampled at its times.
///
/// The integrator starts afresh at each sample, so that it never steps across a jump of the forces: every method
/// keeps its order, and with [`Hold::Previous`] the motion is exactly that under a digital controller. A model with drives
/// follows the goals of a recording without forces, see [`crate::Driven`].
///
/// # Errors
/// As [`super::rollout`], [`Trajectory::validate`] and [`recorded`].
pub fn rollout_recorded(
    model: &dyn Model,
    recording: &Trajectory,
    hold: Hold,
    options: &RolloutOptions,
) -> Result<Rollout> {
    if let Some(driven) = model.driven().filter(|_| recording.tau.is_empty()) {
        return driven.follow(recording);
    }
    let tau = recorded(recording, model.coordinates(), hold)?;
    let (n, t) = (model.coordinates().dof(), &recording.t);
    check(model, &recording.q[..n], &recording.qd[..n], t, options)?;
    let mut run = RolloutState::new(
        model,
        &recording.q[..n],
        &recording.qd[..n],
        t.len(),
        options,
    );
    let mut ending = run.advance(&t[..1], &*tau, true);
    for k in 1..t.len() {
        // Forces of the interval up to its end, where the next interval begins.
        let within = |time: f64, q: &[f64], qd: &[f64], force: &mut [f64]| {
            let held = if hold == Hold::Previous {
                t[k - 1]
            } else {
                time
            };
            tau(held, q, qd, force);
        };
        ending = run.advance(&t[k - 1..=k], &within, false);
        if ending != Ending::Finished {
            break;
        }
    }
    Ok(run.finish(ending, &*tau))
}

/// Interpolation of the forces between two samples of a recorded trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// The forces of the sample before, as of a digital controller.
    #[default]
    Previous,
    /// Linear interpolation.
    Linear,
}

/// The forces of a recorded trajectory as a function of any time; before its beginning and after its end, the first
/// and the last of them. Zero where the trajectory has no forces.
///
/// To repeat the recording itself prefer [`rollout_recorded`], which keeps its accuracy at jumps of the forces.
///
/// # Errors
/// As [`Trajectory::validate`]; [`Error::Shape`] for a trajectory with another number of degrees of freedom
/// than `coordinates`.
pub fn recorded<'a>(
    trajectory: &'a Trajectory,
    coordinates: &Coordinates,
    hold: Hold,
) -> Result<Box<Force<'a>>> {
    trajectory.validate()?;
    let n = coordinates.dof();
    Error::check_shape(
        "a state of the trajectory with the forces",
        trajectory.dof(),
        n,
        "take the forces from a trajectory of the same system",
    )?;
    Ok(Box::new(
        move |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
            let Some(recorded) = trajectory.values(Signal::Tau) else {
                return tau.fill(0.0);
            };
            let last = trajectory.len() - 1;
            let k = trajectory.t.partition_point(|&s| s <= t).saturating_sub(1);
            tau.iter_mut()
                .zip(&recorded[k * n..(k + 1) * n])
                .for_each(|(tau, held)| *tau = *held);
            if hold == Hold::Linear && k < last {
                let (begin, end) = (trajectory.t[k], trajectory.t[k + 1]);
                let share = ((t - begin) / (end - begin)).clamp(0.0, 1.0);
                let next = &recorded[(k + 1) * n..(k + 2) * n];
                tau.iter_mut()
                    .zip(next)
                    .for_each(|(tau, next)| *tau += share * (next - *tau));
            }
        },
    ))
}
