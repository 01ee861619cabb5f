//! Many rollouts at once: on all threads, and with the evaluations of several rollouts in one batch.

use lagrangian_motion::parallel::prelude::*;

use super::round::Round;
use super::{
    Force, Rollout, RolloutOptions, SampledAccelerations, check, grouped, record, rollout,
};
use crate::dynamics::{Evaluator, Model};
use crate::integrate::adaptive::Stepper;
use crate::integrate::{Dop853, Dopri5, EmbeddedPair, Ending, Failure, Method};
use lagrangian_motion::{Result, State};

/// Maximum number of rollouts that share evaluations: as many samples as a network takes in one block.
const LANES: usize = 16;
/// Minimum number of groups, given enough states: work for that many threads.
const GROUPS: usize = 4;

/// Rolls `model` out from each of the states, on all threads; the result is bitwise independent of their number.
///
/// The adaptive methods and the Runge–Kutta method run in groups: their next evaluations make one batch, which
/// networks compute several times faster than one after another. An adaptive rollout has its own time and step. Rounding may differ
/// in a batch, so a chaotic motion may differ from that of [`rollout`] once rounding has grown.
///
/// # Errors
/// As [`rollout`], for the first state that has one.
pub fn rollout_many(
    model: &dyn Model,
    starts: &[State],
    times: &[f64],
    tau: &Force<'_>,
    options: &RolloutOptions,
) -> Result<Vec<Rollout>> {
    for start in starts {
        check(model, &start.q, &start.qd, times, options)?;
    }
    let each = |group: &[State]| {
        let one = |start: &State| rollout(model, &start.q, &start.qd, times, tau, options);
        group.iter().map(one).collect::<Result<Vec<_>>>()
    };
    // By the number of states only: the groups must not depend on the number of threads.
    let lanes = starts.len().div_ceil(GROUPS).clamp(1, LANES);
    let groups: Vec<Vec<Rollout>> = starts
        .par_chunks(lanes)
        .map(|group| match options.method {
            // Its projection is that of one state.
            _ if model.integration().projection().is_some() => each(group),
            Method::Dop853 => Ok(run::<Dop853>(model, group, times, tau, options)),
            Method::Dopri5 => Ok(run::<Dopri5>(model, group, times, tau, options)),
            Method::Rk4 => match grouped::run(model, group, times, tau, options) {
                Some(found) => Ok(found),
                None => each(group),
            },
            _ => each(group),
        })
        .collect::<Result<_>>()?;
    Ok(groups.into_iter().flatten().collect())
}

/// One of the rollouts of a group.
struct Lane<'a, P> {
    stepper: Stepper<'a, P>,
    rollout: Rollout,
    /// Whether its initial state exists, see [`Evaluator::phase`].
    begun: bool,
}

/// Rolls a group out together, one batched evaluation a round.
fn run<P: EmbeddedPair>(
    model: &dyn Model,
    starts: &[State],
    times: &[f64],
    tau: &Force<'_>,
    options: &RolloutOptions,
) -> Vec<Rollout> {
    let mut round = Round::new(model);
    let mut lanes: Vec<Lane<'_, P>> = starts
        .iter()
        .map(|start| begin(&mut *round.evaluator, start, times, options))
        .collect();
    let mut active = Vec::new();
    while gather(&mut round, &mut lanes, &mut active) {
        round.evaluate(tau, |row| active[row].1);
        scatter(&round, &mut lanes, &active, times);
    }
    let end = |mut lane: Lane<'_, P>| {
        let solution = lane.stepper.solution();
        (lane.rollout.steps, lane.rollout.rejected) = (solution.steps, solution.rejected);
        let ending = match lane.begun {
            true => solution.ending,
            false => Ending::Failed {
                t: times[0],
                reason: Failure::NoMomentum,
            },
        };
        lane.rollout.set_velocities(&mut *round.evaluator);
        lane.rollout.end(
            ending,
            &mut *round.evaluator,
            tau,
            &SampledAccelerations::default(),
        );
        lane.rollout
    };
    lanes.into_iter().map(end).collect()
}

fn begin<'a, P: EmbeddedPair>(
    evaluator: &mut dyn Evaluator,
    start: &State,
    times: &'a [f64],
    options: &RolloutOptions,
) -> Lane<'a, P> {
    let n = start.q.len();
    let mut rollout = Rollout::begin(times.len(), n);
    let mut x0 = [&start.q[..], &start.qd].concat();
    let begun = super::initial_phase(evaluator, &start.q, &start.qd, &mut x0[n..]);
    let mut sink = |k: usize, x: &[f64]| record(&mut rollout.trajectory, times[k], x);
    let times = if begun { times } else { &[] };
    let stepper = Stepper::new(&x0, times, options.control(), &mut sink);
    Lane {
        stepper,
        rollout,
        begun,
    }
}

/// Collects the states that the lanes request, and (lane, time) of each; `false` when all have ended.
fn gather<P: EmbeddedPair>(
    round: &mut Round<'_>,
    lanes: &mut [Lane<'_, P>],
    active: &mut Vec<(usize, f64)>,
) -> bool {
    round.clear();
    active.clear();
    for (i, lane) in lanes.iter_mut().enumerate() {
        if let Some((t, x, _)) = lane.stepper.request() {
            active.push((i, t));
            round.add(x);
        }
    }
    !active.is_empty()
}

/// Gives each lane the rates that it requested.
fn scatter<P: EmbeddedPair>(
    round: &Round<'_>,
    lanes: &mut [Lane<'_, P>],
    active: &[(usize, f64)],
    times: &[f64],
) {
    for (row, &(i, _)) in active.iter().enumerate() {
        let Lane {
            stepper, rollout, ..
        } = &mut lanes[i];
        if let Some((_, _, slope)) = stepper.request() {
            rollout.singular += round.read(row, slope);
            rollout.evaluations += 1;
        }
        stepper.proceed(&mut |k, x| record(&mut rollout.trajectory, times[k], x));
    }
}
