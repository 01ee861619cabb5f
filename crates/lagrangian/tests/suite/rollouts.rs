//! Rollouts: conserved energy, honest endings, refused input, equal bits on any number of threads, and the time for
//! which a prediction stays valid.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::integrate::{
    Control, Dop853, Dopri5, EmbeddedPair, Failure, Method, Span, adaptive,
};
use lagrangian::mechanics::{Dissipation, Mechanical, Outcome, Scaling};
use lagrangian::models::Lnn;
use lagrangian::rollout::{Hold, free, recorded, rollout_many, rollout_recorded, times};
use lagrangian::score::valid_prediction_time;
use lagrangian::{
    Coordinates, LnnConfig, Model, RolloutOptions, Signals, State, Trajectory, rollout,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn energies(model: &dyn Model, trajectory: &Trajectory) -> Vec<f64> {
    let mut energy = vec![0.0; trajectory.len()];
    assert!(
        model
            .evaluator()
            .energy(&trajectory.q, &trajectory.qd, &mut energy)
            .is_finite()
    );
    energy
}

/// Largest |E − E₀| over a trajectory, J.
fn energy_error(model: &dyn Model, trajectory: &Trajectory) -> f64 {
    let energy = energies(model, trajectory);
    energy
        .iter()
        .map(|e| (e - energy[0]).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_double_pendulum_keeps_its_energy_to_1e10_for_100_seconds() {
    let model = by_name("double-pendulum", &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let starts: Vec<State> = (0..4).map(|_| model.sample_start(&mut rng)).collect();
    let times = times(100.0, 0.1).unwrap();
    let rollouts = rollout_many(&*model, &starts, &times, &free, &RolloutOptions::truth()).unwrap();
    for rollout in &rollouts {
        assert_eq!(rollout.outcome, Outcome::Finished);
        let error = energy_error(&*model, &rollout.trajectory) / 29.4;
        println!(
            "relative energy error {error:.1e}, {} evaluations",
            rollout.evaluations
        );
        assert!(error < 1e-10, "{error:.1e}");
    }
}

#[test]
fn stormer_verlet_bounds_the_energy_error_of_a_pendulum_over_a_million_steps() {
    let model = by_name("pendulum", &[]).unwrap();
    let swing = |step: f64, duration: f64| {
        let options = RolloutOptions {
            method: Method::StormerVerlet,
            step,
            ..RolloutOptions::default()
        };
        let samples = times(duration, duration / 2000.0).unwrap();
        let rollout = rollout(&*model, &[2.0], &[0.0], &samples, &free, &options).unwrap();
        assert_eq!(rollout.outcome, Outcome::Finished);
        (energy_error(&*model, &rollout.trajectory), rollout.steps)
    };
    let (short, _) = swing(0.01, 100.0);
    let (long, steps) = swing(0.01, 10_000.0);
    println!("largest energy error {short:.2e} J in 10⁴ steps, {long:.2e} J in {steps}");
    assert_eq!(steps, 1_000_000);
    assert!(long < 1.1 * short, "{long} after {short}");
    let (fine, _) = swing(0.005, 100.0);
    assert!(
        (short / fine - 4.0).abs() < 0.2,
        "not second order: {short} and {fine}"
    );
}

#[test]
fn implicit_midpoint_keeps_the_quadratic_energy_of_a_spring_exactly() {
    let model = by_name("mass-spring", &[]).unwrap();
    let options = RolloutOptions {
        method: Method::ImplicitMidpoint,
        step: 0.1,
        ..RolloutOptions::default()
    };
    let rollout = rollout(
        &*model,
        &[1.0],
        &[0.0],
        &times(1000.0, 1.0).unwrap(),
        &free,
        &options,
    )
    .unwrap();
    assert!(energy_error(&*model, &rollout.trajectory) < 1e-12);
}

fn dense_error<P: EmbeddedPair>(rtol: f64) -> (f64, u64) {
    let control = Control {
        step: 1.0,
        rtol,
        atol: rtol,
        max_steps: 100_000,
        stop: lagrangian::Stop::default(),
    };
    let samples = times(10.0, 0.01).unwrap();
    let mut evaluations = 0;
    let mut f = |_: f64, x: &[f64], dx: &mut [f64]| {
        evaluations += 1;
        dx.copy_from_slice(&[x[1], -x[0]]);
    };
    let mut error = 0.0_f64;
    let mut sink = |k: usize, x: &[f64]| {
        error = error
            .max((x[0] - samples[k].cos()).abs())
            .max((x[1] + samples[k].sin()).abs());
    };
    let span = Span::new(&[1.0, 0.0], &samples, &control);
    adaptive::solve::<P>(&mut f, span, &mut sink);
    (error, evaluations)
}

#[test]
fn dense_output_is_as_exact_as_the_steps_and_the_8th_order_pays() {
    for rtol in [1e-6, 1e-9, 1e-12] {
        let ((fifth, many), (eighth, few)) =
            (dense_error::<Dopri5>(rtol), dense_error::<Dop853>(rtol));
        assert!(
            fifth < 100.0 * rtol && eighth < 100.0 * rtol,
            "{fifth:.1e}, {eighth:.1e} at {rtol:.0e}"
        );
        assert!(rtol > 1e-7 || few < many);
    }
}

#[test]
fn friction_brings_a_pendulum_to_rest_at_the_bottom() {
    let pendulum = by_name("pendulum", &[]).unwrap();
    let model =
        Mechanical::dissipative(pendulum.lagrangian(), Dissipation::viscous(vec![1.0])).unwrap();
    let options = RolloutOptions::default();
    let rollout = rollout(
        &model,
        &[2.0],
        &[0.0],
        &times(60.0, 0.1).unwrap(),
        &free,
        &options,
    )
    .unwrap();
    let energy = energies(&model, &rollout.trajectory);
    assert!(energy.windows(2).all(|e| e[1] <= e[0] + 1e-9));
    assert!((energy[600] + 9.8).abs() < 1e-8);
}

#[test]
fn a_rollout_into_a_singularity_diverges_with_the_part_before_it() {
    let model = by_name("kepler", &[]).unwrap();
    // Falling from rest at distance 1 into the star takes π/√8.
    let fall = std::f64::consts::PI / 8.0_f64.sqrt();
    let samples = times(2.0, 0.1).unwrap();
    let rollout = rollout(
        &*model,
        &[1.0, 0.0],
        &[0.0; 2],
        &samples,
        &free,
        &RolloutOptions::default(),
    );
    let rollout = rollout.unwrap();
    let Outcome::Diverged { t, .. } = rollout.outcome else {
        panic!("{:?}", rollout.outcome)
    };
    assert!((t - fall).abs() < 1e-6, "{t}");
    assert_eq!(rollout.trajectory.len(), 12);
    rollout.trajectory.validate().unwrap();
}

#[test]
fn faster_than_light_is_an_outcome_and_not_a_panic() {
    let model = by_name("relativistic-particle", &[]).unwrap();
    for (method, _) in Method::TABLE {
        let options = RolloutOptions {
            method,
            ..RolloutOptions::default()
        };
        let rollout = rollout(&*model, &[0.0], &[1.5], &[0.0, 1.0], &free, &options).unwrap();
        let reason = Failure::NotFinite;
        assert_eq!(
            rollout.outcome,
            Outcome::Diverged { t: 0.0, reason },
            "{}",
            method.name()
        );
    }
}

#[test]
fn an_implicit_step_too_long_to_solve_is_an_outcome() {
    let model = by_name("charged-particle", &[("magnetic", 100.0)]).unwrap();
    for method in [Method::StormerVerlet, Method::ImplicitMidpoint] {
        let options = RolloutOptions {
            method,
            step: 0.5,
            ..RolloutOptions::default()
        };
        let rollout = rollout(
            &*model,
            &[0.0; 2],
            &[1.0, 0.0],
            &[0.0, 1.0],
            &free,
            &options,
        )
        .unwrap();
        assert!(
            matches!(rollout.outcome, Outcome::Diverged { .. }),
            "{:?}",
            rollout.outcome
        );
    }
}

#[test]
fn the_step_limit_ends_every_method_with_the_part_before_it() {
    let model = by_name("pendulum", &[]).unwrap();
    for (method, _) in Method::TABLE {
        let options = RolloutOptions {
            method,
            max_steps: 20,
            ..RolloutOptions::default()
        };
        let samples = times(1e6, 0.1).unwrap();
        let rollout = rollout(&*model, &[2.0], &[0.0], &samples, &free, &options).unwrap();
        assert!(
            matches!(rollout.outcome, Outcome::StepLimit { .. }),
            "{:?}",
            rollout.outcome
        );
        assert!(rollout.trajectory.len() > 1 && rollout.steps + rollout.rejected == 20);
    }
}

#[test]
fn bad_options_are_refused_with_their_name_and_a_remedy() {
    let model = by_name("pendulum", &[]).unwrap();
    let good = RolloutOptions::default();
    let refusal = |q: &[f64], samples: &[f64], options: RolloutOptions| {
        rollout(&*model, q, &[0.0], samples, &free, &options)
            .err()
            .unwrap()
            .to_string()
    };
    let grid = [0.0, 1.0];
    for step in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(refusal(&[0.0], &grid, RolloutOptions { step, ..good }).starts_with("step is"));
    }
    assert!(refusal(&[0.0], &grid, RolloutOptions { rtol: 0.0, ..good }).starts_with("rtol is"));
    assert!(
        refusal(
            &[0.0],
            &grid,
            RolloutOptions {
                atol: f64::NAN,
                ..good
            }
        )
        .starts_with("atol is")
    );
    assert!(
        refusal(
            &[0.0],
            &grid,
            RolloutOptions {
                max_steps: 0,
                ..good
            }
        )
        .contains("at least 1")
    );
    assert!(refusal(&[0.0], &[], good).contains("at least one time"));
    assert!(refusal(&[0.0], &[0.0, 1.0, 1.0], good).contains("strictly increasing"));
    assert!(refusal(&[0.0], &[0.0, f64::NAN], good).contains("not finite"));
    assert!(refusal(&[f64::NAN], &grid, good).contains("not finite"));
    assert!(refusal(&[0.0, 0.0], &grid, good).contains("one value per coordinate"));
    assert!(
        times(-1.0, 0.1)
            .err()
            .unwrap()
            .to_string()
            .contains("not negative")
    );
    assert!(times(1.0, 0.0).is_err() && times(f64::NAN, 0.1).is_err() && times(1e9, 1e-9).is_err());
}

#[test]
fn many_rollouts_have_the_same_bits_on_one_thread_and_on_three_and_as_one_by_one() {
    let model = by_name("double-pendulum", &[]).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut starts: Vec<State> = (0..9).map(|_| model.sample_state(&mut rng)).collect();
    // One that ends at once must not disturb its neighbours.
    starts[4].qd[0] = 1e200;
    let samples = times(2.0, 0.1).unwrap();
    for (method, _) in Method::TABLE {
        let options = RolloutOptions {
            method,
            ..RolloutOptions::default()
        };
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| rollout_many(&*model, &starts, &samples, &free, &options).unwrap())
        };
        let many = on(1);
        assert_eq!(many, on(3), "{}", method.name());
        for (k, (start, rollout_of_many)) in starts.iter().zip(&many).enumerate() {
            let alone = rollout(&*model, &start.q, &start.qd, &samples, &free, &options).unwrap();
            assert_eq!(alone, *rollout_of_many, "{}", method.name());
            assert_eq!(alone.outcome.is_finished(), k != 4, "{}", method.name());
        }
    }
}

#[test]
fn many_rollouts_of_a_network_have_the_same_bits_on_any_number_of_threads() {
    let config = LnnConfig {
        width: 16,
        layers: 1,
        ..LnnConfig::default()
    };
    let [q_center, q_scale, qd_scale] = [vec![0.0; 2], vec![1.0; 2], vec![5.0; 2]];
    let scaling = Scaling {
        q_center,
        q_scale,
        qd_scale,
        energy: 10.0,
        ..Scaling::identity(2)
    };
    let lnn = Lnn::random(Coordinates::angles(2), config, scaling, 1).unwrap();
    let model = Mechanical::conservative(lnn);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let pendulum = by_name("double-pendulum", &[]).unwrap();
    let starts: Vec<State> = (0..11).map(|_| pendulum.sample_state(&mut rng)).collect();
    let samples = times(1.0, 0.1).unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let options = RolloutOptions::default();
        pool.install(|| rollout_many(&model, &starts, &samples, &free, &options).unwrap())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn every_sample_carries_the_acceleration_of_its_state_and_force() {
    let truth = by_name("double-pendulum", &[]).unwrap();
    let friction = Dissipation::viscous(vec![0.3, 0.1]);
    let model = Mechanical::dissipative(truth.lagrangian(), friction).unwrap();
    let t = times(1.0, 0.05).unwrap();
    let tau = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
        (tau[0], tau[1]) = (t.sin() - qd[1], (3.0 * t).cos() * q[0]);
    };
    let starts = [0.3, -1.1].map(|q| State::new(vec![q, 0.5], vec![1.0, -2.0]));
    for (method, _) in Method::TABLE {
        let options = RolloutOptions {
            method,
            step: 0.02,
            ..RolloutOptions::default()
        };
        let start = &starts[0];
        let alone = rollout(&model, &start.q, &start.qd, &t, &tau, &options).unwrap();
        let mut all = rollout_many(&model, &starts, &t, &tau, &options).unwrap();
        all.push(alone);
        for Signals {
            q,
            qd,
            qdd: found,
            tau,
            ..
        } in all.into_iter().map(|r| r.trajectory.signals)
        {
            let mut qdd = vec![0.0; found.len()];
            let _ = model.evaluator().forward_dynamics(&q, &qd, &tau, &mut qdd);
            let pairs = found.iter().zip(&qdd);
            let error = pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs() / (1.0 + b.abs())));
            assert!(
                found.len() == 2 * t.len() && error < 1e-12,
                "{method:?}: {error:e}"
            );
        }
    }
}

