//! Laws of controllers on robots that are known exactly.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::rollout::times;
use lagrangian::{Model, Signals, State, Trajectory};

/// A smooth motion of the arm, known in closed form.
fn swing(seconds: f64) -> Reference {
    let t = times(seconds, 0.005).unwrap();
    let wave = |i: usize, t: f64| {
        let (a, w) = ([0.6, 0.9][i], [2.0, 3.1][i]);
        let phase = w * t;
        [
            a * phase.sin(),
            a * w * phase.cos(),
            -a * w * w * phase.sin(),
        ]
    };
    let signal = |d: usize| {
        t.iter()
            .flat_map(|&t| (0..2).map(move |i| wave(i, t)[d]))
            .collect()
    };
    let signals = Signals {
        q: signal(0),
        qd: signal(1),
        qdd: signal(2),
        ..Signals::default()
    };
    Reference::new(Trajectory::new("swing", t, signals)).unwrap()
}

fn start(reference: &Reference) -> State {
    let n = reference.dof();
    let samples = reference.samples();
    State::new(samples.q[..n].to_vec(), samples.qd[..n].to_vec())
}

/// Root mean square tracking error of all coordinates over the second half of the motion.
fn error(driven: &Driven, reference: &Reference) -> f64 {
    let n = reference.dof();
    let mut desired = Desired::new(n);
    let (mut sum, mut count) = (0.0, 0.0);
    for (k, &t) in driven.trajectory.t.iter().enumerate() {
        if t < 0.5 * reference.end() {
            continue;
        }
        reference.at(t, &mut desired);
        for i in 0..n {
            sum += (desired.q[i] - driven.trajectory.q[k * n + i]).powi(2);
            count += 1.0;
        }
    }
    (sum / count).sqrt()
}

fn drive(
    robot: &dyn Model,
    controller: &mut dyn Controller,
    reference: &Reference,
    config: LoopConfig,
) -> Driven {
    let mut simulation = Simulation::new(robot, &start(reference), config).unwrap();
    simulation.run(controller, reference.end());
    let driven = simulation.finish();
    assert_eq!(driven.outcome, LoopOutcome::Finished);
    driven
}

fn arm() -> Box<dyn AnalyticModel> {
    by_name("two-link-arm", &[]).unwrap()
}

#[test]
fn a_model_of_the_robot_tracks_a_hundred_times_better_than_feedback_alone() {
    let (arm, reference, config) = (arm(), swing(4.0), LoopConfig::default());
    let gains = Gains::uniform(2, 5.0, 0.5);
    let mut pd = Pd::new(gains.clone(), &reference).unwrap();
    let alone = error(
        &drive(&*arm, &mut pd, &reference, config.clone()),
        &reference,
    );
    let mut forward = FeedForward::new(&*arm, &gains, &reference, config.lead()).unwrap();
    let with = error(
        &drive(&*arm, &mut forward, &reference, config.clone()),
        &reference,
    );
    let gains = Gains::uniform(2, 100.0, 20.0);
    let mut computed = ComputedTorque::new(&*arm, gains, &reference).unwrap();
    let linear = error(&drive(&*arm, &mut computed, &reference, config), &reference);
    assert!(alone > 0.1, "{alone}");
    assert!(with < 1e-2 * alone, "{with} against {alone}");
    assert!(linear < 5e-2 * alone, "{linear} against {alone}");
}

#[test]
fn computed_torque_makes_the_error_decay_as_a_linear_oscillator() {
    let (arm, reference) = (arm(), swing(2.0));
    let config = LoopConfig {
        rate: 5000.0,
        substeps: 1,
        ..LoopConfig::default()
    };
    let gains = Gains::uniform(2, 25.0, 10.0);
    let mut controller = ComputedTorque::new(&*arm, gains, &reference).unwrap();
    let mut begin = start(&reference);
    begin.q[1] += 0.2;
    let mut simulation = Simulation::new(&*arm, &begin, config).unwrap();
    simulation.run(&mut controller, 0.4);
    let mut desired = Desired::new(2);
    reference.at(simulation.time(), &mut desired);
    // e(t) = e₀ (1 + 5 t) e^(−5 t).
    let expected = -0.2 * 3.0 * (-2.0f64).exp();
    let (q, _) = simulation.state();
    assert!(
        (desired.q[1] - q[1] - expected).abs() < 2e-3,
        "{} is not {expected}",
        desired.q[1] - q[1]
    );
    assert!((desired.q[0] - q[0]).abs() < 2e-3);
}

#[test]
fn gravity_compensation_holds_an_arm_where_it_is() {
    let arm = arm();
    let mut controller = GravityCompensation::new(&*arm, 0.1);
    let begin = State::new(vec![0.7, -0.4], vec![0.0; 2]);
    let mut simulation = Simulation::new(&*arm, &begin, LoopConfig::default()).unwrap();
    simulation.run(&mut controller, 5.0);
    let (q, _) = simulation.state();
    assert!(
        q.iter().zip(&begin.q).all(|(a, b)| (a - b).abs() < 1e-9),
        "{q:?}"
    );
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let (arm, reference) = (arm(), swing(1.0));
    let sensors = Sensors {
        position_noise: 1e-3,
        velocity_noise: 1e-2,
        quantisation: 1e-4,
        ..Sensors::default()
    };
    let run = |seed| {
        let config = LoopConfig {
            sensors,
            seed,
            ..LoopConfig::default()
        };
        let mut pd = Pd::new(Gains::uniform(2, 5.0, 0.5), &reference).unwrap();
        drive(&*arm, &mut pd, &reference, config)
    };
    let [a, b, c] = [run(3), run(3), run(4)];
    assert_eq!((&a.trajectory, &a.measured), (&b.trajectory, &b.measured));
    assert_ne!(a.measured, c.measured);
    let steps = |x: f64| ((x / 1e-4) - (x / 1e-4).round()).abs() < 1e-6;
    assert!(
        a.measured.q.iter().all(|&q| steps(q)),
        "an encoder reads whole steps"
    );
}

