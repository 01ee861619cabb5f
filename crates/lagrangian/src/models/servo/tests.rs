#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::input::Input;
use super::machine::{Machine, Moving, Workspace};
use super::*;
use crate::Dataset;
use crate::fit::{FitConfig, fit};
use crate::models::Learned;
use crate::saved::Provenance;
use lagrangian_mechanics::forces::Command;
use lagrangian_motion::State;
use rand::SeedableRng;

const OFF: Command = Command {
    goal: 0.0,
    kp: 1.0,
    kd: 0.0,
    supply: 1.0,
    on: false,
};

fn layout(n: usize, friction: Friction) -> Layout {
    Layout {
        n,
        friction,
        weight: 0.5,
    }
}

fn servo(n: usize, friction: Friction) -> Servo {
    let layout = layout(n, friction);
    let parameters = layout.start(&vec![
        parameters::Joint {
            gain: 0.004,
            ..Default::default()
        };
        n
    ]);
    Servo::new(Coordinates::angles(n), layout, parameters).unwrap()
}

fn moved(machine: &Machine<f64>, start: State, seconds: f64, h: f64) -> Moving<f64> {
    let n = machine.dof();
    let (mut state, mut work) = (Moving::at(&start.q, &start.qd), Workspace::new(n));
    for _ in 0..(seconds / h).round() as usize {
        machine.step(&vec![OFF; n], h, &mut state, &mut work);
    }
    state
}

fn at_rest(q: &[f64]) -> State {
    State {
        q: q.to_vec(),
        qd: vec![0.0; q.len()],
    }
}

#[test]
fn stiction_holds_a_pendulum_below_the_friction_and_not_above() {
    let mut machine = servo(1, Friction::M1).machine;
    machine.gears[0].coulomb = 0.25;
    // 0.5 N·m · sin q = 0.25 N·m at 30°.
    let held = moved(&machine, at_rest(&[0.5]), 5.0, 0.0025);
    assert_eq!(
        (held.q[0].to_bits(), held.qd[0].to_bits()),
        (0.5_f64.to_bits(), 0)
    );
    assert!(moved(&machine, at_rest(&[0.6]), 5.0, 0.0025).q[0] < 0.5);
}

#[test]
fn without_friction_a_chain_keeps_its_energy() {
    for n in [1, 2, 3] {
        let mut machine = servo(n, Friction::M1).machine;
        machine.gears = vec![GearFriction::default(); n];
        machine.inertia[n * n - 1] += 0.01;
        if n > 1 {
            (machine.inertia[1], machine.inertia[n]) = (0.004, 0.004);
        }
        let energy = |state: &Moving<f64>| {
            let mut work = Workspace::new(n);
            machine.mechanics(state, &mut work);
            let mut energy = 0.0;
            let mut angle = 0.0;
            for i in 0..n {
                angle += state.q[i];
                energy -= machine.weight[i] * angle.cos();
                for j in 0..n {
                    energy += 0.5 * work.mass[i * n + j] * state.qd[i] * state.qd[j];
                }
            }
            energy
        };
        let start = at_rest(&[1.0, 0.4, -0.3][..n]);
        let before = energy(&Moving::at(&start.q, &start.qd));
        let after = energy(&moved(&machine, start, 0.5, 1e-5));
        assert!((after - before).abs() < 2e-3, "{n}: {before} {after}");
    }
}

#[test]
fn inverse_dynamics_undo_forward_dynamics() {
    for friction in [Friction::M1, Friction::M3, Friction::M5] {
        let servo = servo(2, friction);
        let mut evaluator = servo.evaluator();
        let (q, qd, tau) = ([0.4, -1.1], [0.7, -0.3], [0.3, -0.8]);
        let (mut qdd, mut back) = ([0.0; 2], [0.0; 2]);
        assert!(
            evaluator
                .forward_dynamics(&q, &qd, &tau, &mut qdd)
                .is_finite()
        );
        assert!(
            evaluator
                .inverse_dynamics(&q, &qd, &qdd, &mut back)
                .is_finite()
        );
        assert!(
            tau.iter().zip(back).all(|(x, y)| (x - y).abs() < 1e-9),
            "{back:?}"
        );
    }
}

#[test]
fn a_short_step_agrees_with_forward_dynamics() {
    let servo = servo(3, Friction::M3);
    let (q, qd) = ([0.4, -0.6, 0.2], [0.7, -0.3, 0.5]);
    let mut state = Moving::at(&q, &qd);
    let h = 1e-7;
    servo
        .machine
        .step(&[OFF; 3], h, &mut state, &mut Workspace::new(3));
    let mut qdd = [0.0; 3];
    let _ = servo
        .evaluator()
        .forward_dynamics(&q, &qd, &[0.0; 3], &mut qdd);
    for i in 0..3 {
        let found = (state.qd[i] - qd[i]) / h;
        assert!(
            (found - qdd[i]).abs() < 1e-3 * qdd[i].abs().max(1.0),
            "{found} {qdd:?}"
        );
    }
}

