//! Dry friction as a set of forces: a system that it holds stands still exactly, and motions follow their closed forms.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::{PI, TAU};

use lagrangian::analytic::by_name;
use lagrangian::integrate::Method;
use lagrangian::mechanics::{
    Canonical, Dissipation, HamiltonianOf, Mechanical, Outcome, Scaling, Stribeck,
};
use lagrangian::models::{Delan, Mlp, MlpConfig, MlpScaling};
use lagrangian::rollout::{Hold, free, rollout_many, rollout_phase, rollout_recorded, times};
use lagrangian::{
    Coordinates, DelanConfig, Model, Rollout, RolloutOptions, Signals, State, Trajectory, rollout,
};

fn coulomb(coulomb: &[f64]) -> Dissipation {
    Dissipation {
        coulomb: coulomb.to_vec(),
        smoothing: vec![1e-4; coulomb.len()],
        ..Dissipation::viscous(vec![0.0; coulomb.len()])
    }
}

fn stepped(step: f64) -> RolloutOptions {
    RolloutOptions {
        method: Method::Moreau,
        step,
        max_steps: 2_000_000,
        ..RolloutOptions::default()
    }
}

/// The state (q, q̇) at the last time.
fn last(rollout: &Rollout) -> Vec<f64> {
    assert_eq!(rollout.outcome, Outcome::Finished);
    let row = rollout.trajectory.row(rollout.trajectory.len() - 1);
    [row.q, row.qd].concat()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

#[test]
fn a_block_on_a_spring_loses_2c_over_k_each_half_swing_and_then_rests_for_hours() {
    // q = 1 at first, ω = 1, c/k = 0.15: turning points −0.7, 0.4, −0.1, within the dead zone.
    let spring = by_name("mass-spring", &[]).unwrap();
    let block = Mechanical::dissipative(spring.lagrangian(), coulomb(&[0.15])).unwrap();
    let end = |step: f64| {
        let t = [0.0, PI, 2.0 * PI, 3.0 * PI, 4.0 * PI];
        let motion = rollout(&block, &[1.0], &[0.0], &t, &free, &stepped(step)).unwrap();
        last(&motion);
        motion.trajectory
    };
    let error = |step: f64| distance(&end(step).q, &[1.0, -0.7, 0.4, -0.1, -0.1]);
    assert!(error(0.01) < 1e-4, "{:e}", error(0.01));
    let fine = end(1e-3);
    assert!(
        fine.qd[4] == 0.0 && fine.qdd[4] == 0.0 && fine.q[4].to_bits() == end(1e-3).q[4].to_bits()
    );
    let hours = times(3.0 * 3600.0, 60.0).unwrap();
    let rest = rollout(&block, &[-0.1], &[0.0], &hours, &free, &stepped(0.02)).unwrap();
    assert_eq!(rest.outcome, Outcome::Finished);
    let motion = &rest.trajectory;
    assert!(motion.q.iter().all(|q| q.to_bits() == (-0.1_f64).to_bits()));
    assert!(motion.qd.iter().chain(&motion.qdd).all(|x| *x == 0.0));
}

#[test]
fn dampers_between_coordinates_act_in_both_kinds_of_friction() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let friction = Dissipation::viscous(vec![0.6, 0.5]).with_between(vec![0.0, -0.4, -0.4, 0.0]);
    let damped = Mechanical::dissipative(system.lagrangian(), friction.unwrap()).unwrap();
    let end = |options: &RolloutOptions| {
        let motion = rollout(
            &damped,
            &[1.0, -0.5],
            &[0.5, 1.0],
            &[0.0, 2.0],
            &free,
            options,
        );
        last(&motion.unwrap())
    };
    let exact = end(&RolloutOptions::truth());
    let [coarse, fine] = [0.02, 0.01].map(|step| distance(&end(&stepped(step)), &exact));
    // Of second order, as without them.
    assert!(fine < 2e-3 && fine < 0.4 * coarse, "{coarse:e} {fine:e}");
}

