//! Analytic systems compared with textbooks: mass matrices, forces, trajectories in closed form, and the answers of an
//! independent code.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::TAU;

use lagrangian::analytic::{AnalyticModel, by_name, systems};
use lagrangian::integrate::Method;
use lagrangian::mechanics::{Jet, bias};
use lagrangian::rollout::{free, times};
use lagrangian::{Error, Rollout, RolloutOptions, State, Trajectory, rollout};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn run(model: &dyn AnalyticModel, q0: &[f64], qd0: &[f64], times: &[f64]) -> Rollout {
    let rollout = rollout(model, q0, qd0, times, &free, &RolloutOptions::truth()).unwrap();
    assert!(rollout.outcome.is_finished(), "{:?}", rollout.outcome);
    rollout
}

fn last(trajectory: &Trajectory) -> (&[f64], &[f64]) {
    let n = trajectory.dof();
    (
        &trajectory.q[trajectory.q.len() - n..],
        &trajectory.qd[trajectory.qd.len() - n..],
    )
}

fn acceleration(model: &dyn AnalyticModel, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut qdd = vec![0.0; q.len()];
    let _ = model
        .evaluator()
        .forward_dynamics(q, qd, &vec![0.0; q.len()], &mut qdd);
    qdd
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!(
            (a - b).abs() <= tolerance * (1.0 + b.abs()),
            "{a} is not {b}"
        );
    }
}

#[test]
fn the_double_pendulum_has_the_mass_matrix_and_the_forces_of_the_textbook() {
    let parameters = [
        ("mass1", 1.3),
        ("mass2", 0.7),
        ("length1", 0.8),
        ("length2", 1.1),
        ("gravity", 9.81),
    ];
    let model = by_name("double-pendulum", &parameters).unwrap();
    let [m1, m2, l1, l2, g] = parameters.map(|(_, value)| value);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..20 {
        let State { q, qd } = model.sample_state(&mut rng);
        let mut jet = Jet::default();
        model.lagrangian().jets().jet(&q, &qd, &mut jet);
        let (s, c) = (q[0] - q[1]).sin_cos();
        let off = m2 * l1 * l2 * c;
        close(
            &jet.mass_matrix,
            &[(m1 + m2) * l1 * l1, off, off, m2 * l2 * l2],
            1e-13,
        );
        let mut force = [0.0; 2];
        bias(&jet, &mut force);
        let textbook = [
            m2 * l1 * l2 * s * qd[1] * qd[1] + (m1 + m2) * g * l1 * q[0].sin(),
            -m2 * l1 * l2 * s * qd[0] * qd[0] + m2 * g * l2 * q[1].sin(),
        ];
        close(&force, &textbook, 1e-12);
    }
}

