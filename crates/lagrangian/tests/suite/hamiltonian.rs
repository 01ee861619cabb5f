//! Hamilton's equations and the Legendre transform, on known systems and on random networks.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{by_name, systems};
use lagrangian::integrate::Method;
use lagrangian::mechanics::{
    Canonical, Dissipation, Evaluation, Hamiltonian, HamiltonianJet, HamiltonianOf, Jet,
    Lagrangian, LagrangianOf, Scaling,
};
use lagrangian::models::{Hnn, HnnConfig, HnnStructure, Momenta};
use lagrangian::rollout::{free, rollout_phase, times};
use lagrangian::{Coordinates, Model, RolloutOptions, rollout};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn close(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).fold(1.0, |m: f64, x| m.max(x.abs()));
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance * scale, "{what}: {a} is not {b}");
    }
}

#[test]
fn the_legendre_transform_there_and_back_is_the_lagrangian_of_every_analytic_system() {
    for entry in systems() {
        let system = entry.build(&[]).unwrap();
        let lagrangian = system.lagrangian();
        let back = LagrangianOf::new(HamiltonianOf::new(lagrangian));
        let (mut jets, mut again) = (lagrangian.jets(), back.jets());
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..50 {
            let state = system.sample_state(&mut rng);
            let (mut jet, mut found) = (Jet::default(), Jet::default());
            jets.jet(&state.q, &state.qd, &mut jet);
            // The relativistic ones reach M of 1e12, the factor from a rounding of the velocity to one of p.
            let stiff = jet.mass_matrix.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            if stiff > 1e5 {
                continue;
            }
            again.jet(&state.q, &state.qd, &mut found);
            let tolerance = 1e-12 * stiff;
            close(&jet.momentum, &found.momentum, tolerance, entry.name);
            close(&jet.mass_matrix, &found.mass_matrix, tolerance, entry.name);
            close(&jet.lagrangian, &found.lagrangian, tolerance, entry.name);
            close(&jet.dl_dq, &found.dl_dq, tolerance, entry.name);
            close(
                &jet.momentum_drift,
                &found.momentum_drift,
                tolerance,
                entry.name,
            );
        }
    }
}

#[test]
fn velocities_come_back_from_their_momenta_to_rounding() {
    for entry in systems() {
        let system = entry.build(&[]).unwrap();
        let model = Canonical::conservative(HamiltonianOf::new(system.lagrangian()));
        let mut evaluator = model.evaluator();
        let mut jets = system.lagrangian().jets();
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for _ in 0..50 {
            let state = system.sample_state(&mut rng);
            let mut jet = Jet::default();
            jets.jet(&state.q, &state.qd, &mut jet);
            let mut qd = vec![0.0; state.qd.len()];
            let flow = evaluator.phase_flow().unwrap();
            assert!(flow.velocity(&state.q, &jet.momentum, &mut qd).is_finite());
            close(&state.qd, &qd, 1e-12, entry.name);
        }
    }
}

#[test]
fn motions_in_phase_space_are_those_of_the_lagrangian() {
    for (name, steps) in [
        ("double-pendulum", 1e-8),
        ("charged-particle", 1e-8),
        ("cart-pole", 1e-8),
    ] {
        let system = by_name(name, &[]).unwrap();
        let model = Canonical::conservative(HamiltonianOf::new(system.lagrangian()));
        let state = system.sample_start(&mut ChaCha8Rng::seed_from_u64(2));
        let at = times(3.0, 0.1).unwrap();
        let options = RolloutOptions::default();
        let truth = rollout(&*system, &state.q, &state.qd, &at, &free, &options).unwrap();
        let found = rollout(&model, &state.q, &state.qd, &at, &free, &options).unwrap();
        assert!(found.outcome.is_finished());
        close(&truth.trajectory.q, &found.trajectory.q, steps, name);
        close(&truth.trajectory.qd, &found.trajectory.qd, steps, name);
        let (a, b) = (truth.trajectory.signals.qdd, found.trajectory.signals.qdd);
        close(&a, &b, 1e-6, name);
    }
}

#[test]
fn the_leapfrog_of_a_double_pendulum_in_momenta_keeps_its_energy_bounded_where_rk4_drifts() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let model = Canonical::conservative(HamiltonianOf::new(system.lagrangian()));
    let error = |method: Method, step: f64| {
        let options = RolloutOptions {
            method,
            step,
            ..RolloutOptions::default()
        };
        let at = times(200.0, 0.5).unwrap();
        let motion = rollout(&model, &[0.9, -0.6], &[0.0, 0.0], &at, &free, &options).unwrap();
        assert!(motion.outcome.is_finished());
        let motion = motion.trajectory;
        let mut energy = vec![0.0; motion.len()];
        let _ = system
            .evaluator()
            .energy(&motion.q, &motion.qd, &mut energy);
        let off = |part: &[f64]| {
            part.iter()
                .map(|e| (e - energy[0]).abs())
                .fold(0.0, f64::max)
        };
        [off(&energy[..100]), off(&energy[300..])]
    };
    for method in [Method::StormerVerlet, Method::ImplicitMidpoint] {
        let [early, late] = error(method, 0.02);
        assert!(
            late < 1.5 * early && late < 0.1,
            "{method:?} {early:e} {late:e}"
        );
    }
    let [early, late] = error(Method::Rk4, 0.05);
    assert!(late > 2.0 * early, "{early:e} {late:e}");
}

