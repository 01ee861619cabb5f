//! Variational integrators: their conserved quantities, their order, and that only the action matters.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::integrate::{Method, Rule, Variational};
use lagrangian::mechanics::{Dissipation, Mechanical, Outcome, Scaling, Slopes};
use lagrangian::models::Lnn;
use lagrangian::rollout::{free, times};
use lagrangian::{Coordinates, LnnConfig, Model, Rollout, RolloutOptions, Trajectory, rollout};

const RULES: [Method; 2] = [Method::VariationalMidpoint, Method::VariationalTrapezoidal];

fn run(
    model: &dyn Model,
    start: (&[f64], &[f64]),
    duration: f64,
    step: f64,
    method: Method,
) -> Rollout {
    let options = RolloutOptions {
        method,
        step,
        max_steps: 10_000_000,
        ..RolloutOptions::default()
    };
    let samples = times(duration, (duration / 500.0).max(step)).unwrap();
    rollout(model, start.0, start.1, &samples, &free, &options).unwrap()
}

fn energy_error(model: &dyn Model, t: &Trajectory) -> f64 {
    let mut energy = vec![0.0; t.len()];
    assert!(
        model
            .evaluator()
            .energy(&t.q, &t.qd, &mut energy)
            .is_finite()
    );
    energy
        .iter()
        .fold(0.0, |worst, e| worst.max((e - energy[0]).abs()))
}

#[test]
fn the_energy_error_of_a_double_pendulum_stays_bounded_where_its_mass_matrix_turns() {
    let model = by_name("double-pendulum", &[]).unwrap();
    for method in RULES {
        let error = |duration: f64| {
            let rollout = run(&*model, (&[0.6, -0.4], &[0.0, 0.0]), duration, 0.02, method);
            assert_eq!(rollout.outcome, Outcome::Finished);
            energy_error(&*model, &rollout.trajectory)
        };
        let (short, long) = (error(20.0), error(2000.0));
        println!("{method:?}: {short:.2e} J in 10³ steps, {long:.2e} J in 10⁵");
        assert!(long < 1.3 * short, "{method:?}: {long:e} after {short:e}");
    }
}

#[test]
fn the_angular_momentum_of_an_orbit_is_kept_to_rounding() {
    let model = by_name("kepler", &[]).unwrap();
    for method in RULES {
        let rollout = run(&*model, (&[1.0, 0.0], &[0.0, 0.8]), 500.0, 0.02, method);
        assert_eq!(rollout.outcome, Outcome::Finished);
        let t = &rollout.trajectory;
        let states = t.q.chunks_exact(2).zip(t.qd.chunks_exact(2));
        let worst = states
            .map(|(q, v)| (q[0] * v[1] - q[1] * v[0] - 0.8).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-11, "{method:?}: {worst:e}");
    }
}

#[test]
fn both_rules_converge_with_the_second_order() {
    for (system, q, v) in [
        ("double-pendulum", vec![1.0, -0.5], vec![0.3, 0.8]),
        ("relativistic-particle", vec![0.4], vec![0.5]),
        ("charged-particle", vec![1.0, 0.2], vec![0.1, 1.0]),
    ] {
        let model = by_name(system, &[]).unwrap();
        let truth = rollout(
            &*model,
            &q,
            &v,
            &[0.0, 1.0],
            &free,
            &RolloutOptions::truth(),
        )
        .unwrap();
        for method in RULES {
            let error = |step: f64| {
                let options = RolloutOptions {
                    method,
                    step,
                    ..RolloutOptions::default()
                };
                let found = rollout(&*model, &q, &v, &[0.0, 1.0], &free, &options).unwrap();
                let pairs = found.trajectory.q.iter().zip(&truth.trajectory.q);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let order = (error(0.02) / error(0.01)).log2();
            assert!((order - 2.0).abs() < 0.1, "{system} {method:?}: {order}");
        }
    }
}

#[test]
fn the_trapezoidal_rule_is_the_leapfrog_where_the_mass_matrix_is_constant() {
    let model = by_name("pendulum", &[]).unwrap();
    let start: (&[f64], &[f64]) = (&[2.0], &[0.5]);
    let leapfrog = run(&*model, start, 20.0, 0.05, Method::StormerVerlet);
    let found = run(&*model, start, 20.0, 0.05, Method::VariationalTrapezoidal);
    let pairs = leapfrog.trajectory.q.iter().zip(&found.trajectory.q);
    assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-10);
}