#[test]
fn a_block_that_a_spring_drags_sticks_and_slips_by_the_closed_form() {
    // k (u t − x) pulls at 1 kg: it starts at t₀ = c / (k u), then ẋ = u (1 − cos ω (t − t₀)) until it sticks.
    let (k, u, c) = (4.0_f64, 0.5, 0.6);
    let (omega, start) = (k.sqrt(), c / (k * u));
    let spring = by_name("mass-spring", &[("stiffness", 1e-12)]).unwrap();
    let block = Mechanical::dissipative(spring.lagrangian(), coulomb(&[c])).unwrap();
    let pull = |t: f64, q: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = k * (u * t - q[0]);
    let exact = |t: f64| match (omega * (t - start)).clamp(0.0, TAU) {
        phase if phase > 0.0 => u * phase / omega - u / omega * phase.sin(),
        _ => 0.0,
    };
    let t = times(start + TAU / omega, 0.05).unwrap();
    let error = |step: f64| {
        let motion = rollout(&block, &[0.0], &[0.0], &t, &pull, &stepped(step)).unwrap();
        let exact: Vec<f64> = t.iter().map(|&t| exact(t)).collect();
        assert!(motion.trajectory.qd.iter().all(|v| *v >= 0.0));
        let before = t.iter().filter(|t| **t < start).count();
        assert!(motion.trajectory.q[..before].iter().all(|q| *q == 0.0));
        distance(&motion.trajectory.q, &exact)
    };
    let errors = [0.01, 0.005, 0.0025].map(error);
    assert!(
        errors[0] < 1e-4 && errors[2] < errors[0] / 8.0,
        "{errors:?}"
    );
}

#[test]
fn a_block_on_an_incline_rests_below_its_breakaway_and_slides_with_the_difference_above() {
    let spring = by_name("mass-spring", &[("stiffness", 1e-12)]).unwrap();
    let block = Mechanical::dissipative(spring.lagrangian(), coulomb(&[2.0])).unwrap();
    let at = |force: f64, v: f64| {
        let pull = move |_: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = force;
        last(&rollout(&block, &[0.0], &[v], &[0.0, 3.0], &pull, &stepped(0.01)).unwrap())
    };
    assert_eq!(at(2.0, 0.0), [0.0, 0.0]);
    assert_eq!(at(-2.0, 0.0), [0.0, 0.0]);
    assert!(distance(&at(2.5, 0.0), &[0.5 * 0.5 * 9.0, 1.5]) < 1e-9);
    // It slides uphill for 1 s, 0.75 m far, and stays there: |F| < c.
    let up = at(1.0, -3.0);
    assert!((up[0] + 1.5).abs() < 1e-9 && up[1] == 0.0, "{up:?}");
    // It turns after 0.5 s at −0.5 · 4² / 8, where it starts back: |F| > c.
    let back = at(6.0, -4.0);
    assert!(
        distance(&back, &[-1.0 + 0.5 * 4.0 * 2.5 * 2.5, 10.0]) < 1e-9,
        "{back:?}"
    );
}

#[test]
fn a_pendulum_comes_to_rest_off_its_equilibrium_within_the_dead_zone() {
    let pendulum = by_name("pendulum", &[]).unwrap();
    let friction = Dissipation {
        stribeck: Some(Stribeck {
            height: vec![0.5],
            speed: vec![0.05],
        }),
        ..coulomb(&[1.0])
    };
    let damped = Mechanical::dissipative(pendulum.lagrangian(), friction).unwrap();
    let t = times(60.0, 0.5).unwrap();
    let starts = [0.4, 1.3, 2.9, -2.0].map(|q| State::new(vec![q], vec![0.0]));
    for motion in rollout_many(&damped, &starts, &t, &free, &stepped(0.01)).unwrap() {
        let motion = motion.trajectory;
        let first = motion.qd.iter().rposition(|v| *v != 0.0).unwrap() + 1;
        assert!(first < t.len() / 2, "{first}");
        let held = motion.q[first];
        assert!(
            motion.q[first..]
                .iter()
                .all(|q| q.to_bits() == held.to_bits())
        );
        let weight = 9.8 * held.sin();
        assert!(weight.abs() <= 1.5 + 1e-9 && held != 0.0, "{held}");
        assert!(motion.qdd[first..].iter().all(|a| *a == 0.0));
    }
}