fn hnn(n: usize, structure: HnnStructure, momenta: Momenta, seed: u64) -> Hnn {
    let config = HnnConfig {
        structure,
        momenta,
        width: 24,
        ..HnnConfig::default()
    };
    of_config(n, config, seed)
}

fn of_config(n: usize, config: HnnConfig, seed: u64) -> Hnn {
    let scaling = Scaling {
        energy: 1.7,
        qd_scale: (0..n).map(|i| 1.3 + 0.4 * i as f64).collect(),
        q_center: vec![0.2; n],
        q_scale: vec![0.8; n],
        cyclic: (2..n).collect(),
    };
    let mut coordinates = Coordinates::angles(n);
    coordinates.0[0] = Coordinates::lines(1).0[0].clone();
    Hnn::random(coordinates, config, scaling, seed).unwrap()
}

#[test]
fn the_derivatives_of_a_network_agree_with_those_of_its_hamiltonian_as_dual_numbers() {
    use num_dual::HyperDual64;
    for (structure, speed_limit) in [
        (HnnStructure::Free, None),
        (HnnStructure::Free, Some(2.5)),
        (HnnStructure::Mass, None),
    ] {
        for n in [1, 2, 3] {
            let config = HnnConfig {
                structure,
                speed_limit,
                width: 24,
                ..HnnConfig::default()
            };
            let hnn = of_config(n, config, 4);
            let mut rng = ChaCha8Rng::seed_from_u64(5);
            // 21 states: a whole block and a part of one.
            let mut random = || {
                (0..21 * n)
                    .map(|_| rng.random_range(-2.0..2.0))
                    .collect::<Vec<f64>>()
            };
            let (q, p) = (random(), random());
            let mut jet = HamiltonianJet::default();
            hnn.jets().jet(&q, &p, &mut jet);
            for s in 0..21 {
                let row = s * n..(s + 1) * n;
                let second = |a: &[f64], b: &[f64]| {
                    let x = |i: usize| {
                        let value = if i < n {
                            q[s * n + i]
                        } else {
                            p[s * n + i - n]
                        };
                        HyperDual64::new(value, a[i], b[i], 0.0)
                    };
                    let (q, p): (Vec<_>, Vec<_>) =
                        ((0..n).map(x).collect(), (n..2 * n).map(x).collect());
                    hnn.hamiltonian(&q, &p).unwrap()
                };
                let unit = |k: usize| {
                    (0..2 * n)
                        .map(|i| f64::from(u8::from(i == k)))
                        .collect::<Vec<_>>()
                };
                let along: Vec<f64> = (jet.velocity[row.clone()].iter().copied())
                    .chain(vec![0.0; n])
                    .collect();
                for i in 0..n {
                    let at = second(&unit(n + i), &along);
                    close(&[at.re], &jet.hamiltonian[s..=s], 1e-12, "H");
                    close(
                        &[at.eps1],
                        &jet.velocity[s * n + i..=s * n + i],
                        1e-12,
                        "dH/dp",
                    );
                    close(
                        &[at.eps1eps2],
                        &jet.velocity_drift[s * n + i..=s * n + i],
                        1e-11,
                        "drift",
                    );
                    let slope = second(&unit(i), &along).eps1;
                    close(&[slope], &jet.dh_dq[s * n + i..=s * n + i], 1e-12, "dH/dq");
                    for j in 0..n {
                        let value = second(&unit(n + i), &unit(n + j)).eps1eps2;
                        let at = (s * n + i) * n + j;
                        close(&[value], &jet.inverse_mass[at..=at], 1e-11, "d²H/dp²");
                    }
                }
            }
        }
    }
}

