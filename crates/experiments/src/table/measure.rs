//! What is measured of a model that has learned a lesson.

use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

use super::Lesson;
use lagrangian::Result;
use lagrangian::dynamics::Model;
use lagrangian::integrate::Method;
use lagrangian::rollout::{RolloutOptions, free, rollout_many, times};
use lagrangian::trajectory::Signal;
use lagrangian::{State, Trajectory};

/// Root mean square of the error of q̈ at the test states over that of q̈ itself, both in the system's own coordinates:
/// an error Δ in the chart is (∂f/∂Q) Δ there, whatever the chart.
pub(crate) fn acceleration_error(model: &dyn Model, lesson: &Lesson) -> f64 {
    let n = model.coordinates().dof().max(1);
    let (mut own, mut exact) = (model.evaluator(), lesson.truth.evaluator());
    let still = vec![0.0; n];
    let (mut predicted, mut expected) = (still.clone(), still.clone());
    let (mut wrong, mut all) = (0.0, 0.0);
    for motion in &lesson.test {
        for (q, qd) in motion.q.chunks_exact(n).zip(motion.qd.chunks_exact(n)) {
            own.forward_dynamics(q, qd, &still, &mut predicted);
            exact.forward_dynamics(q, qd, &still, &mut expected);
            let apart: Vec<f64> = predicted
                .iter()
                .zip(&expected)
                .map(|(a, b)| a - b)
                .collect();
            wrong += square(&lesson.chart.push(q, &apart));
            all += square(&size_in_system(lesson, q, qd));
        }
    }
    (wrong / all).sqrt()
}

/// The same of a model that moves in (q, p), at the recorded momenta: q̈ is the rate of its q̇ along its own flow.
///
/// The q̇ of a test state may have no momentum in a learned H; that it moves in (q, p) is what it has been told.
pub(crate) fn flow_acceleration_error(model: &dyn Model, lesson: &Lesson) -> f64 {
    let n = model.coordinates().dof().max(1);
    let (mut own, mut exact) = (model.evaluator(), lesson.truth.evaluator());
    let still = vec![0.0; n];
    let [mut rate, mut push, mut before, mut after, mut expected] = [const { Vec::new() }; 5];
    for x in [&mut rate, &mut push, &mut before, &mut after, &mut expected] {
        x.resize(n, 0.0);
    }
    let (mut wrong, mut all) = (0.0, 0.0);
    for motion in &lesson.test {
        let Some(momenta) = motion.values(Signal::P) else {
            return f64::NAN;
        };
        let states = motion.q.chunks_exact(n).zip(motion.qd.chunks_exact(n));
        for ((q, qd), p) in states.zip(momenta.chunks_exact(n)) {
            own.flow(q, p, &still, &mut rate, &mut push);
            let along = |x: &[f64], slope: &[f64], time: f64| -> Vec<f64> {
                x.iter().zip(slope).map(|(x, s)| x + time * s).collect()
            };
            own.velocity(
                &along(q, &rate, -MOMENT),
                &along(p, &push, -MOMENT),
                &mut before,
            );
            own.velocity(
                &along(q, &rate, MOMENT),
                &along(p, &push, MOMENT),
                &mut after,
            );
            exact.forward_dynamics(q, qd, &still, &mut expected);
            let ends = before.iter().zip(&after).zip(&expected);
            let apart: Vec<f64> = ends
                .map(|((before, after), exact)| (after - before) / (2.0 * MOMENT) - exact)
                .collect();
            wrong += square(&lesson.chart.push(q, &apart));
            all += square(&size_in_system(lesson, q, qd));
        }
    }
    (wrong / all).sqrt()
}

/// Seconds to both sides by which a rate is taken.
const MOMENT: f64 = 1e-5;

