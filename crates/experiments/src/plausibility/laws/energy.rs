//! What a model makes of energy: its balance under forces, and its drift without.

use super::{Row, derivative, dot, root_mean_square, rows};
use crate::data::{energies, prediction};
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{Model, Result, RolloutOptions, State, Trajectory};

/// Length of a free motion and time between its samples, s.
const DURATION: f64 = 10.0;
const INTERVAL: f64 = 0.05;

/// Root mean square of dE/dt − τ·q̇, W, with the energy of `energy` along the motion of `model`.
pub(super) fn balance(model: &dyn Model, energy: &dyn Model, states: &Trajectory) -> Option<f64> {
    if !model.moves() {
        return None;
    }
    let (mut moving, mut energy) = (model.evaluator(), energy.evaluator());
    let mut residual = |row: Row| {
        let mut qdd = vec![0.0; row.q.len()];
        let _ = moving.forward_dynamics(row.q, row.qd, row.tau, &mut qdd);
        let mut at = |s: f64| {
            let motion = row.q.iter().zip(row.qd).zip(&qdd);
            let (q, qd): (Vec<f64>, Vec<f64>) = motion
                .map(|((q, v), a)| (q + s * (v + 0.5 * s * a), v + s * a))
                .unzip();
            let mut e = [0.0];
            let outcome = energy.energy(&q, &qd, &mut e);
            outcome.is_supported().then_some(e[0])
        };
        let rate = derivative(&mut at)?;
        Some(rate - dot(row.tau, row.qd))
    };
    let all: Option<Vec<f64>> = rows(states).map(&mut residual).collect();
    all.map(|x| root_mean_square(x.into_iter()))
}

/// How far free motions leave their energy, over its deviation in the data: with the model's own energy and the true one.
#[derive(Default)]
pub(super) struct Drifts {
    pub(super) own: Option<f64>,
    pub(super) exact: Option<f64>,
    pub(super) unfinished: usize,
}

/// Energies at the end of free motions less those at their start.
pub(super) fn drifts(
    model: &dyn Model,
    truth: &dyn Model,
    states: &Trajectory,
    starts: &[State],
) -> Result<Drifts> {
    if !model.moves() {
        return Ok(Drifts::default());
    }
    let options = prediction(RolloutOptions::default().max_steps);
    let rollouts = rollout_many(model, starts, &times(DURATION, INTERVAL)?, &free, &options)?;
    let finished: Vec<&Trajectory> = rollouts
        .iter()
        .filter(|r| r.outcome.is_finished())
        .map(|r| &r.trajectory)
        .collect();
    let drift = |model: &dyn Model| {
        let all = energies(model, states).filter(|_| !finished.is_empty())?;
        let mut evaluator = model.evaluator();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let deviation = root_mean_square(all.iter().map(|e| e - mean));
        let mut change = |motion: &&Trajectory| {
            let n = states.dof();
            let last = motion.q.len() - n;
            let mut e = [0.0; 2];
            let (start, end) = e.split_at_mut(1);
            let _ = evaluator.energy(&motion.q[..n], &motion.qd[..n], start);
            let _ = evaluator.energy(&motion.q[last..], &motion.qd[last..], end);
            (end[0] - start[0]).abs()
        };
        let sum: f64 = finished.iter().map(&mut change).sum();
        Some(sum / finished.len() as f64 / deviation)
    };
    Ok(Drifts {
        own: drift(model),
        exact: drift(truth),
        unfinished: rollouts.len() - finished.len(),
    })
}