#[test]
fn the_energy_of_a_network_changes_by_the_power_of_the_forces_alone() {
    let friction = Dissipation::viscous(vec![0.3, 0.1]);
    let model = Canonical::with(
        hnn(2, HnnStructure::Mass, Momenta::Recorded, 6),
        Some(friction),
        None,
    )
    .unwrap();
    let mut evaluator = model.evaluator();
    let (q, qd, tau) = ([0.4, -1.1], [0.8, -0.5], [0.7, 0.2]);
    let mut z = [0.0; 2];
    let flow = evaluator.phase_flow().unwrap();
    assert!(flow.phase(&q, &qd, &mut z).is_finite());
    let (mut dq, mut dz) = ([0.0; 2], [0.0; 2]);
    assert!(flow.flow(&q, &z, &tau, &mut dq, &mut dz).is_finite());
    close(&dq, &qd, 1e-12, "velocity");
    let mut energy = |e: f64| {
        let moved = |x: [f64; 2], d: [f64; 2]| [x[0] + e * d[0], x[1] + e * d[1]];
        let (q, z) = (moved(q, dq), moved(z, dz));
        let (mut qd, mut h) = ([0.0; 2], [0.0]);
        let _ = evaluator.phase_flow().unwrap().velocity(&q, &z, &mut qd);
        assert!(evaluator.energy(&q, &qd, &mut h).is_finite());
        h[0]
    };
    let rate = (energy(1e-4) - energy(-1e-4)) / 2e-4;
    let power = (0.7 - 0.3 * 0.8) * 0.8 + (0.2 + 0.1 * 0.5) * -0.5;
    assert!((rate - power).abs() < 1e-7, "{rate} {power}");
}

#[test]
fn forward_and_inverse_dynamics_of_a_network_are_those_of_its_flow() {
    let model = Canonical::conservative(hnn(3, HnnStructure::Mass, Momenta::Recorded, 9));
    let mut evaluator = model.evaluator();
    let (q, qd, tau) = ([0.4, -1.1, 2.0], [0.8, -0.5, 0.1], [0.7, 0.2, -0.4]);
    let (mut qdd, mut back) = ([0.0; 3], [0.0; 3]);
    let _ = evaluator.forward_dynamics(&q, &qd, &tau, &mut qdd);
    assert!(
        evaluator
            .inverse_dynamics(&q, &qd, &qdd, &mut back)
            .is_finite()
    );
    close(&tau, &back, 1e-11, "torque");
    // Along the flow the velocity changes by q̈.
    let mut z = [0.0; 3];
    let flow = evaluator.phase_flow().unwrap();
    assert!(flow.phase(&q, &qd, &mut z).is_finite());
    let (mut dq, mut dz) = ([0.0; 3], [0.0; 3]);
    let _ = flow.flow(&q, &z, &tau, &mut dq, &mut dz);
    let mut velocity = |e: f64| {
        let moved =
            |x: &[f64], d: &[f64]| x.iter().zip(d).map(|(x, d)| x + e * d).collect::<Vec<_>>();
        let mut qd = [0.0; 3];
        let _ = flow.velocity(&moved(&q, &dq), &moved(&z, &dz), &mut qd);
        qd
    };
    let (ahead, behind) = (velocity(1e-5), velocity(-1e-5));
    for i in 0..3 {
        let found = (ahead[i] - behind[i]) / 2e-5;
        assert!((found - qdd[i]).abs() < 1e-7, "{found} {}", qdd[i]);
    }
}

#[test]
fn a_flow_without_momenta_has_its_own_motion_and_no_inverse() {
    for structure in [HnnStructure::Free, HnnStructure::None] {
        let model = Canonical::conservative(hnn(2, structure, Momenta::Velocities, 3));
        let mut evaluator = model.evaluator();
        let (mut qdd, mut tau, mut h) = ([0.0; 2], [0.0; 2], [0.0]);
        assert!(
            !evaluator
                .inverse_dynamics(&[0.1; 2], &[0.2; 2], &[0.0; 2], &mut tau)
                .is_supported()
        );
        let outcome = evaluator.forward_dynamics(&[0.1; 2], &[0.2; 2], &[0.0; 2], &mut qdd);
        assert_eq!(outcome, Evaluation::Regular);
        let energy = evaluator.energy(&[0.1; 2], &[0.2; 2], &mut h);
        assert_eq!(energy.is_supported(), structure == HnnStructure::Free);
        let at = times(2.0, 0.1).unwrap();
        let options = RolloutOptions::default();
        let motion = rollout(&model, &[0.1; 2], &[0.2; 2], &at, &free, &options).unwrap();
        let slope = (motion.trajectory.q[2] - motion.trajectory.q[0]) / 0.1;
        let mut dq = [0.0; 2];
        let flow = evaluator.phase_flow().unwrap();
        let _ = flow.flow(&[0.1; 2], &[0.2; 2], &[0.0; 2], &mut dq, &mut qdd);
        assert!(
            (slope - dq[0]).abs() < 0.2 && (dq[0] - 0.2).abs() > 1e-3,
            "{slope} {dq:?}"
        );
    }
}

