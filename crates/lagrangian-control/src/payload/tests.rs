//! Known loads on a known arm.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use crate::{
    Driven, FeedForward, Gains, LoopConfig, Pd, Reference, RobotChange, Sensors, Simulation,
};
use lagrangian::mechanics::Quantities;
use lagrangian::rigid::{self, LoadParameters, RigidBodies, is_body};
use lagrangian::rollout::times;
use lagrangian::{Signals, State, Trajectory};

const HOME: [f64; 7] = [0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0];

fn arm() -> RigidBodies {
    RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap()
}

/// 2 kg, 8 cm in front of the hand.
fn loaded() -> RigidBodies {
    let arm = arm();
    arm.with_payload("link_7", 2.0, [0.0, 0.0, 0.08]).unwrap()
}

/// A motion in which all joints swing about one configuration.
fn swing(seconds: f64) -> Reference {
    let t = times(seconds, 0.005).unwrap();
    let rate = |i: usize| 2.0 + 0.3 * i as f64;
    let signal = |wave: &dyn Fn(usize, f64) -> f64| {
        let rows = t.iter().flat_map(|&t| (0..7).map(move |i| (i, t)));
        rows.map(|(i, t)| wave(i, t)).collect()
    };
    let signals = Signals {
        q: signal(&|i, t| HOME[i] + 0.3 * (rate(i) * t).sin()),
        qd: signal(&|i, t| 0.3 * rate(i) * (rate(i) * t).cos()),
        qdd: signal(&|i, t| -0.3 * rate(i).powi(2) * (rate(i) * t).sin()),
        ..Signals::default()
    };
    Reference::new(Trajectory::new("swing", t, signals)).unwrap()
}

fn gains() -> Gains {
    Gains {
        kp: vec![60.0, 60.0, 40.0, 40.0, 15.0, 8.0, 2.0],
        kd: vec![6.0, 6.0, 4.0, 4.0, 0.8, 0.4, 0.1],
    }
}

/// Noise of the experiment `tracking`.
fn noisy() -> LoopConfig {
    LoopConfig {
        sensors: Sensors {
            velocity_noise: 2e-3,
            quantisation: 6e-6,
            ..Sensors::default()
        },
        limit: vec![176.0, 176.0, 110.0, 110.0, 110.0, 40.0, 40.0],
        drive_noise: 3e-4,
        ..LoopConfig::default()
    }
}

/// Motion of the arm without a load until `change`, and with it from then on; the load at the end.
fn run(config: LoopConfig, change: f64, end: f64) -> (Driven, Option<LoadParameters>, u64) {
    let (arm, loaded, reference) = (arm(), loaded(), swing(6.0));
    let mut estimator = PayloadEstimator::new(&arm, "link_7", PayloadConfig::default()).unwrap();
    let forward = FeedForward::new(&arm, &gains(), &reference, config.lead()).unwrap();
    let mut controller = PayloadFeedForward::new(forward, &mut estimator).unwrap();
    let mut simulation = Simulation::new(&arm, &start(&reference), config).unwrap();
    simulation.run(&mut controller, change);
    let robot = &loaded;
    let mut simulation = simulation.with_change(Some(RobotChange { at: 0.0, robot }));
    simulation.run(&mut controller, end);
    let driven = simulation.finish();
    (driven, estimator.load().copied(), estimator.changes())
}

fn start(reference: &Reference) -> State {
    let samples = reference.samples();
    State::new(samples.q[..7].to_vec(), samples.qd[..7].to_vec())
}

/// Largest error of a joint from `from` on.
fn largest_error(driven: &Driven, from: f64) -> f64 {
    let reference = swing(6.0);
    let mut desired = crate::Desired::new(7);
    let rows = driven
        .trajectory
        .t
        .iter()
        .zip(driven.trajectory.q.chunks_exact(7));
    let mut largest: f64 = 0.0;
    for (&t, q) in rows.filter(|(t, _)| **t >= from) {
        reference.at(t, &mut desired);
        let errors = q.iter().zip(&desired.q).map(|(a, b)| (a - b).abs());
        largest = errors.fold(largest, f64::max);
    }
    largest
}

#[test]
fn a_load_is_known_to_a_percent_within_half_a_second() {
    for config in [noisy(), LoopConfig::default()] {
        let exact = config == LoopConfig::default();
        let (_, load, changes) = run(config, 1.0, 1.5);
        let load = load.unwrap();
        // Without noise, even the smallest integration error indicates a change.
        assert!(changes == 1 || exact, "{changes} changes");
        assert!((load[0] - 2.0).abs() < 0.02, "{load:?}");
        assert!((load[3] - 0.16).abs() < 0.01, "{load:?}");
        assert!(is_body(&load), "{load:?}");
    }
}

#[test]
fn the_arm_is_back_on_its_path_within_half_a_second() {
    let (driven, ..) = run(noisy(), 1.0, 3.0);
    let (before, after) = (run(noisy(), 1.0, 1.0).0, largest_error(&driven, 1.5));
    assert!(after < 2.0 * largest_error(&before, 0.0), "{after}");
}