#[test]
fn recorded_forces_drive_a_rollout_held_or_interpolated() {
    // A free mass under a force that rises from 0 to 1 N in 1 s and then stays.
    let model = by_name("mass-spring", &[("stiffness", 1e-12)]).unwrap();
    let t: Vec<f64> = (0..=10).map(|k| f64::from(k) * 0.1).collect();
    let recording = Trajectory::new(
        "ramp",
        t.clone(),
        Signals {
            q: vec![0.0; t.len()],
            qd: vec![0.0; t.len()],
            tau: t.clone(),
            ..Signals::default()
        },
    );
    let speed_at = |time: f64, hold: Hold| {
        let tau = recorded(&recording, model.coordinates(), hold).unwrap();
        let options = RolloutOptions {
            method: Method::Rk4,
            step: 1e-3,
            ..RolloutOptions::default()
        };
        let rollout = rollout(&*model, &[0.0], &[0.0], &[0.0, time], &*tau, &options).unwrap();
        rollout.trajectory.qd[1]
    };
    assert!((speed_at(1.0, Hold::Linear) - 0.5).abs() < 1e-9);
    assert!((speed_at(2.0, Hold::Linear) - 1.5).abs() < 1e-9);
    // Held at the sample before, it lags by half a sample: 0.45; RK4 sees each jump once a step.
    assert!((speed_at(1.0, Hold::Previous) - 0.45).abs() < 1e-3);
    for (method, _) in Method::TABLE {
        let options = RolloutOptions {
            method,
            step: 0.03,
            ..RolloutOptions::default()
        };
        for (hold, speed) in [(Hold::Previous, 0.45), (Hold::Linear, 0.5)] {
            let rollout = rollout_recorded(&*model, &recording, hold, &options).unwrap();
            assert_eq!(
                (rollout.outcome, rollout.trajectory.len()),
                (Outcome::Finished, 11)
            );
            assert!(
                (rollout.trajectory.qd[10] - speed).abs() < 1e-9,
                "{}",
                method.name()
            );
        }
    }
    assert!(recorded(&recording, &Coordinates::lines(2), Hold::Linear).is_err());
}