#[test]
fn of_two_coupled_joints_one_sticks_while_the_other_swings_as_a_pendulum_alone() {
    let double = by_name("double-pendulum", &[]).unwrap();
    let held = Mechanical::dissipative(double.lagrangian(), coulomb(&[1e3, 0.0])).unwrap();
    let t = times(3.0, 0.1).unwrap();
    let motion = rollout(&held, &[0.0, 1.2], &[0.0, 0.0], &t, &free, &stepped(1e-3)).unwrap();
    let single = by_name("pendulum", &[]).unwrap();
    let exact = rollout(
        &*single,
        &[1.2],
        &[0.0],
        &t,
        &free,
        &RolloutOptions::truth(),
    )
    .unwrap();
    let column =
        |x: &[f64], i: usize| -> Vec<f64> { x.iter().skip(i).step_by(2).copied().collect() };
    let (q, qd) = (&motion.trajectory.q, &motion.trajectory.qd);
    assert!(column(q, 0).iter().chain(&column(qd, 0)).all(|x| *x == 0.0));
    let error = distance(&column(q, 1), &exact.trajectory.q);
    assert!(error < 1e-5, "{error:e}");
    let error = distance(&column(&motion.trajectory.qdd, 1), &exact.trajectory.qdd);
    assert!(error < 1e-4, "{error:e}");
}

#[test]
fn the_order_is_two_through_stops_and_reversals_of_coupled_joints() {
    let double = by_name("double-pendulum", &[]).unwrap();
    let model = Mechanical::dissipative(double.lagrangian(), coulomb(&[4.0, 0.6])).unwrap();
    let drive = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
        (tau[0], tau[1]) = (8.0 * (2.0 * t).sin(), 3.0 * (3.1 * t).cos());
    };
    let t = times(4.0, 0.05).unwrap();
    let run = |step: f64| {
        let start = (&[0.5, -0.3], &[0.0, 0.0]);
        let motion = rollout(&model, start.0, start.1, &t, &drive, &stepped(step)).unwrap();
        assert_eq!(motion.outcome, Outcome::Finished);
        motion.trajectory
    };
    let exact = run(1e-4);
    for joint in 0..2 {
        let v = exact.qd.iter().skip(joint).step_by(2);
        let turns = v
            .clone()
            .zip(v.clone().skip(1))
            .filter(|(a, b)| *a * *b < 0.0);
        let (turns, rests) = (turns.count(), v.filter(|v| **v == 0.0).count());
        println!("joint {joint}: {turns} reversals, {rests} samples at rest");
        assert!(turns > 0 && rests > 10 * (1 - joint), "{joint}");
    }
    let errors = [0.01, 0.005, 0.0025].map(|step| distance(&run(step).q, &exact.q));
    println!("{errors:?}");
    assert!(
        errors[0] < 1e-2 && errors[2] < errors[0] / 9.0,
        "{errors:?}"
    );
}

#[test]
fn where_nothing_sticks_the_motion_is_that_of_smooth_friction_that_changes_its_sign_fast() {
    let double = by_name("double-pendulum", &[]).unwrap();
    let friction = Dissipation {
        viscous: vec![0.2, 0.1],
        stribeck: Some(Stribeck {
            height: vec![0.5, 0.2],
            speed: vec![0.3, 0.5],
        }),
        load: Some(vec![0.1, 0.2]),
        ..coulomb(&[0.4, 0.3])
    };
    let model = Mechanical::dissipative(double.lagrangian(), friction).unwrap();
    let drive = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
        (tau[0], tau[1]) = (20.0 * (2.0 * t).sin(), 8.0 * (3.1 * t).cos());
    };
    let t = times(2.0, 0.1).unwrap();
    let start = (&[0.5, -0.3], &[3.0, -2.0]);
    let smooth = RolloutOptions {
        rtol: 1e-9,
        atol: 1e-9,
        ..RolloutOptions::default()
    };
    let [smooth, set] = [smooth, stepped(1e-3)]
        .map(|options| rollout(&model, start.0, start.1, &t, &drive, &options).unwrap());
    let error = distance(&smooth.trajectory.q, &set.trajectory.q);
    assert!(error < 2e-3, "{error:e}");
}