#[test]
fn a_delayed_torque_acts_so_many_ticks_later_and_limits_hold() {
    let arm = arm();
    let begin = State::new(vec![0.0; 2], vec![0.0; 2]);
    let config = LoopConfig {
        actuation_delay: 3,
        limit: vec![2.0, 0.0],
        ..LoopConfig::default()
    };
    let mut simulation = Simulation::new(&*arm, &begin, config).unwrap();
    let mut step = |_: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau.fill(5.0);
    simulation.run(&mut step, 0.02);
    let driven = simulation.finish();
    let tau = driven.trajectory.signals.tau;
    assert_eq!(&tau[..8], &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    assert_eq!(driven.saturated, 7);
}

#[test]
fn a_late_sensor_shows_the_state_of_so_many_ticks_ago() {
    let (arm, reference) = (arm(), swing(1.0));
    let config = LoopConfig {
        sensor_delay: 4,
        ..LoopConfig::default()
    };
    let mut pd = Pd::new(Gains::uniform(2, 5.0, 0.5), &reference).unwrap();
    let driven = drive(&*arm, &mut pd, &reference, config);
    assert_eq!(
        driven.measured.q[100 * 2..],
        driven.trajectory.q[96 * 2..driven.trajectory.q.len() - 8]
    );
}

#[test]
fn a_controller_that_loses_its_mind_is_replaced_by_no_torque() {
    let arm = arm();
    let begin = State::new(vec![0.0; 2], vec![0.0; 2]);
    let mut simulation = Simulation::new(&*arm, &begin, LoopConfig::default()).unwrap();
    let mut mad = |_: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau.fill(f64::NAN);
    simulation.run(&mut mad, 0.1);
    let driven = simulation.finish();
    assert_eq!(
        (driven.outcome, driven.not_finite),
        (LoopOutcome::Finished, 50)
    );
}

#[test]
fn a_reference_passes_through_its_samples_and_its_derivatives_belong_together() {
    let reference = swing(1.0);
    let (mut before, mut at, mut after) = (Desired::new(2), Desired::new(2), Desired::new(2));
    let h = 1e-5;
    for k in 1..60 {
        let t = f64::from(k) * 0.0151;
        reference.at(t - h, &mut before);
        reference.at(t, &mut at);
        reference.at(t + h, &mut after);
        for i in 0..2 {
            assert!(((after.q[i] - before.q[i]) / (2.0 * h) - at.qd[i]).abs() < 1e-7);
            assert!(((after.qd[i] - before.qd[i]) / (2.0 * h) - at.qdd[i]).abs() < 1e-6);
        }
        let truth = 0.6 * (2.0 * t).sin();
        assert!((at.q[0] - truth).abs() < 1e-11);
    }
    reference.at(100.0, &mut at);
    assert_eq!(at.qd, [0.0; 2]);
}

#[test]
fn bad_settings_are_refused_with_their_name() {
    let (arm, reference) = (arm(), swing(1.0));
    let negative = Pd::new(Gains::uniform(2, -1.0, 0.0), &reference).unwrap_err();
    assert!(negative.to_string().contains("kp"), "{negative}");
    assert!(Pd::new(Gains::uniform(3, 1.0, 0.0), &reference).is_err());
    let begin = start(&reference);
    for rate in [9.0, 10_001.0, f64::NAN] {
        let config = LoopConfig {
            rate,
            ..LoopConfig::default()
        };
        assert!(Simulation::new(&*arm, &begin, config).is_err());
    }
    let mut short = reference.samples().clone();
    short.t.truncate(1);
    short.q.truncate(2);
    short.qd.truncate(2);
    short.qdd = Vec::new();
    assert!(
        Reference::new(short)
            .unwrap_err()
            .to_string()
            .contains("samples")
    );
    let mut broken = reference.samples().clone();
    broken.q[5] = f64::NAN;
    assert!(Reference::new(broken).is_err());
}

#[test]
fn an_arm_that_was_carried_off_comes_back_against_its_weight() {
    let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap();
    let q = vec![0.0, 0.5, 0.0, -1.2, 0.0, 0.3, 0.0];
    let still = Signals {
        q: q.repeat(2),
        qd: vec![0.0; 14],
        ..Signals::default()
    };
    let reference = Reference::new(Trajectory::new("still", vec![0.0, 6.0], still)).unwrap();
    let (gains, config) = (Gains::uniform(7, 60.0, 12.0), LoopConfig::default());
    let mut off = q.clone();
    off[1] += 1.0;
    let mut controller = FeedForward::new(&arm, &gains, &reference, config.lead()).unwrap();
    let start = State::new(off, vec![0.0; 7]);
    let mut simulation = Simulation::new(&arm, &start, config).unwrap();
    simulation.run(&mut controller, 6.0);
    // With the gravity at the reference the arm would fall and turn on.
    let (end, _) = simulation.state();
    let farthest = end.iter().zip(&q).map(|(a, b)| (a - b).abs());
    assert!(farthest.fold(0.0, f64::max) < 1e-3, "{end:?}");
}
