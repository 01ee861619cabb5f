//! What is measured of a model that has learned a lesson.

use std::hint::black_box;
use std::time::Instant;

use super::Lesson;
use super::columns::{Measured, OWN_ENERGY};
use crate::data::{accelerations, energies, first_state};
use crate::harness::spread::upper_median;
use lagrangian::integrate::Method;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{Model, Result, Rollout, RolloutOptions, Signals, State, Trajectory};

/// Root mean square of the error of q̈ at the test states over that of q̈ itself, both in the system's own coordinates:
/// an error Δ in the chart is (∂f/∂Q) Δ there, whatever the chart.
pub(crate) fn acceleration_error(model: &dyn Model, lesson: &Lesson) -> f64 {
    let mut own = model.evaluator();
    let still = vec![0.0; model.coordinates().dof()];
    error_of(lesson, |state| {
        let mut qdd = still.clone();
        let _ = own.forward_dynamics(state.q, state.qd, &still, &mut qdd);
        qdd
    })
}

/// The same of a model that moves in (q, p), at the recorded momenta: q̈ is the rate of its q̇ along its own flow.
///
/// The q̇ of a test state may have no momentum in a learned H; that it moves in (q, p) is part of what it is given.
pub(crate) fn flow_acceleration_error(model: &dyn Model, lesson: &Lesson) -> f64 {
    if lesson.test.iter().any(|motion| motion.p.is_empty()) {
        return f64::NAN;
    }
    let mut own = model.evaluator();
    let Some(own) = own.phase_flow() else {
        return f64::NAN;
    };
    let still = vec![0.0; model.coordinates().dof()];
    error_of(lesson, |state| {
        let (mut rate, mut push) = (still.clone(), still.clone());
        let _ = own.flow(state.q, state.p, &still, &mut rate, &mut push);
        let along = |x: &[f64], slope: &[f64], time: f64| -> Vec<f64> {
            x.iter().zip(slope).map(|(x, s)| x + time * s).collect()
        };
        let [before, after] = [-MOMENT, MOMENT].map(|time| {
            let (q, p) = (along(state.q, &rate, time), along(state.p, &push, time));
            let mut velocity = still.clone();
            let _ = own.velocity(&q, &p, &mut velocity);
            velocity
        });
        let ends = before.iter().zip(&after);
        ends.map(|(before, after)| (after - before) / (2.0 * MOMENT))
            .collect()
    })
}

/// Seconds to both sides by which a rate is taken.
const MOMENT: f64 = 1e-5;

/// The error of the accelerations that `predict` gives at the test states.
fn error_of(lesson: &Lesson, mut predict: impl FnMut(Signals<&[f64]>) -> Vec<f64>) -> f64 {
    let mut exact = lesson.truth.evaluator();
    let (mut wrong, mut all) = (0.0, 0.0);
    for motion in &lesson.test {
        let still = vec![0.0; motion.dof()];
        let mut expected = still.clone();
        for k in 0..motion.len() {
            let Signals { q, qd, .. } = motion.row(k);
            let predicted = predict(motion.row(k));
            let _ = exact.forward_dynamics(q, qd, &still, &mut expected);
            let pairs = predicted.iter().zip(&expected);
            let apart: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            wrong += square(&lesson.chart.push(q, &apart));
            let state = State::new(q.to_vec(), qd.to_vec());
            let State { q, qd } = lesson.chart.to_system(&state);
            all += square(&accelerations(&*lesson.system, &q, &qd, &still));
        }
    }
    (wrong / all).sqrt()
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// The square of the distance of two places.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Steps of the data that motions take.
const AHEAD: usize = 16;

/// Errors of short motions with steps of h/2, 2 h and any size over that with the step h of the data; the largest counts.
///
/// Errors are in deviations of the motion: what the same steps make of the truth itself is taken off, so that an error of
/// the integrator is none of the model's. `method` is the one that the model is made for; one that has fixed steps alone
/// has no error with steps of any size.
pub(crate) fn step_errors(model: &dyn Model, lesson: &Lesson, method: Method) -> Result<Measured> {
    let n = model.coordinates().dof();
    let starts: Vec<State> = lesson.test.iter().map(first_state).collect();
    let times = [0.0, AHEAD as f64 * lesson.interval];
    let ends = |model: &dyn Model, options: &RolloutOptions| -> Result<Vec<Option<Vec<f64>>>> {
        let found = rollout_many(model, &starts, &times, &free, options)?;
        let end = |r: &Rollout| {
            r.outcome
                .is_finished()
                .then(|| r.trajectory.q[n..].to_vec())
        };
        Ok(found.iter().map(end).collect())
    };
    let exact = ends(&*lesson.truth, &RolloutOptions::default())?;
    let moved = exact.iter().zip(&starts);
    let moved = moved.filter_map(|(end, start)| Some(distance(end.as_ref()?, &start.q)));
    let size = (moved.sum::<f64>() / starts.len().max(1) as f64).sqrt();
    let error = |model: &dyn Model, method: Method, step: f64| -> Result<f64> {
        let options = RolloutOptions {
            method,
            step,
            ..RolloutOptions::default()
        };
        let found = ends(model, &options)?;
        let errors = found.iter().zip(&exact).map(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => distance(a, b),
            // A motion that ended is as wrong as one that stood still.
            _ => size * size,
        });
        let mean = errors.sum::<f64>() / starts.len().max(1) as f64;
        Ok(mean.sqrt() / size)
    };
    let less_truth = |step: f64| -> Result<f64> {
        Ok((error(model, method, step)? - error(&*lesson.truth, method, step)?).max(0.0))
    };
    let h = lesson.interval;
    let adaptive = match method.rule() {
        Some(_) => f64::NAN,
        None => error(model, Method::Dop853, h)?,
    };
    let trained = error(model, method, h)?;
    let (half, double) = (less_truth(0.5 * h)?, less_truth(2.0 * h)?);
    let worst = [half, double, adaptive].into_iter().fold(0.0, f64::max);
    Ok(Measured {
        figures: vec![
            ("h", trained),
            ("half", half),
            ("double", double),
            ("adaptive", adaptive),
        ],
        ..Measured::value(worst / trained)
    })
}

