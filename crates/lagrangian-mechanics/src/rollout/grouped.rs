//! Rollouts of one fixed step in parallel: the states of a group are one long state.

use std::cell::RefCell;

use super::round::Round;
use super::{Force, Rollout, RolloutOptions, SampledAccelerations, initial_phase, record};
use crate::dynamics::Model;
use crate::integrate::{Ending, Rk4, Span, fixed};
use lagrangian_motion::State;

/// Rolls a group out together by the Runge–Kutta method of order 4. `None` where a rollout did not begin or reach its last
/// time; each is then rolled out separately.
pub(super) fn run(
    model: &dyn Model,
    starts: &[State],
    times: &[f64],
    tau: &Force<'_>,
    options: &RolloutOptions,
) -> Option<Vec<Rollout>> {
    let d = 2 * model.coordinates().dof();
    let mut round = Round::new(model);
    let mut rollouts: Vec<Rollout> = starts
        .iter()
        .map(|_| Rollout::begin(times.len(), d / 2))
        .collect();
    let mut x0 = Vec::with_capacity(starts.len() * d);
    for State { q, qd } in starts {
        let mut z = qd.clone();
        if !initial_phase(&mut *round.evaluator, q, qd, &mut z) {
            return None;
        }
        x0.extend_from_slice(q);
        x0.extend(z);
    }
    let mut singular = vec![0; starts.len()];
    let mut evaluations = 0;
    let unknown = starts.iter().map(|_| SampledAccelerations::default());
    let known: RefCell<Vec<SampledAccelerations>> = RefCell::new(unknown.collect());
    let mut rates = |t: f64, x: &[f64], dx: &mut [f64]| {
        round.clear();
        x.chunks_exact(d).for_each(|x| round.add(x));
        round.evaluate(tau, |_| t);
        evaluations += 1;
        round.record_accelerations(&mut known.borrow_mut());
        let rows = dx.chunks_exact_mut(d).zip(&mut singular).enumerate();
        rows.for_each(|(row, (dx, singular))| *singular += round.read(row, dx));
    };
    let mut method = Rk4::new(x0.len());
    let mut step = |t: f64, h: f64, x: &mut [f64]| method.step(&mut rates, t, h, x);
    let mut sample = |k: usize, x: &[f64]| {
        let mut known = known.borrow_mut();
        let rows = rollouts.iter_mut().zip(known.iter_mut());
        for ((rollout, known), x) in rows.zip(x.chunks_exact(d)) {
            record(&mut rollout.trajectory, times[k], x);
            known.sampled(x);
        }
    };
    let control = options.control();
    let span = Span::new(&x0, times, &control);
    let solution = fixed::solve(&mut step, span, &mut sample);
    if solution.ending != Ending::Finished {
        return None;
    }
    let rows = rollouts.iter_mut().zip(known.into_inner());
    for ((rollout, known), singular) in rows.zip(singular) {
        (rollout.steps, rollout.evaluations) = (solution.steps, evaluations);
        rollout.singular = singular;
        rollout.set_velocities(&mut *round.evaluator);
        rollout.end(Ending::Finished, &mut *round.evaluator, tau, &known);
    }
    Some(rollouts)
}