#[test]
fn without_a_load_the_torques_are_those_of_the_feed_forward_alone() {
    let (driven, load, changes) = run(noisy(), 3.0, 3.0);
    assert!(load.is_none() && changes == 0, "{load:?} {changes}");
    let (arm, reference, config) = (arm(), swing(6.0), noisy());
    let mut forward = FeedForward::new(&arm, &gains(), &reference, config.lead()).unwrap();
    let mut simulation = Simulation::new(&arm, &start(&reference), config).unwrap();
    simulation.run(&mut forward, 3.0);
    assert_eq!(simulation.finish().trajectory, driven.trajectory);
}

/// Ticks of the arm with a load, under feedback only: time, state, and the torque since the last tick.
fn ticks() -> Vec<(f64, State, Vec<f64>)> {
    let (loaded, reference) = (loaded(), swing(2.0));
    let mut pd = Pd::new(gains(), &reference).unwrap();
    let mut simulation = Simulation::new(&loaded, &start(&reference), noisy()).unwrap();
    let mut ticks = Vec::new();
    while simulation.time() < 1.0 {
        let (t, before) = (simulation.time(), simulation.torque().to_vec());
        simulation.tick(&mut pd);
        ticks.push((t, simulation.measured().clone(), before));
    }
    ticks
}

#[test]
fn measurements_that_are_not_finite_are_skipped() {
    let (arm, mut count) = (arm(), 0);
    let mut base = arm.dynamics();
    let mut estimator = PayloadEstimator::new(&arm, "link_7", PayloadConfig::default()).unwrap();
    for (t, state, tau) in ticks() {
        count += 1;
        let (mut state, mut tau, mut t) = (state, tau, t);
        match count % 100 {
            20 => state.q[3] = f64::NAN,
            40 => state.qd[0] = f64::INFINITY,
            60 => tau[1] = f64::NAN,
            70 => state.qd[2] = 1e200,
            80 => t = f64::NAN,
            _ => {}
        }
        estimator.observe(&mut base, t, &state, &tau);
        assert!(estimator.load().is_none_or(is_body), "tick {count}");
    }
    assert!(
        (estimator.load().unwrap()[0] - 2.0).abs() < 0.1,
        "{:?}",
        estimator.load()
    );
}

#[test]
fn every_estimate_is_a_body_so_that_the_mass_matrix_stays_definite() {
    // Torques that do not belong to a load: half of them correspond to a negative mass.
    let arm = arm();
    let mut base = arm.dynamics();
    let mut estimator = PayloadEstimator::new(&arm, "link_7", PayloadConfig::default()).unwrap();
    let mut parts = 0;
    for (k, (t, state, tau)) in ticks().into_iter().enumerate() {
        let sign = if (k / 100) % 2 == 0 { -1.0 } else { 1.0 };
        let tau: Vec<f64> = tau.iter().map(|x| sign * 5.0 * x).collect();
        estimator.observe(&mut base, t, &state, &tau);
        if let Some(load) = estimator.load() {
            parts += 1;
            assert!(is_body(load) && load[0] > 0.0, "{load:?}");
            let centre = [1, 2, 3].map(|k| load[k] / load[0]);
            let with = arm.clone().with_payload("link_7", load[0], centre).unwrap();
            let mass = Quantities::mass_matrix(&with, &state.q).unwrap();
            assert!((0..7).all(|i| mass[8 * i] > 0.0));
        }
    }
    assert!(parts > 0);
}

#[test]
fn a_load_that_is_put_down_is_noticed_too() {
    let (arm, loaded, reference) = (arm(), loaded(), swing(6.0));
    let config = noisy();
    let mut estimator = PayloadEstimator::new(&arm, "link_7", PayloadConfig::default()).unwrap();
    let forward = FeedForward::new(&arm, &gains(), &reference, config.lead()).unwrap();
    let mut controller = PayloadFeedForward::new(forward, &mut estimator).unwrap();
    let mut simulation = Simulation::new(&loaded, &start(&reference), config).unwrap();
    simulation.run(&mut controller, 1.5);
    let robot = &arm;
    let mut simulation = simulation.with_change(Some(RobotChange { at: 0.0, robot }));
    simulation.run(&mut controller, 2.0);
    let left = estimator.load().map_or(0.0, |load| load[0]);
    assert!(left < 0.02 && estimator.changes() > 0, "{left}");
}

#[test]
fn bad_settings_are_refused_with_their_name() {
    let arm = arm();
    let usual = PayloadConfig::default();
    let bad = [
        (
            "memory",
            PayloadConfig {
                memory: 0.0,
                ..usual
            },
        ),
        (
            "low_pass",
            PayloadConfig {
                low_pass: f64::NAN,
                ..usual
            },
        ),
        (
            "catch_up",
            PayloadConfig {
                catch_up: -1.0,
                ..usual
            },
        ),
        (
            "explained",
            PayloadConfig {
                explained: 1.0,
                ..usual
            },
        ),
    ];
    for (name, config) in bad {
        let error = PayloadEstimator::new(&arm, "link_7", config).err().unwrap();
        assert!(error.to_string().contains(name), "{error}");
    }
    assert!(PayloadEstimator::new(&arm, "claw", usual).is_err());
}
