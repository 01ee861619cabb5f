//! Forces that move every coordinate, for recordings that identify a system.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::forces::Dissipation;
use lagrangian_motion::{Signals, Trajectory};

/// Frequencies of the sines, Hz.
const FREQUENCIES: std::ops::Range<f64> = 0.2..1.5;

/// A sine of this amplitude (N·m or N) on each of `n` coordinates, τᵢ = A sin(ωᵢ t + φᵢ) with random frequencies between
/// 0.2 and 1.5 Hz and random phases.
pub fn sines(
    n: usize,
    amplitude: f64,
    seed: u64,
) -> impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // A stream independent of those of initial states and of noise.
    rng.set_stream(2);
    let mut sine = |_| {
        (
            TAU * rng.random_range(FREQUENCIES),
            TAU * rng.random::<f64>(),
        )
    };
    let sines: Vec<(f64, f64)> = (0..n).map(&mut sine).collect();
    move |t, _, _, tau| {
        for (tau, (omega, phase)) in tau.iter_mut().zip(&sines) {
            *tau = amplitude * (omega * t + phase).sin();
        }
    }
}

/// The net force τ − d(q̇) of a drive τ and friction d.
pub fn with_friction(
    drive: impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync,
    friction: &Dissipation,
) -> impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync {
    move |t, q, qd, tau| {
        let mut opposing = vec![0.0; tau.len()];
        friction.force(qd, &mut opposing);
        drive(t, q, qd, tau);
        tau.iter_mut().zip(&opposing).for_each(|(tau, d)| *tau -= d);
    }
}

/// Replaces the recorded forces by those of a drive, without friction, as measured by a sensor at the motor.
pub fn record_forces(
    motion: &mut Trajectory,
    drive: impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync,
) {
    let n = motion.dof().max(1);
    let Signals { q, qd, tau, .. } = &mut motion.signals;
    let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
    for ((&t, (q, qd)), tau) in motion.t.iter().zip(states).zip(tau.chunks_exact_mut(n)) {
        drive(t, q, qd, tau);
    }
    if tau.iter().all(|x| *x == 0.0) {
        tau.clear();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::analytic::by_name;
    use crate::rollout::{RolloutOptions, rollout, times};

    #[test]
    fn recorded_forces_of_a_motion_with_friction_are_the_forces_of_motion_and_the_friction() {
        let pendulum = by_name("pendulum", &[]).unwrap();
        let (drive, friction) = (sines(1, 2.0, 3), Dissipation::viscous(vec![0.4]));
        let force = with_friction(&drive, &friction);
        let clock = times(2.0, 0.01).unwrap();
        let options = RolloutOptions::default();
        let mut motion = rollout(&*pendulum, &[0.3], &[0.0], &clock, &force, &options)
            .unwrap()
            .trajectory;
        record_forces(&mut motion, &drive);
        let qdd = &motion.qdd;
        let mut needed = vec![0.0; motion.len()];
        let _ = pendulum
            .evaluator()
            .inverse_dynamics(&motion.q, &motion.qd, qdd, &mut needed);
        let tau = &motion.tau;
        for ((tau, needed), v) in tau.iter().zip(&needed).zip(&motion.qd) {
            assert!((tau - needed - 0.4 * v).abs() < 1e-9, "{tau} {needed} {v}");
        }
        // A sensor reads zero where friction is the only force.
        let free = |_: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau.fill(0.0);
        record_forces(&mut motion, free);
        assert!(motion.tau.is_empty());
    }
}
