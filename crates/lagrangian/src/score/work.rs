//! Work that free motions do, or take up, and that their model does not know: friction that it lacks, or a drive.

use lagrangian_mechanics::Model;
use lagrangian_motion::Trajectory;
use lagrangian_motion::solve::dot;
use lagrangian_motion::statistics::mean;

/// The number of parts of a motion whose works are compared, and the smallest number of samples of a part.
const PARTS: usize = 10;
const FEWEST: usize = 5;
/// The least mean square of the works in their standard errors: what noise alone does is 1.
const CERTAIN: f64 = 6.25;

/// The work of the whole motions that the model does not know, over twice their mean kinetic energy; `None` where noise does as much, for a
/// model without inverse dynamics, and for motions without accelerations.
pub(super) fn unknown_work(model: &dyn Model, motions: &[Trajectory]) -> Option<f64> {
    let long = motions.iter().filter(|own| own.len() >= FEWEST * PARTS);
    let own: Option<Vec<[f64; 3]>> = long.map(|motion| of_motion(model, motion)).collect();
    let own = own.filter(|own| !own.is_empty())?;
    let certainty = mean(&mut own.iter().map(|[work, error, _]| (work / error).powi(2)));
    let sum = |k: usize| own.iter().map(|own| own[k].abs()).sum::<f64>();
    let share = sum(0) / sum(2);
    (certainty > CERTAIN && share.is_finite()).then_some(share)
}

/// ∫ q̇ · f dt with f the forces that the model lacks, its standard error as if parts of the motion had nothing in common, and the mean
/// of p · q̇.
fn of_motion(model: &dyn Model, motion: &Trajectory) -> Option<[f64; 3]> {
    let (n, mut evaluator) = (motion.dof(), model.evaluator());
    let (mut force, mut momentum) = (vec![0.0; n], vec![0.0; n]);
    let (mut powers, mut moving) = (Vec::new(), 0.0);
    for k in 0..motion.len() {
        let row = motion.row(k);
        let known = row.qdd.len() == n
            && evaluator
                .inverse_dynamics(row.q, row.qd, row.qdd, &mut force)
                .is_finite()
            && evaluator.momentum(row.q, row.qd, &mut momentum).is_finite();
        if !known {
            return None;
        }
        powers.push(dot(row.qd, &force));
        moving += dot(row.qd, &momentum) / motion.len() as f64;
    }
    let step = |k: usize| 0.5 * (motion.t[k + 1] - motion.t[k]) * (powers[k] + powers[k + 1]);
    let steps = motion.len() - 1;
    let part = |p: usize| (p * steps / PARTS..(p + 1) * steps / PARTS).map(step).sum();
    let works: [f64; PARTS] = std::array::from_fn(part);
    let error = dot(&works, &works).sqrt();
    Some([works.iter().sum(), error, moving])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::rollout::{RolloutOptions, rollout, times};

    #[test]
    fn work_of_a_friction_that_the_model_lacks_is_found_and_none_where_there_is_none() {
        let system = by_name("pendulum", &[]).unwrap();
        let swing = |friction: f64| {
            let (t, options) = (times(12.0, 0.02).unwrap(), RolloutOptions::truth());
            let force =
                move |_: f64, _: &[f64], qd: &[f64], tau: &mut [f64]| tau[0] = -friction * qd[0];
            let own = rollout(&*system, &[1.0], &[0.0], &t, &force, &options).unwrap();
            let mut motion = [own.trajectory];
            let share = unknown_work(&*system, &motion);
            motion[0].signals.qdd.clear();
            assert_eq!(unknown_work(&*system, &motion), None);
            share
        };
        assert_eq!(swing(0.0).filter(|share| *share > 1e-3), None);
        assert!(swing(0.1).is_some_and(|share| share > 0.5));
        // Energy that is fed in is as unknown.
        assert!(swing(-0.03).is_some_and(|share| share > 0.2));
    }
}