#[test]
fn a_chain_of_two_links_is_the_double_pendulum() {
    let chain = by_name("n-link-pendulum", &[("links", 2.0)]).unwrap();
    let double = by_name("double-pendulum", &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..20 {
        let State { q, qd } = double.sample_state(&mut rng);
        close(
            &acceleration(&*chain, &q, &qd),
            &acceleration(&*double, &q, &qd),
            1e-12,
        );
    }
}

#[test]
fn a_mass_on_a_spring_swings_as_a_cosine() {
    let model = by_name("mass-spring", &[("mass", 2.0), ("stiffness", 8.0)]).unwrap();
    let rollout = run(&*model, &[0.5], &[1.0], &times(20.0, 0.1).unwrap());
    for (k, t) in rollout.trajectory.t.iter().enumerate() {
        let (sin, cos) = (2.0 * t).sin_cos();
        close(&[rollout.trajectory.q[k]], &[0.5 * cos + 0.5 * sin], 1e-11);
        close(&[rollout.trajectory.qd[k]], &[cos - sin], 1e-11);
    }
}

#[test]
fn a_pendulum_swings_with_the_period_of_the_elliptic_integral() {
    // T = 2π √(l/g) / agm(1, cos(θ₀/2)).
    let (mut a, mut b) = (1.0_f64, 1.0_f64.cos());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    let period = TAU / 9.8_f64.sqrt() / a;
    let rollout = run(
        &*by_name("pendulum", &[]).unwrap(),
        &[2.0],
        &[0.0],
        &[0.0, 0.5 * period, period],
    );
    close(&rollout.trajectory.q, &[2.0, -2.0, 2.0], 1e-11);
}

#[test]
fn a_planet_returns_after_the_period_of_its_ellipse_and_sweeps_equal_areas() {
    let model = by_name("kepler", &[("mass", 3.0), ("mu", 2.0)]).unwrap();
    // At the perihelion of an ellipse with a = 1, e = 0.6.
    let (q0, qd0) = ([0.4, 0.0], [0.0, (2.0_f64 * 1.6 / 0.4).sqrt()]);
    let period = TAU / 2.0_f64.sqrt();
    let rollout = run(&*model, &q0, &qd0, &[0.0, 0.25, 0.5 * period, period]);
    let t = &rollout.trajectory;
    close(&t.q[4..], &[-1.6, 0.0, 0.4, 0.0], 1e-10);
    let momentum = |k: usize| t.q[2 * k] * t.qd[2 * k + 1] - t.q[2 * k + 1] * t.qd[2 * k];
    close(
        &[momentum(1), momentum(2), momentum(3)],
        &[momentum(0); 3],
        1e-12,
    );
}

#[test]
fn a_charge_circles_with_the_cyclotron_frequency_and_drifts_across_crossed_fields() {
    let parameters = [
        ("mass", 2.0),
        ("charge", 3.0),
        ("magnetic", 0.5),
        ("dimensions", 3.0),
    ];
    let model = by_name("charged-particle", &parameters).unwrap();
    let omega: f64 = 3.0 * 0.5 / 2.0;
    let radius = 1.5 / omega;
    // From the origin along x: about (0, −r), clockwise; free along z.
    let t = 4.2;
    let rollout = run(&*model, &[0.0; 3], &[1.5, 0.0, 0.25], &[0.0, t]);
    let (sin, cos) = (omega * t).sin_cos();
    close(
        last(&rollout.trajectory).0,
        &[radius * sin, -radius * (1.0 - cos), 0.25 * t],
        1e-12,
    );

    let crossed = by_name("charged-particle", &[("electric", 0.3), ("magnetic", 2.0)]).unwrap();
    let rollout = run(&*crossed, &[1.0, 1.0], &[0.0, -0.15], &[0.0, 10.0]);
    close(last(&rollout.trajectory).0, &[1.0, -0.5], 1e-12);
}

#[test]
fn relativistic_particles_accelerate_by_their_closed_forms() {
    let physical = by_name("relativistic-particle", &[("field", 1.7)]).unwrap();
    let published = by_name("relativistic-particle-published", &[("field", 1.7)]).unwrap();
    for v in [-0.999, -0.3, 0.0, 0.5, 0.99, 0.99999_f64] {
        let gamma = ((1.0 - v) * (1.0 + v)).sqrt().recip();
        let expected = 1.7 * gamma.powi(-3);
        assert!((acceleration(&*physical, &[0.3], &[v])[0] / expected - 1.0).abs() < 1e-12);
        let expected = 1.7 * gamma.powi(-5) / (1.0 + 2.0 * v * v);
        assert!((acceleration(&*published, &[0.3], &[v])[0] / expected - 1.0).abs() < 1e-12);
    }
    let rollout = run(&*physical, &[0.0], &[0.0], &[0.0, 3.0]);
    let rapid = (1.0 + 1.7_f64.powi(2) * 9.0).sqrt();
    close(last(&rollout.trajectory).0, &[(rapid - 1.0) / 1.7], 1e-11);
    close(last(&rollout.trajectory).1, &[1.7 * 3.0 / rapid], 1e-11);
}

#[test]
fn two_bodies_circle_each_other_and_bodies_keep_their_momenta() {
    let pair = by_name("n-body", &[("bodies", 2.0)]).unwrap();
    // Masses 1 at distance 2: v² = 1/4, period 2π/0.5.
    let rollout = run(
        &*pair,
        &[1.0, 0.0, -1.0, 0.0],
        &[0.0, 0.5, 0.0, -0.5],
        &[0.0, TAU, 2.0 * TAU],
    );
    close(&rollout.trajectory.q[4..8], &[-1.0, 0.0, 1.0, 0.0], 1e-10);
    close(&rollout.trajectory.q[8..], &[1.0, 0.0, -1.0, 0.0], 1e-10);

    let three = by_name("n-body", &[("dimensions", 3.0)]).unwrap();
    let start = three.sample_state(&mut ChaCha8Rng::seed_from_u64(3));
    let rollout = run(&*three, &start.q, &start.qd, &[0.0, 5.0]);
    let total = |qd: &[f64]| [0, 1, 2].map(|axis| qd.iter().skip(axis).step_by(3).sum::<f64>());
    close(
        &total(last(&rollout.trajectory).1),
        &total(&start.qd),
        1e-11,
    );
}

#[test]
fn every_system_is_found_by_its_name_and_samples_states_that_move() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for entry in systems() {
        let model = by_name(entry.name, &[]).unwrap();
        assert_eq!(model.name(), entry.name);
        for start in [model.sample_state(&mut rng), model.sample_start(&mut rng)] {
            assert_eq!(start.q.len(), model.coordinates().dof());
            let options = RolloutOptions::default();
            let rollout =
                rollout(&*model, &start.q, &start.qd, &[0.0, 0.1], &free, &options).unwrap();
            assert!(
                rollout.outcome.is_finished(),
                "{}: {:?}",
                entry.name,
                rollout.outcome
            );
        }
    }
}