/// A step is symplectic where the Jacobian A of (q, p) ↦ (q₁, p₁) satisfies Aᵀ J A = J; here for a random network, which
/// is not a quadratic function of the velocity.
#[test]
fn a_step_is_symplectic_for_any_lagrangian() {
    let config = LnnConfig {
        width: 16,
        ..LnnConfig::default()
    };
    let lnn = Lnn::random(Coordinates::angles(2), config, Scaling::identity(2), 3).unwrap();
    let model = Mechanical::conservative(lnn);
    for rule in [Rule::Midpoint, Rule::Trapezoidal] {
        let mut mechanics = model.mechanics().unwrap();
        let mut slopes =
            |_: f64, q: &[f64], v: &[f64], s: &mut Slopes| mechanics.slopes(q, v, &[0.0; 2], s);
        let mut start = Slopes::new(2);
        slopes(0.0, &[0.3, -1.0], &[0.5, 0.2], &mut start);
        let p = &start.momentum;
        let mut map = |x: [f64; 4]| {
            let (mut q, mut p, mut v) = ([x[0], x[1]], [x[2], x[3]], [0.5, 0.2]);
            Variational::new(2, rule)
                .advance(&mut slopes, (0.0, 0.1), &mut q, &mut p, &mut v)
                .unwrap();
            [q[0], q[1], p[0], p[1]]
        };
        let x = [0.3, -1.0, p[0], p[1]];
        let h = 1e-5;
        let columns: Vec<[f64; 4]> = (0..4)
            .map(|j| {
                let (mut ahead, mut behind) = (x, x);
                ahead[j] += h;
                behind[j] -= h;
                let (a, b) = (map(ahead), map(behind));
                [0, 1, 2, 3].map(|i| (a[i] - b[i]) / (2.0 * h))
            })
            .collect();
        for i in 0..4 {
            for j in 0..4 {
                let (a, b) = (columns[i], columns[j]);
                let form = a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1];
                let expected = if j == i + 2 {
                    1.0
                } else if i == j + 2 {
                    -1.0
                } else {
                    0.0
                };
                assert!((form - expected).abs() < 1e-9, "{rule:?} {i} {j}: {form}");
            }
        }
    }
}

#[test]
fn friction_and_drives_enter_by_the_principle_of_dalembert() {
    let spring = by_name("mass-spring", &[]).unwrap();
    let damped =
        Mechanical::dissipative(spring.lagrangian(), Dissipation::viscous(vec![0.3])).unwrap();
    let drive = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = (3.0 * t).sin();
    let end = |options: &RolloutOptions| {
        let found = rollout(&damped, &[1.0], &[0.0], &[0.0, 5.0], &drive, options).unwrap();
        found.trajectory.q[1]
    };
    let truth = end(&RolloutOptions::truth());
    for method in RULES {
        let error = |step: f64| {
            (end(&RolloutOptions {
                method,
                step,
                ..RolloutOptions::default()
            }) - truth)
                .abs()
        };
        let order = (error(0.02) / error(0.01)).log2();
        assert!((order - 2.0).abs() < 0.1, "{method:?}: {order}");
    }
}

#[test]
fn a_step_longer_than_the_motion_can_follow_is_an_outcome() {
    let model = by_name("pendulum", &[("length", 0.1)]).unwrap();
    let rollout = run(
        &*model,
        (&[1.0], &[0.0]),
        100.0,
        1.0,
        Method::VariationalMidpoint,
    );
    let ended = matches!(
        rollout.outcome,
        Outcome::Diverged { .. } | Outcome::Finished
    );
    assert!(ended && rollout.trajectory.q.iter().all(|q| q.is_finite()));
}
