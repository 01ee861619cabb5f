//! Accelerations of rollouts with dry friction as a set of forces.

use super::{Force, RolloutState, SampledAccelerations};
use crate::dynamics::Balance;
use crate::integrate::Moreau;

impl RolloutState<'_> {
    /// The accelerations of all samples where dry friction is a set of forces.
    pub(super) fn accelerations(&mut self, tau: &Force<'_>) -> SampledAccelerations {
        let n = self.force.len();
        let trajectory = &self.rollout.trajectory;
        let mut method = Moreau::new(n);
        let mut known = SampledAccelerations::default();
        let (q, qd) = (trajectory.q.chunks_exact(n), trajectory.qd.chunks_exact(n));
        for (&t, (q, qd)) in trajectory.t.iter().zip(q.zip(qd)) {
            let mut balance = |t: f64, q: &[f64], qd: &[f64], balance: &mut Balance| {
                tau(t, q, qd, &mut self.force);
                let _ = self.evaluator.balance(q, qd, &self.force, balance);
            };
            let mut qdd = vec![0.0; n];
            let solved = method.acceleration(&mut balance, t, [q, qd], &mut qdd);
            if solved.is_err() {
                qdd.fill(f64::NAN);
            }
            known.found(&self.force, &qdd);
        }
        known
    }
}