/// Steps of a long motion at most: a model that needs more has run away.
const MAX_STEPS: u64 = 50_000;

/// How far free motions from `count` of the test states leave the true energy over `duration`, s: the largest
/// |E(t) − E(0)| over the deviation of the energy in the data, the median of the motions. Motions that do not reach the
/// end have lost everything, 1. It is spoiled where the model does not keep an energy of its own.
pub(crate) fn energy_drift(
    model: &dyn Model,
    lesson: &Lesson,
    method: Method,
    (count, duration): (usize, f64),
) -> Result<Measured> {
    let starts: Vec<State> = lesson.test.iter().take(count).map(first_state).collect();
    let options = RolloutOptions {
        method: method.rule().map_or(Method::Dop853, |_| method),
        step: lesson.interval,
        max_steps: MAX_STEPS,
        ..RolloutOptions::default()
    };
    let times = times(duration, duration / 400.0)?;
    let motions = rollout_many(model, &starts, &times, &free, &options)?;
    let true_motions = rollout_many(&*lesson.truth, &starts, &times, &free, &options)?;
    let largest = |energy_of: &dyn Model, motion: &Trajectory| {
        let energy = energies(energy_of, motion)?;
        let apart = energy.iter().map(|e| (e - energy[0]).abs());
        Some(apart.fold(0.0, f64::max))
    };
    let median = |energy_of: &dyn Model, motions: &[Rollout]| {
        let size = deviation(energy_of, lesson)?;
        let mut all: Vec<f64> = Vec::new();
        for motion in motions {
            let drift = largest(energy_of, &motion.trajectory)? / size;
            let finished = motion.outcome.is_finished() && drift.is_finite();
            all.push(if finished { drift } else { 1.0_f64.max(drift) });
        }
        upper_median(all)
    };
    let own = median(model, &motions);
    let truth = median(&*lesson.truth, &true_motions);
    let unfinished = motions.iter().filter(|m| !m.outcome.is_finished());
    Ok(Measured {
        spoiled: own.is_none_or(|own| own > OWN_ENERGY),
        figures: vec![
            ("own_energy", own.unwrap_or(f64::NAN)),
            ("truth", truth.unwrap_or(f64::NAN)),
            ("unfinished", unfinished.count() as f64),
        ],
        ..Measured::value(median(&*lesson.truth, &motions).unwrap_or(f64::NAN))
    })
}

/// Deviation of an energy over the test states; none where the model has none.
fn deviation(energy_of: &dyn Model, lesson: &Lesson) -> Option<f64> {
    let mut all = Vec::new();
    for motion in &lesson.test {
        all.extend(energies(energy_of, motion)?);
    }
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let squares: f64 = all.iter().map(|e| (e - mean).powi(2)).sum();
    Some((squares / all.len() as f64).sqrt())
}

/// Calls in a row, and rows of which the fastest counts.
const CALLS: usize = 200;
const ROWS: usize = 10;