#[test]
fn many_rollouts_in_phase_space_are_those_of_each_alone() {
    let model = Canonical::conservative(hnn(2, HnnStructure::Mass, Momenta::Recorded, 3));
    let starts: Vec<_> = (0..7)
        .map(|k| lagrangian::State::new(vec![0.1 * f64::from(k), 0.3], vec![0.5, -0.2]))
        .collect();
    let at = times(2.0, 0.1).unwrap();
    let options = RolloutOptions::default();
    let many = lagrangian::rollout::rollout_many(&model, &starts, &at, &free, &options).unwrap();
    for (start, found) in starts.iter().zip(many) {
        let alone = rollout(&model, &start.q, &start.qd, &at, &free, &options).unwrap();
        close(&alone.trajectory.q, &found.trajectory.q, 1e-8, "q");
        close(&alone.trajectory.qd, &found.trajectory.qd, 1e-8, "qd");
    }
}

#[test]
fn configurations_that_cannot_be_are_refused_with_a_remedy() {
    let make = |structure, momenta| {
        let config = HnnConfig {
            structure,
            momenta,
            ..HnnConfig::default()
        };
        Hnn::random(Coordinates::lines(2), config, Scaling::identity(2), 0)
            .map_err(|e| e.to_string())
    };
    let limited = |structure, momenta, c| {
        let config = HnnConfig {
            structure,
            momenta,
            speed_limit: Some(c),
            ..HnnConfig::default()
        };
        let made = Hnn::random(Coordinates::lines(2), config, Scaling::identity(2), 0);
        made.map(|_| ()).map_err(|e| e.to_string())
    };
    for (structure, momenta, c, words) in [
        (
            HnnStructure::Mass,
            Momenta::Recorded,
            1.0,
            "`structure` free",
        ),
        (
            HnnStructure::None,
            Momenta::Recorded,
            1.0,
            "`structure` free",
        ),
        (
            HnnStructure::Free,
            Momenta::Velocities,
            1.0,
            "`momenta` velocities",
        ),
        (HnnStructure::Free, Momenta::Recorded, 0.0, "positive"),
        (HnnStructure::Free, Momenta::Recorded, f64::NAN, "finite"),
    ] {
        let error = limited(structure, momenta, c).unwrap_err();
        assert!(error.contains(words), "{error}");
    }
    assert!(limited(HnnStructure::Free, Momenta::Recorded, 1.0).is_ok());
    let few = make(HnnStructure::Free, Momenta::Masses(vec![1.0])).unwrap_err();
    assert!(few.contains("one for each coordinate"), "{few}");
    let zero = make(HnnStructure::Free, Momenta::Masses(vec![1.0, 0.0])).unwrap_err();
    assert!(zero.contains("positive"), "{zero}");
}

#[test]
fn a_plain_flow_of_momenta_moves_from_a_momentum_but_not_from_a_velocity() {
    let model = Canonical::conservative(hnn(2, HnnStructure::None, Momenta::Recorded, 3));
    let at = times(1.0, 0.1).unwrap();
    let options = RolloutOptions::default();
    let refused = rollout(&model, &[0.1; 2], &[0.2; 2], &at, &free, &options).unwrap();
    assert!(!refused.outcome.is_finished() && refused.trajectory.is_empty());
    let motion = rollout_phase(&model, &[0.1; 2], &[0.2; 2], &at, &free, &options).unwrap();
    assert!(motion.outcome.is_finished());
    let p = motion.trajectory.signals.p;
    close(&p[..2], &[0.2; 2], 1e-15, "first momentum");
}

#[test]
fn below_a_limit_of_speed_an_untrained_network_hardly_moves_faster_however_large_its_momentum() {
    let config = HnnConfig {
        speed_limit: Some(2.0),
        ..HnnConfig::default()
    };
    let hnn = of_config(1, config, 6);
    let mut jet = HamiltonianJet::default();
    for p in [-1e12, -1e6, 1e6, 1e12] {
        hnn.jets().jet(&[0.3], &[p], &mut jet);
        assert!(
            (jet.velocity[0] / p.signum() - 2.0).abs() < 1e-4,
            "{p}: {:?}",
            jet.velocity
        );
        assert!(jet.inverse_mass[0].is_finite());
    }
}

#[test]
fn a_momentum_that_stands_still_is_found_though_the_velocity_is_exactly_zero() {
    for speed_limit in [None, Some(3.0)] {
        for seed in 0..5 {
            let config = HnnConfig {
                speed_limit,
                ..HnnConfig::default()
            };
            let model = Canonical::conservative(of_config(1, config, seed));
            let (mut p, mut velocity) = ([0.0], [1.0]);
            let mut evaluator = model.evaluator();
            let flow = evaluator.phase_flow().unwrap();
            assert!(
                flow.phase(&[0.4], &[0.0], &mut p).is_finite(),
                "seed {seed}"
            );
            let _ = flow.velocity(&[0.4], &p, &mut velocity);
            assert!(velocity[0].abs() < 1e-12, "{velocity:?} at {p:?}");
        }
    }
}