/// θ = ωt, sampled on [0, 10].
fn turning(omega: f64, offset: f64) -> Trajectory {
    let t = times(10.0, 0.01).unwrap();
    let q = t.iter().map(|t| omega * t + offset).collect();
    Trajectory::new(
        String::new(),
        t.clone(),
        Signals {
            qd: vec![omega; t.len()],
            q,
            ..Signals::default()
        },
    )
}

#[test]
fn predictions_are_valid_until_their_normalised_error_exceeds_the_threshold() {
    let circle = Coordinates::angles(1);
    let truth = turning(1.0, 0.0);
    let whole_turn =
        valid_prediction_time(&truth, &turning(1.0, std::f64::consts::TAU), &circle, 0.5);
    let whole_turn = whole_turn.unwrap();
    assert!(!whole_turn.exceeded && (whole_turn.seconds - 10.0).abs() < 1e-12);

    // Error √½ · √((0.1 t / (π/√3))² + (0.1 / (1/√12))²) = 0.3: a steady speed counts as what crosses the deviation of 10 s within these.
    let late = valid_prediction_time(&truth, &turning(1.1, 0.0), &circle, 0.3).unwrap();
    let expected = (2.0 * 0.09 - 0.12_f64).sqrt() * std::f64::consts::PI / 3.0_f64.sqrt() / 0.1;
    assert!(
        late.exceeded && (late.seconds - expected).abs() < 0.03,
        "{late:?}, {expected}"
    );

    let mut cut = turning(1.0, 0.0);
    cut.t.truncate(300);
    cut.q.truncate(300);
    cut.qd.truncate(300);
    let diverged = valid_prediction_time(&truth, &cut, &circle, 0.5).unwrap();
    assert!(diverged.exceeded && (diverged.seconds - 3.0).abs() < 1e-9);
    assert!(valid_prediction_time(&cut, &truth, &circle, 0.5).is_err());
    assert!(valid_prediction_time(&truth, &truth, &circle, 0.0).is_err());
    assert!(valid_prediction_time(&truth, &truth, &Coordinates::lines(2), 0.5).is_err());
}
