//! Motions from which robots can be identified.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use lagrangian::mechanics::{Dissipation, Mechanical};
use lagrangian::rigid::{
    self, Excitation, ExcitationConfig, IdentifyOptions, JointLimits, RigidBodies, RobotConfig,
    excite, excite_joints,
};
use lagrangian::{Coordinates, Dataset, Model, Trajectory};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn robot(name: &str) -> (RigidBodies, Vec<JointLimits>) {
    let text = rigid::example(name).unwrap();
    let robot = RigidBodies::from_urdf(text).unwrap();
    let limits = JointLimits::of_urdf(text, robot.joints()).unwrap();
    (robot, limits)
}

fn search(
    robot: &RigidBodies,
    limits: &[JointLimits],
    config: &ExcitationConfig,
    rounds: usize,
) -> Excitation {
    excite(robot, limits, config, &mut |progress| {
        if progress.rounds < rounds {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    })
    .unwrap()
}

fn column(values: &[f64], n: usize, i: usize) -> Vec<f64> {
    values.iter().skip(i).step_by(n).copied().collect()
}

fn assert_within(plan: &Trajectory, limits: &[JointLimits], margin: f64) {
    let n = limits.len();
    for (i, limit) in limits.iter().enumerate() {
        let largest = |values: &[f64]| {
            column(values, n, i)
                .iter()
                .fold(0.0, |m: f64, x| m.max(x.abs()))
        };
        let (lower, upper) = (limit.lower.unwrap(), limit.upper.unwrap());
        // Between the times at which the bounds are checked, a sine exceeds them by 0.3 %.
        let rim = (0.5 * (1.0 - margin) - 5e-3) * (upper - lower);
        assert!(
            column(&plan.q, n, i)
                .iter()
                .all(|q| (lower + rim..=upper - rim).contains(q)),
            "{i}"
        );
        let velocity = limit.velocity.unwrap();
        assert!(largest(&plan.qd) <= 1.005 * margin * velocity);
        assert!(
            largest(&plan.qdd)
                <= 1.005
                    * limit
                        .acceleration
                        .map_or(2.0 * velocity, |a| margin * a)
                        .max(margin * velocity / 0.5)
        );
        if let Some(effort) = limit.effort.filter(|_| !plan.tau.is_empty()) {
            assert!(largest(&plan.tau) <= 1.02 * margin * effort, "{i}");
        }
        for k in [0, plan.len() - 1] {
            let still = [plan.qd[k * n + i], plan.qdd[k * n + i]];
            assert!(still.iter().all(|x| x.abs() < 1e-9));
        }
    }
}

#[test]
fn plans_stay_within_all_limits_and_begin_and_end_at_rest() {
    for name in rigid::EXAMPLES {
        let (robot, limits) = robot(name);
        for duration in [0.5, 8.0, 23.0] {
            let config = ExcitationConfig {
                duration,
                starts: 4,
                ..ExcitationConfig::default()
            };
            let found = search(&robot, &limits, &config, 2);
            assert_within(&found.plan, &limits, config.margin);
            assert_eq!(found.plan.len(), (duration * 100.0) as usize + 1);
            assert!((found.plan.t.last().unwrap() - duration).abs() < 1e-9);
            let expected = found.expected.unwrap();
            assert_eq!(expected.links.len(), robot.dof());
        }
    }
}

#[test]
fn the_same_seed_finds_the_same_plan_and_another_seed_another() {
    let (robot, limits) = robot("ur5");
    let of = |seed| {
        let config = ExcitationConfig {
            seed,
            duration: 6.0,
            starts: 4,
            ..ExcitationConfig::default()
        };
        search(&robot, &limits, &config, 5)
    };
    let (a, b, c) = (of(1), of(1), of(2));
    assert_eq!(a.plan, b.plan);
    assert_ne!(a.plan, c.plan);
    assert!(a.gain > 1.0 && a.combinations > 50);
}

#[test]
fn joints_without_a_robot_move_within_their_limits_and_not_alike() {
    let limit = JointLimits {
        lower: Some(-1.0),
        upper: Some(2.0),
        velocity: Some(1.5),
        acceleration: Some(4.0),
        effort: None,
    };
    let (limits, config) = (vec![limit; 6], ExcitationConfig::default());
    let mut rounds = 0;
    let found = excite_joints(&Coordinates::angles(6), &limits, &config, &mut |_| {
        rounds += 1;
        if rounds > 60 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .unwrap();
    assert_within(&found.plan, &limits, config.margin);
    for (i, j) in (0..6).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let (a, b) = (column(&found.plan.qd, 6, i), column(&found.plan.qd, 6, j));
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let correlation = product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt();
        assert!(correlation.abs() < 0.5, "{i} {j}: {correlation}");
    }
}

/// A UR5 with a load, rotors, offsets and friction.
fn truth(bodies: &RigidBodies) -> Mechanical<RigidBodies> {
    let n = bodies.dof();
    let loaded = bodies
        .clone()
        .with_payload("tool0", 1.5, [0.02, -0.03, 0.08])
        .unwrap();
    let arm = loaded.with_drives(vec![0.2; n], vec![0.3; n]).unwrap();
    let friction = Dissipation {
        viscous: vec![2.0; n],
        coulomb: vec![1.5; n],
        smoothing: vec![0.05; n],
        ..Dissipation::default()
    };
    Mechanical::dissipative(arm, friction).unwrap()
}

/// The root mean square torque error of a robot identified from a plan under noise, in parts of that of the torque, at random
/// states within the limits.
fn error_after(
    plan: &Trajectory,
    limits: &[JointLimits],
    truth: &Mechanical<RigidBodies>,
    seed: u64,
) -> f64 {
    let n = limits.len();
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut motion = plan.clone();
    let _ =
        truth
            .evaluator()
            .inverse_dynamics(&plan.q, &plan.qd, &plan.qdd, &mut motion.signals.tau);
    for (k, tau) in motion.signals.tau.iter_mut().enumerate() {
        let deviation = 0.01 * limits[k % n].effort.unwrap();
        *tau += deviation * 12_f64.sqrt() * (rng.random::<f64>() - 0.5);
    }
    let data = Dataset::new(truth.coordinates().clone(), &[motion], &[]).unwrap();
    let robot = RobotConfig::new(rigid::example("ur5").unwrap(), Vec::new()).unwrap();
    let options = IdentifyOptions {
        smoothing: Some(0.05),
        ..IdentifyOptions::default()
    };
    let found = rigid::identify(&data, &robot, &options).unwrap();
    let mut column = |size: &dyn Fn(&JointLimits) -> f64| -> Vec<f64> {
        (0..400 * n)
            .map(|k| {
                let size = size(&limits[k % n]);
                rng.random_range(-size..size)
            })
            .collect()
    };
    let (q, qd) = (column(&|_| 3.0), column(&|l| l.velocity.unwrap()));
    let qdd = column(&|l| 2.0 * l.velocity.unwrap());
    let torque = |model: &dyn Model| {
        let mut tau = vec![0.0; q.len()];
        let _ = model.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
        tau
    };
    let (own, other) = (torque(truth), torque(&found.model));
    let mut relative = 0.0;
    for i in 0..n {
        let (own, other) = (
            own.iter().skip(i).step_by(n),
            other.iter().skip(i).step_by(n),
        );
        let errors: f64 = own.clone().zip(other).map(|(a, b)| (a - b).powi(2)).sum();
        relative += errors / own.map(|x| x * x).sum::<f64>() / n as f64;
    }
    relative.sqrt()
}

/// The medians over five seeds after random sums of sines within the limits, and after plans of the search.
#[test]
fn what_is_identified_from_a_plan_is_twice_as_exact_as_from_random_sines() {
    let (bodies, limits) = robot("ur5");
    let truth = truth(&bodies);
    let mut errors = [Vec::new(), Vec::new()];
    for seed in 0..5 {
        let searched = ExcitationConfig {
            seed,
            duration: 10.0,
            ..ExcitationConfig::default()
        };
        let random = ExcitationConfig {
            starts: 1,
            ..searched.clone()
        };
        for (errors, (config, rounds)) in errors.iter_mut().zip([(random, 0), (searched, 150)]) {
            let found = search(&bodies, &limits, &config, rounds);
            let error = error_after(&found.plan, &limits, &truth, seed);
            println!(
                "{seed}, {rounds} rounds: gain {:.2}, error {error:.4}",
                found.gain
            );
            errors.push(error);
        }
    }
    let [random, searched] = errors.map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        errors[2]
    });
    println!("medians {random:.4} {searched:.4}");
    assert!(searched < 0.5 * random, "{searched} {random}");
}