#[test]
fn friction_alone_never_adds_energy_to_coupled_joints_whatever_the_step() {
    let gravity = [("gravity", 0.0)];
    let double = by_name("double-pendulum", &gravity).unwrap();
    let model = Mechanical::dissipative(double.lagrangian(), coulomb(&[0.5, 0.2])).unwrap();
    for step in [0.2, 0.05, 0.01] {
        let t = times(20.0, step).unwrap();
        let motion = rollout(&model, &[0.3, 0.0], &[0.0, 1.2], &t, &free, &stepped(step)).unwrap();
        let Signals { q, qd, .. } = &motion.trajectory.signals;
        let mut energy = vec![0.0; t.len()];
        assert!(model.evaluator().energy(q, qd, &mut energy).is_finite());
        let offset = energy[t.len() - 1];
        assert!(qd[qd.len() - 2..].iter().all(|v| *v == 0.0));
        let rise = energy.windows(2).fold(0.0, |m: f64, w| m.max(w[1] - w[0]));
        assert!(
            rise <= 1e-3 * step * (energy[0] - offset),
            "{step}: {rise:e}"
        );
    }
}

#[test]
fn learned_models_move_by_it_and_plain_networks_are_told_why_not() {
    let scaling = Scaling {
        q_center: vec![0.0; 2],
        q_scale: vec![1.0; 2],
        qd_scale: vec![3.0; 2],
        energy: 5.0,
        ..Scaling::identity(2)
    };
    let coordinates = Coordinates::angles(2);
    let delan = Delan::random(coordinates.clone(), DelanConfig::default(), scaling, 1).unwrap();
    let model = Mechanical::dissipative(delan, coulomb(&[0.2, 0.1])).unwrap();
    let t = times(0.4, 0.1).unwrap();
    let [smooth, set] = [RolloutOptions::default(), stepped(1e-3)].map(|options| {
        last(&rollout(&model, &[0.3, 0.2], &[1.0, 2.0], &t, &free, &options).unwrap())
    });
    assert!(distance(&smooth, &set) < 1e-3, "{smooth:?} {set:?}");

    // A Hamiltonian moves in momenta; dry friction holds a velocity.
    let double = by_name("double-pendulum", &[]).unwrap();
    let hamiltonian = HamiltonianOf::new(double.lagrangian());
    let canonical = Canonical::with(hamiltonian, Some(coulomb(&[20.0, 0.3])), None).unwrap();
    let lagrangian = Mechanical::dissipative(double.lagrangian(), coulomb(&[20.0, 0.3])).unwrap();
    let models: [&dyn Model; 2] = [&canonical, &lagrangian];
    let [p, v] = models.map(|model| {
        let motion = rollout(model, &[0.3, 0.9], &[0.0, 0.5], &t, &free, &stepped(0.01));
        last(&motion.unwrap())
    });
    assert!(
        p[0].to_bits() == 0.3_f64.to_bits() && p[2] == 0.0 && distance(&p, &v) < 1e-9,
        "{p:?} {v:?}"
    );
    let momenta = rollout_phase(
        &canonical,
        &[0.3, 0.9],
        &[0.0, 0.5],
        &t,
        &free,
        &stepped(0.01),
    );
    assert!(momenta.unwrap_err().to_string().contains("all but moreau"));

    let config = MlpConfig::default();
    let plain = Mlp::random(coordinates, config, MlpScaling::identity(2), 0).unwrap();
    let refused = rollout(&plain, &[0.3, 0.9], &[0.0, 0.5], &t, &free, &stepped(0.01));
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("without a mass matrix"), "{refused}");
}

#[test]
fn a_recording_that_friction_holds_stays_where_it_is() {
    let spring = by_name("mass-spring", &[]).unwrap();
    let block = Mechanical::dissipative(spring.lagrangian(), coulomb(&[1.0])).unwrap();
    let signals = Signals {
        q: vec![0.3; 3],
        qd: vec![0.0; 3],
        tau: vec![0.1, -0.4, 0.2],
        ..Signals::default()
    };
    let recording = Trajectory::new("held", vec![0.0, 0.5, 1.0], signals);
    for hold in [Hold::Previous, Hold::Linear] {
        let held = rollout_recorded(&block, &recording, hold, &stepped(0.01)).unwrap();
        let motion = &held.trajectory;
        assert!(motion.q == recording.q && motion.qd == recording.qd && motion.qdd == [0.0; 3]);
    }
}