#[test]
fn unknown_names_and_values_outside_their_domain_are_refused_with_what_there_is() {
    let refusal = |name, parameters: &[(&str, f64)]| by_name(name, parameters).err().unwrap();
    assert!(
        refusal("pendulums", &[])
            .to_string()
            .contains("double-pendulum")
    );
    assert!(
        refusal("pendulum", &[("lenght", 1.0)])
            .to_string()
            .contains("length")
    );
    for (name, parameter, value) in [
        ("pendulum", "length", 0.0),
        ("pendulum", "gravity", f64::NAN),
        ("n-link-pendulum", "links", 2.5),
        ("n-body", "bodies", 1e9),
        ("charged-particle", "dimensions", 1.0),
    ] {
        assert!(matches!(
            refusal(name, &[(parameter, value)]),
            Error::Argument { .. }
        ));
    }
}

/// The error at t = 1 of a rollout of `model` with this step.
fn error_with_step(
    model: &dyn AnalyticModel,
    method: Method,
    step: f64,
    truth: &Trajectory,
) -> f64 {
    let options = RolloutOptions {
        method,
        step,
        ..RolloutOptions::default()
    };
    let n = truth.dof();
    let start = (&truth.q[..n], &truth.qd[..n]);
    let rollout = rollout(model, start.0, start.1, &[0.0, 1.0], &free, &options).unwrap();
    let ((q, qd), (q_true, qd_true)) = (last(&rollout.trajectory), last(truth));
    let pairs = q.iter().zip(q_true).chain(qd.iter().zip(qd_true));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn methods_with_a_fixed_step_converge_with_their_order_also_where_forces_depend_on_velocity() {
    // Steps so short that only the leading term of the error remains.
    for (name, q0, qd0, parts) in [
        ("double-pendulum", vec![1.0, -0.5], vec![0.5, 1.0], 400.0),
        ("charged-particle", vec![1.0, -0.5], vec![0.5, 1.0], 50.0),
        ("pendulum", vec![1.0], vec![0.5], 100.0),
    ] {
        let model = by_name(name, &[]).unwrap();
        let truth = run(&*model, &q0, &qd0, &[0.0, 1.0]).trajectory;
        for method in [Method::Rk4, Method::StormerVerlet, Method::ImplicitMidpoint] {
            let error = |parts: f64| error_with_step(&*model, method, 1.0 / parts, &truth);
            let order = (error(parts) / error(2.0 * parts)).log2();
            let expected = f64::from(method.order());
            assert!(
                (order - expected).abs() < 0.25,
                "{name}, {}: order {order}",
                method.name()
            );
        }
    }
}

#[test]
fn an_independent_code_gives_the_same_double_pendulum_for_about_as_many_evaluations() {
    let golden = include_str!("../golden/double_pendulum.csv");
    let header = golden.lines().next().unwrap();
    let evaluations: Vec<f64> = header
        .rsplit("evaluations ")
        .next()
        .unwrap()
        .split(' ')
        .map(|n| n.parse().unwrap())
        .collect();
    let rows: Vec<Vec<f64>> = golden
        .lines()
        .skip(2)
        .map(|line| {
            line.split(',')
                .map(|value| value.parse().unwrap())
                .collect()
        })
        .collect();
    let model = by_name("double-pendulum", &[]).unwrap();
    // The third start is violent: rounding has grown more there.
    for (index, tolerance) in [1e-10, 1e-10, 1e-8].into_iter().enumerate() {
        let rows: Vec<&Vec<f64>> = rows.iter().filter(|row| row[0] as usize == index).collect();
        let times: Vec<f64> = rows.iter().map(|row| row[1]).collect();
        let rollout = run(&*model, &rows[0][2..4], &rows[0][4..6], &times);
        for (k, row) in rows.iter().enumerate() {
            close(
                &rollout.trajectory.q[2 * k..2 * k + 2],
                &row[2..4],
                tolerance,
            );
            close(
                &rollout.trajectory.qd[2 * k..2 * k + 2],
                &row[4..6],
                tolerance,
            );
        }
        let ratio = rollout.evaluations as f64 / evaluations[index];
        assert!((0.8..1.2).contains(&ratio), "{ratio} times the evaluations");
    }
}

#[test]
fn the_cart_pole_has_the_mass_matrix_and_the_forces_of_the_textbook() {
    // (M + m) ẍ + m l θ̈ cos θ − m l θ̇² sin θ = u, m l ẍ cos θ + m l² θ̈ + m g l sin θ = 0.
    let values = [
        ("cart", 1.7),
        ("mass", 0.3),
        ("length", 0.6),
        ("gravity", 9.81),
    ];
    let model = by_name("cart-pole", &values).unwrap();
    let [cart, m, l, g] = values.map(|(_, value)| value);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..20 {
        let State { q, qd } = model.sample_state(&mut rng);
        let mut jet = Jet::default();
        model.lagrangian().jets().jet(&q, &qd, &mut jet);
        let (s, c) = q[1].sin_cos();
        close(
            &jet.mass_matrix,
            &[cart + m, m * l * c, m * l * c, m * l * l],
            1e-13,
        );
        let mut force = [0.0; 2];
        bias(&jet, &mut force);
        close(&force, &[-m * l * s * qd[1] * qd[1], m * g * l * s], 1e-12);
    }
}

#[test]
fn the_furuta_pendulum_has_the_equations_of_the_literature() {
    // Cazzolato, Prime (2011), equations 33 and 34, for a point mass, with their θ₂ = θ and our signs.
    let values = [
        ("inertia", 0.02),
        ("arm", 0.3),
        ("mass", 0.15),
        ("length", 0.4),
        ("gravity", 9.81),
    ];
    let model = by_name("furuta-pendulum", &values).unwrap();
    let [j, r, m, l, g] = values.map(|(_, value)| value);
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for _ in 0..20 {
        let State { q, qd } = model.sample_state(&mut rng);
        let mut jet = Jet::default();
        model.lagrangian().jets().jet(&q, &qd, &mut jet);
        let (s, c) = q[1].sin_cos();
        let arm = j + m * r * r + m * l * l * s * s;
        close(
            &jet.mass_matrix,
            &[arm, m * r * l * c, m * r * l * c, m * l * l],
            1e-13,
        );
        let mut force = [0.0; 2];
        bias(&jet, &mut force);
        let textbook = [
            2.0 * m * l * l * s * c * qd[0] * qd[1] - m * r * l * s * qd[1] * qd[1],
            -m * l * l * s * c * qd[0] * qd[0] + m * g * l * s,
        ];
        close(&force, &textbook, 1e-12);
    }
}

#[test]
fn the_two_link_arm_has_the_mass_matrix_and_the_gravity_of_the_textbook() {
    // Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, section 6.4, uniform rods and a mass at the tip.
    let values = [
        ("mass1", 1.2),
        ("mass2", 0.7),
        ("length1", 0.5),
        ("length2", 0.3),
        ("payload", 0.4),
    ];
    let model = by_name("two-link-arm", &values).unwrap();
    let [m1, m2, l1, l2, load] = values.map(|(_, value)| value);
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    for _ in 0..20 {
        let State { q, qd } = model.sample_state(&mut rng);
        let mut jet = Jet::default();
        model.lagrangian().jets().jet(&q, &qd, &mut jet);
        let c = q[1].cos();
        let far = m2 * l2 * l2 / 3.0 + load * l2 * l2;
        let first_moment = l1 * (0.5 * m2 * l2 + load * l2);
        let near = m1 * l1 * l1 / 3.0 + (m2 + load) * l1 * l1;
        let off = far + first_moment * c;
        close(
            &jet.mass_matrix,
            &[near + far + 2.0 * first_moment * c, off, off, far],
            1e-13,
        );
        let mut force = [0.0; 2];
        bias(&jet, &mut force);
        let h = first_moment * q[1].sin();
        let outer = 9.8 * (0.5 * m2 + load) * l2 * (q[0] + q[1]).cos();
        let inner = 9.8 * (0.5 * m1 + m2 + load) * l1 * q[0].cos();
        let textbook = [
            -h * (2.0 * qd[0] * qd[1] + qd[1] * qd[1]) + inner + outer,
            h * qd[0] * qd[0] + outer,
        ];
        close(&force, &textbook, 1e-12);
    }
}