/// q̈ of the system in its own coordinates at a state of the chart.
fn size_in_system(lesson: &Lesson, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let State { q, qd } = lesson.chart.to_system(&State::new(q.to_vec(), qd.to_vec()));
    let mut qdd = vec![0.0; q.len()];
    let mut system = lesson.system.evaluator();
    system.forward_dynamics(&q, &qd, &vec![0.0; q.len()], &mut qdd);
    qdd
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Errors of motions that are computed with other steps than those of the data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct StepErrors {
    /// With the interval h of the data.
    pub(crate) trained: f64,
    /// With h/2.
    pub(crate) half: f64,
    /// With 2 h.
    pub(crate) double: f64,
    /// With steps of any size; none for a method that has no other.
    pub(crate) adaptive: f64,
    /// The largest of the other three over the first.
    pub(crate) ratio: f64,
}

/// Steps of the data that motions take.
const AHEAD: usize = 16;

/// Errors of short motions with other steps than that of the data, in deviations of the motion: what the same steps make of
/// the truth itself is taken off, so that an error of the integrator is none of the model's. `method` is the one that the
/// model is made for.
pub(crate) fn step_errors(
    model: &dyn Model,
    lesson: &Lesson,
    method: Method,
) -> Result<StepErrors> {
    let n = model.coordinates().dof();
    let starts: Vec<State> = lesson.test.iter().map(|m| first(m, n)).collect();
    let duration = AHEAD as f64 * lesson.interval;
    let times = [0.0, duration];
    let ends = |model: &dyn Model, options: &RolloutOptions| -> Result<Vec<Option<Vec<f64>>>> {
        let found = rollout_many(model, &starts, &times, &free, options)?;
        let end = |r: &lagrangian::rollout::Rollout| {
            let done = r.outcome.is_finished();
            done.then(|| r.trajectory.q[n..].to_vec())
        };
        Ok(found.iter().map(end).collect())
    };
    let exact = ends(&*lesson.truth, &RolloutOptions::default())?;
    let moved = exact.iter().zip(&starts).filter_map(|(end, start)| {
        let end = end.as_ref()?;
        Some(
            end.iter()
                .zip(&start.q)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>(),
        )
    });
    let size = (moved.sum::<f64>() / starts.len().max(1) as f64).sqrt();
    let error = |model: &dyn Model, method: Method, step: f64| -> Result<f64> {
        let options = RolloutOptions {
            method,
            step,
            ..RolloutOptions::default()
        };
        let found = ends(model, &options)?;
        let errors = found.iter().zip(&exact).map(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum(),
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
    let adaptive = if method.rule().is_some() {
        f64::NAN
    } else {
        error(model, Method::Dop853, h)?
    };
    let (trained, half, double) = (
        error(model, method, h)?,
        less_truth(0.5 * h)?,
        less_truth(2.0 * h)?,
    );
    let worst = [half, double, adaptive].into_iter().fold(0.0, f64::max);
    Ok(StepErrors {
        trained,
        half,
        double,
        adaptive,
        ratio: worst / trained,
    })
}

fn first(motion: &Trajectory, n: usize) -> State {
    State::new(motion.q[..n].to_vec(), motion.qd[..n].to_vec())
}

/// How far free motions leave their energy, as parts of its deviation in the data; medians of the motions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Drift {
    /// Of the model's own energy; none where it has none.
    pub(crate) own: Option<f64>,
    /// Of the true energy.
    pub(crate) exact: f64,
    /// The truth's own, computed alike.
    pub(crate) truth: f64,
    /// Motions that did not reach the end; they count as having lost everything, 1.
    pub(crate) unfinished: usize,
}

/// Steps of a long motion at most: a model that needs more has run away.
const MAX_STEPS: u64 = 50_000;

/// Largest |E(t) − E(0)| of free motions from `count` of the test states over `duration`, s.
pub(crate) fn energy_drift(
    model: &dyn Model,
    lesson: &Lesson,
    method: Method,
    (count, duration): (usize, f64),
) -> Result<Drift> {
    let n = model.coordinates().dof();
    let starts: Vec<State> = lesson
        .test
        .iter()
        .take(count)
        .map(|m| first(m, n))
        .collect();
    let options = RolloutOptions {
        method: if method.rule().is_some() {
            method
        } else {
            Method::Dop853
        },
        step: lesson.interval,
        max_steps: MAX_STEPS,
        ..RolloutOptions::default()
    };
    let times = times(duration, duration / 400.0)?;
    let motions = rollout_many(model, &starts, &times, &free, &options)?;
    let true_motions = rollout_many(&*lesson.truth, &starts, &times, &free, &options)?;
    let largest = |judge: &dyn Model, motion: &Trajectory| {
        let mut energy = vec![0.0; motion.len()];
        let has = judge.evaluator().energy(&motion.q, &motion.qd, &mut energy);
        let apart = energy.iter().map(|e| (e - energy[0]).abs());
        has.then(|| apart.fold(0.0, f64::max))
    };
    let median = |judge: &dyn Model, motions: &[lagrangian::rollout::Rollout]| {
        let size = deviation(judge, lesson)?;
        let mut all: Vec<f64> = Vec::new();
        for motion in motions {
            let drift = largest(judge, &motion.trajectory)? / size;
            let finished = motion.outcome.is_finished() && drift.is_finite();
            all.push(if finished { drift } else { 1.0_f64.max(drift) });
        }
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    Ok(Drift {
        own: median(model, &motions),
        exact: median(&*lesson.truth, &motions).unwrap_or(f64::NAN),
        truth: median(&*lesson.truth, &true_motions).unwrap_or(f64::NAN),
        unfinished: motions.iter().filter(|m| !m.outcome.is_finished()).count(),
    })
}

/// Deviation of an energy over the test states; none where the model has none.
fn deviation(judge: &dyn Model, lesson: &Lesson) -> Option<f64> {
    let mut all = Vec::new();
    let mut evaluator = judge.evaluator();
    for motion in &lesson.test {
        let mut energy = vec![0.0; motion.len()];
        if !evaluator.energy(&motion.q, &motion.qd, &mut energy) {
            return None;
        }
        all.extend(energy);
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
    let flows = !evaluator.second_order();
    let states: Vec<State> = lesson.test.iter().map(|m| first(m, n)).collect();
    let mut row = || {
        let clock = Instant::now();
        for state in states.iter().cycle().take(CALLS) {
            match flows {
                true => evaluator.flow(&state.q, &state.qd, &still, &mut rate, &mut qdd),
                false => evaluator.forward_dynamics(&state.q, &state.qd, &still, &mut qdd),
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
    use super::super::task::OnLines;
    use super::super::{Hidden, Reads, Size, Task};
    use super::*;
    use lagrangian::lagrangian::analytic::{DoublePendulum, InChart};

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
            assert!(
                steps.half == 0.0 && steps.double == 0.0,
                "{name}: {steps:?}"
            );
        }
    }

    #[test]
    fn a_wrong_model_is_as_wrong_in_every_chart() {
        let errors = [Task::Swings, Task::Sheared, Task::Bent].map(|task| {
            let lesson = task.lesson(FEW, 1).unwrap();
            let light = OnLines(DoublePendulum {
                masses: [1.0; 2],
                lengths: [1.0; 2],
                gravity: 8.0,
            });
            let light = InChart::new(light, lesson.chart.clone()).unwrap();
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
        assert!(drift.own.unwrap() < 1e-8 && drift.exact < 1e-8 && drift.unfinished == 0);
        let motion = &lesson.train[0];
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
            let (clean, noisy) = (clean.data(reads, 1).unwrap(), noisy.data(reads, 1).unwrap());
            assert_ne!(clean.train.q, noisy.train.q);
            assert_ne!(clean.train.qdd, noisy.train.qdd);
        }
        let all = clean.data(Reads::Motions, 1).unwrap();
        let data = clean.data_without(Hidden::Momenta, Reads::Motions, 1);
        assert!(data.unwrap().train.p.is_empty() && !all.train.p.is_empty());
        assert!(
            clean
                .data_without(Hidden::Accelerations, Reads::Motions, 1)
                .is_err()
        );
        assert!(
            clean
                .data_without(Hidden::Accelerations, Reads::Positions, 1)
                .is_ok()
        );
        assert!(
            clean
                .data_without(Hidden::Accelerations, Reads::States, 1)
                .is_ok()
        );
        assert!(clean.data(Reads::Torques, 1).unwrap().forced);
    }
}
