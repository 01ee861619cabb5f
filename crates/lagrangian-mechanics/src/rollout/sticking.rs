//! Rollouts with dry friction as a set of forces.

use super::{Force, Rollout, RolloutState, SampledAccelerations, record};
use crate::dynamics::Balance;
use crate::integrate::{Control, Moreau, Solution, moreau};

impl RolloutState<'_> {
    /// Time stepping with dry friction, see [`Moreau`].
    pub(super) fn step_through(
        &mut self,
        times: &[f64],
        tau: &Force<'_>,
        control: &Control,
        first: bool,
    ) -> Solution {
        let Self {
            evaluator,
            x,
            force,
            rollout,
            ..
        } = self;
        let Rollout {
            trajectory,
            evaluations,
            ..
        } = rollout;
        let x0 = x.clone();
        let mut sample = |k: usize, state: &[f64]| {
            x.copy_from_slice(state);
            if k > 0 || first {
                record(trajectory, times[k], state);
            }
        };
        let mut balance = |t: f64, q: &[f64], qd: &[f64], balance: &mut Balance| {
            tau(t, q, qd, force);
            *evaluations += 1;
            let _ = evaluator.balance(q, qd, force, balance); // the method checks that it is finite
        };
        moreau::solve(&mut balance, &x0, times, control, &mut sample)
    }

    /// The accelerations of all samples where dry friction is a set of forces.
    pub(super) fn accelerations(&mut self, tau: &Force<'_>) -> SampledAccelerations {
        let n = self.force.len();
        let Self {
            evaluator,
            force,
            rollout,
            ..
        } = self;
        let trajectory = &rollout.trajectory;
        let mut method = Moreau::new(n);
        let mut known = SampledAccelerations::default();
        let states = trajectory
            .q
            .chunks_exact(n)
            .zip(trajectory.qd.chunks_exact(n));
        for (&t, (q, qd)) in trajectory.t.iter().zip(states) {
            let mut balance = |t: f64, q: &[f64], qd: &[f64], balance: &mut Balance| {
                tau(t, q, qd, force);
                let _ = evaluator.balance(q, qd, force, balance);
            };
            let mut qdd = vec![0.0; n];
            if method
                .acceleration(&mut balance, t, [q, qd], &mut qdd)
                .is_err()
            {
                qdd.fill(f64::NAN);
            }
            known.found(force, &qdd);
        }
        known
    }
}
