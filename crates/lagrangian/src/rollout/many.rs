//! Many rollouts at once: on all threads, and with the evaluations of neighbours in one batch.

use rayon::prelude::*;

use super::{Force, Rollout, RolloutOptions, check, record, rollout};
use crate::dynamics::{Evaluator, Model};
use crate::integrate::adaptive::Stepper;
use crate::integrate::{Dop853, Dopri5, EmbeddedPair, Method};
use crate::integrate::{Ending, Failure};
use crate::{Result, State};

/// Rollouts that share evaluations at most: as many samples as a network takes in one block.
const LANES: usize = 16;
/// Groups that there are at least, where there are as many states: work for that many threads.
const GROUPS: usize = 4;

/// Rolls `model` out from each of the states, on all threads; the same bits whatever their number.
///
/// The adaptive methods run in groups: each rollout has its own time and step, and their next evaluations make one
/// batch, which networks compute several times faster than one after another. An evaluator may round differently
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
    // By the number of states only: the groups must not depend on the number of threads.
    let lanes = starts.len().div_ceil(GROUPS).clamp(1, LANES);
    let groups: Vec<Vec<Rollout>> = starts
        .par_chunks(lanes)
        .map(|group| match options.method {
            Method::Dop853 => Ok(run::<Dop853>(model, group, times, tau, options)),
            Method::Dopri5 => Ok(run::<Dopri5>(model, group, times, tau, options)),
            _ => group
                .iter()
                .map(|start| rollout(model, &start.q, &start.qd, times, tau, options))
                .collect(),
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
    while round.gather(&mut lanes, tau) {
        round.evaluate(&mut lanes);
        round.scatter(&mut lanes, times);
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
        lane.rollout.end(ending, &mut *round.evaluator, tau);
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
    let begun = evaluator.phase(&start.q, &start.qd, &mut x0[n..]);
    let mut sink = |k: usize, x: &[f64]| record(&mut rollout.trajectory, times[k], x);
    let times = if begun { times } else { &[] };
    let stepper = Stepper::new(&x0, times, options.control(), &mut sink);
    Lane {
        stepper,
        rollout,
        begun,
    }
}

/// The evaluations that the lanes of a group ask for at one time; rows belong to the `active` lanes.
struct Round<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    n: usize,
    active: Vec<usize>,
    q: Vec<f64>,
    /// The velocities, or what else the model moves in.
    z: Vec<f64>,
    qd: Vec<f64>,
    force: Vec<f64>,
    dq: Vec<f64>,
    dz: Vec<f64>,
    alone: [Vec<f64>; 2],
}

impl<'a> Round<'a> {
    fn new(model: &'a dyn Model) -> Self {
        let n = model.coordinates().dof();
        let [q, z, qd, force, dq, dz] = [const { Vec::new() }; 6];
        Self {
            evaluator: model.evaluator(),
            n,
            active: Vec::new(),
            q,
            z,
            qd,
            force,
            dq,
            dz,
            alone: [vec![0.0; n], vec![0.0; n]],
        }
    }

    /// Collects the states asked for and the forces there; `false` when all lanes have ended.
    fn gather<P: EmbeddedPair>(&mut self, lanes: &mut [Lane<'_, P>], tau: &Force<'_>) -> bool {
        let n = self.n;
        self.active.clear();
        self.q.clear();
        self.z.clear();
        for (i, lane) in lanes.iter_mut().enumerate() {
            let Some((_, x, _)) = lane.stepper.request() else {
                continue;
            };
            self.active.push(i);
            self.q.extend_from_slice(&x[..n]);
            self.z.extend_from_slice(&x[n..]);
        }
        for signal in [&mut self.qd, &mut self.force, &mut self.dq, &mut self.dz] {
            signal.resize(self.q.len(), 0.0);
        }
        if self.evaluator.second_order() {
            self.qd.copy_from_slice(&self.z);
        } else {
            self.evaluator.velocity(&self.q, &self.z, &mut self.qd);
        }
        for (row, &i) in self.active.iter().enumerate() {
            let row = row * n..(row + 1) * n;
            if let Some((t, ..)) = lanes[i].stepper.request() {
                let (q, qd) = (&self.q[row.clone()], &self.qd[row.clone()]);
                tau(t, q, qd, &mut self.force[row]);
            }
        }
        !self.active.is_empty()
    }

    fn evaluate<P>(&mut self, lanes: &mut [Lane<'_, P>]) {
        let n = self.n;
        let Self {
            evaluator,
            q,
            z,
            force,
            dq,
            dz,
            alone: [dq_alone, dz_alone],
            ..
        } = self;
        let singular = evaluator.flow(q, z, force, dq, dz);
        for (row, &i) in self.active.iter().enumerate() {
            let rollout = &mut lanes[i].rollout;
            rollout.evaluations += 1;
            // Rare enough to ask each lane whether it was the one.
            if singular > 0 {
                let row = row * n..(row + 1) * n;
                let (q, z, force) = (&q[row.clone()], &z[row.clone()], &force[row]);
                rollout.singular += evaluator.flow(q, z, force, dq_alone, dz_alone) as u64;
            }
        }
    }

    fn scatter<P: EmbeddedPair>(&mut self, lanes: &mut [Lane<'_, P>], times: &[f64]) {
        let n = self.n;
        for (row, &i) in self.active.iter().enumerate() {
            let Lane {
                stepper, rollout, ..
            } = &mut lanes[i];
            let row = row * n..(row + 1) * n;
            if let Some((_, _, slope)) = stepper.request() {
                slope[..n].copy_from_slice(&self.dq[row.clone()]);
                slope[n..].copy_from_slice(&self.dz[row]);
            }
            stepper.proceed(&mut |k, x| record(&mut rollout.trajectory, times[k], x));
        }
    }
}