/// Seconds of one evaluation of the motion at one state, of q̈ or, for a model that moves in (q, p) or by a flow of its own,
/// of that flow: the fastest of some rows of calls, since other work of the machine only adds.
pub(crate) fn call_seconds(model: &dyn Model, lesson: &Lesson) -> f64 {
    let n = model.coordinates().dof();
    let still = vec![0.0; n];
    let (mut rate, mut qdd) = (vec![0.0; n], vec![0.0; n]);
    let mut evaluator = model.evaluator();
    let states: Vec<State> = lesson.test.iter().map(first_state).collect();
    let mut row = || {
        let clock = Instant::now();
        for state in states.iter().cycle().take(CALLS) {
            let _ = match evaluator.phase_flow() {
                Some(phase) => phase.flow(&state.q, &state.qd, &still, &mut rate, &mut qdd),
                None => evaluator.forward_dynamics(&state.q, &state.qd, &still, &mut qdd),
            };
            black_box(&qdd);
        }
        clock.elapsed().as_secs_f64() / CALLS as f64
    };
    (0..ROWS).map(|_| row()).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::{Reads, Size, Task};
    use super::*;
    use crate::chart::in_chart;
    use lagrangian::analytic::{DoublePendulum, System};
    use lagrangian::trajectory::Signal;

    const FEW: Size = Size {
        train: 6,
        held: 2,
        test: 6,
    };

    #[test]
    fn the_truth_makes_no_error_in_any_lesson() {
        for (task, name) in Task::TABLE {
            let lesson = task.lesson(FEW, 1).unwrap();
            let error = acceleration_error(&*lesson.truth, &lesson);
            assert!(error < 1e-12, "{name}: {error:e}");
            let steps = step_errors(&*lesson.truth, &lesson, Method::Rk4).unwrap();
            let none = [("half", 0.0), ("double", 0.0)];
            assert_eq!(steps.figures[1..3], none, "{name}");
        }
    }

    #[test]
    fn a_wrong_model_is_as_wrong_in_every_chart() {
        let errors = [Task::Swings, Task::Sheared, Task::Bent].map(|task| {
            let lesson = task.lesson(FEW, 1).unwrap();
            let light = DoublePendulum::new(&[1.0, 1.0, 1.0, 1.0, 8.0]);
            let light = in_chart(light, lesson.chart.clone());
            acceleration_error(&light, &lesson)
        });
        assert!(errors[0] > 0.1, "{errors:?}");
        for error in &errors[1..] {
            assert!((error - errors[0]).abs() < 1e-6, "{errors:?}");
        }
    }

    #[test]
    fn free_motions_of_the_truth_keep_the_energy_and_momenta_are_those_of_its_lagrangian() {
        let lesson = Task::Magnetic.lesson(FEW, 1).unwrap();
        let drift = energy_drift(&*lesson.truth, &lesson, Method::Rk4, (2, 5.0)).unwrap();
        assert!(drift.figures[0].1 < 1e-8 && drift.value.unwrap() < 1e-8);
        assert_eq!(drift.figures[2], ("unfinished", 0.0));
        let motion = &lesson.chunks.train[0];
        // p = q̇ + ½ B × q with B = 1.
        let p = &motion.p;
        assert!((p[0] - (motion.qd[0] - 0.5 * motion.q[1])).abs() < 1e-12);
        // ṗ is the rate of p along the motion.
        let rate = (p[4] - p[0]) / (motion.t[2] - motion.t[0]);
        assert!((rate - motion.pd[2]).abs() < 1e-2);
    }

    #[test]
    fn noise_is_on_what_is_learned_from_and_a_hidden_column_is_gone() {
        let clean = Task::Swings.lesson(FEW, 1).unwrap();
        let noisy = Task::Swings.lesson(FEW, 1).unwrap().noisy(0.05);
        assert_eq!(clean.test, noisy.test);
        for reads in [Reads::Motions, Reads::Torques] {
            let (clean, noisy) = (
                clean.data(&[], reads, 1).unwrap(),
                noisy.data(&[], reads, 1).unwrap(),
            );
            assert_ne!(clean.train.q, noisy.train.q);
            assert_ne!(clean.train.qdd, noisy.train.qdd);
        }
        let all = clean.data(&[], Reads::Motions, 1).unwrap();
        let data = clean.data(&[Signal::P, Signal::Pd], Reads::Motions, 1);
        assert!(data.unwrap().train.p.is_empty() && !all.train.p.is_empty());
        let without = |reads| clean.data(&[Signal::Qdd, Signal::Pd], reads, 1);
        assert!(without(Reads::Motions).is_err());
        assert!(without(Reads::Positions).is_ok() && without(Reads::States).is_ok());
        assert!(clean.data(&[], Reads::Torques, 1).unwrap().forced);
    }
}