/// Logs of a servo that follows sines of several kinds, simulated.
fn logs(servo: &Servo) -> Vec<Trajectory> {
    let t: Vec<f64> = (0..800).map(|k| 0.005 * f64::from(k)).collect();
    let log = |(k, kp): (usize, f64)| {
        let w = 1.5 + k as f64;
        let goal: Vec<f64> = t
            .iter()
            .map(|t| (w * t).sin() + 0.3 * (2.7 * w * t).sin())
            .collect();
        let mut recording = Trajectory::new(format!("log {k}"), t.clone(), Signals::default());
        recording.signals.goal = goal;
        recording.signals.kp = vec![kp; t.len()];
        recording.signals.q = vec![0.0; t.len()];
        recording.signals.qd = vec![0.0; t.len()];
        let simulated = servo.follow(&recording).unwrap().trajectory;
        recording.signals.q = simulated.signals.q;
        recording.signals.qd = simulated.signals.qd;
        recording.signals.qdd = vec![0.0; t.len()];
        recording
    };
    [100.0, 300.0, 200.0, 600.0]
        .into_iter()
        .enumerate()
        .map(log)
        .collect()
}

fn fitted(logs: &[Trajectory], friction: Friction) -> Learned {
    let dataset = Dataset::new(Coordinates::angles(1), logs, &[]).unwrap();
    let config = FitConfig {
        family: ServoConfig {
            friction: Some(friction),
            weight: 0.5,
        }
        .into(),
        ..FitConfig::default()
    };
    fit(&dataset, &config, None, &mut ()).unwrap().model
}

#[test]
fn the_parameters_of_a_simulated_servo_are_recovered() {
    let mut truth = servo(1, Friction::M3);
    truth.parameters[0] = 0.5 * 0.015_f64.ln();
    truth.parameters[1] = 0.05;
    truth.machine = truth.layout.machine(&truth.parameters);
    let model = fitted(&logs(&truth), Friction::M3);
    let expected = crate::models::FittedModel::parameters(&truth);
    for (found, expected) in model.parameters().iter().zip(&expected) {
        let scale = if expected.name.starts_with("viscous") {
            0.05
        } else {
            expected.value
        };
        let error = (found.value - expected.value).abs() / scale;
        assert!(error < 0.05, "{found:?} {expected:?}");
    }
}

#[test]
fn standard_errors_grow_with_the_noise_of_the_positions_and_hold_the_truth() {
    let truth = servo(1, Friction::M1);
    let of_noise = |sigma: f64| {
        let mut logs = logs(&truth);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for log in &mut logs {
            log.add_noise(sigma, &mut rng);
            log.signals.qdd = vec![0.0; log.t.len()];
        }
        fitted(&logs, Friction::M1).parameters()
    };
    let [little, much] = [1e-3, 1e-2].map(of_noise);
    let expected = crate::models::FittedModel::parameters(&truth);
    for (a, b) in little.iter().zip(&much) {
        // The phase of the truth is 0, which is not a parameter.
        let truth = expected
            .iter()
            .find(|p| p.name == b.name)
            .map_or(0.0, |p| p.value);
        let (Some(small), Some(large)) = (a.standard_error, b.standard_error) else {
            // The weight is the unit of the others.
            assert!(a.name.starts_with("weight"), "{a:?}");
            continue;
        };
        let growth = large / small;
        assert!((2.0..50.0).contains(&growth), "{a:?} {b:?}");
        // The ridge towards the start shifts parameters in addition to the noise.
        let error = (b.value - truth).abs();
        assert!(error < 5.0 * large + 0.02 * truth.abs(), "{b:?} {truth:?}");
    }
}

#[test]
fn a_saved_servo_moves_as_before() {
    let servo = servo(2, Friction::M6).with_errors(vec![0.25; 34]).unwrap();
    let saved = Learned::from(servo.clone())
        .save(Provenance::of_seed(0))
        .unwrap();
    let loaded = Learned::load(&saved).unwrap();
    let again = loaded.downcast_ref::<Servo>().unwrap();
    assert_eq!(
        (again.friction(), &again.parameters),
        (Friction::M6, &servo.parameters)
    );
    assert_eq!(again.machine, servo.machine);
    assert_eq!(again.errors, servo.errors);
}

#[test]
fn a_recording_without_goals_is_refused() {
    let servo = servo(1, Friction::M3);
    let mut log = logs(&servo).remove(0);
    log.signals.goal.clear();
    let refused = servo.follow(&log).unwrap_err().to_string();
    assert!(refused.contains("no goals"), "{refused}");
}

#[test]
fn a_load_that_only_passes_zero_leaves_the_drive_on() {
    let signals = Signals {
        goal: vec![0.0; 5],
        enabled: vec![3.0, 0.0, -2.0, 0.0, 0.0],
        ..Signals::default()
    };
    let input = Input::of(&signals, 1);
    let on: Vec<bool> = (0..5).map(|k| input.at(k)[0].on).collect();
    assert_eq!(on, [true, true, true, false, false]);
}
