//! Laws of deep Lagrangian networks on random weights: the properties that robotics relies on hold for any weights.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::{
    Actuation, Directional, Dissipation, Jet, Lagrangian, Mechanical, Quantities, Regularity,
    Scaling, Stribeck, SymmetricSolver,
};
use lagrangian::models::{Delan, Trunks};
use lagrangian::trajectory::Topology;
use lagrangian::{Coordinates, DelanConfig, Model};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Networks of 1 to 7 coordinates, with both kinds of trunks, with and without a vector potential and rotors.
fn networks() -> impl Iterator<Item = Delan> {
    (1..=7).flat_map(|n| {
        [false, true].into_iter().map(move |rich| {
            let mut coordinates = Coordinates::angles(n);
            coordinates.0[n / 2].topology = Topology::Line;
            let scaling = Scaling {
                qd_scale: (0..n).map(|i| 1.0 + 0.4 * i as f64).collect(),
                energy: 2.5,
                ..Scaling::identity(n)
            };
            let config = DelanConfig {
                width: 24,
                trunks: if rich {
                    Trunks::Separate
                } else {
                    Trunks::Shared
                },
                vector_potential: rich,
                ..DelanConfig::default()
            };
            let random = Delan::random(
                coordinates.clone(),
                config.clone(),
                scaling.clone(),
                n as u64,
            );
            let weights = random.unwrap().parameters().to_vec();
            let rotors = if rich { vec![0.3; n] } else { Vec::new() };
            Delan::with_parameters(coordinates, config, scaling, weights)
                .and_then(|delan| delan.with_rotors(rotors))
                .unwrap()
        })
    })
}

fn random(rng: &mut ChaCha8Rng, n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-size..size)).collect()
}

fn largest(x: impl Iterator<Item = f64>) -> f64 {
    x.fold(0.0, |m, x| m.max(x.abs()))
}

#[test]
fn the_mass_matrix_is_symmetric_and_positive_definite_far_from_any_data() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for delan in networks() {
        let n = delan.coordinates().dof();
        let (model, mut solver) = (Mechanical::conservative(delan), SymmetricSolver::new(n));
        for size in [1.0, 3.0, 10.0] {
            let q = random(&mut rng, n, size);
            let m = model.mass_matrix(&q).unwrap();
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                assert!(m[i * n + j].to_bits() == m[j * n + i].to_bits());
            }
            let mut x = vec![0.0; n];
            assert_eq!(
                solver.solve(&m, &vec![1.0; n], &mut x),
                Regularity::Definite
            );
        }
    }
}

#[test]
fn inertia_and_bias_add_up_to_the_inverse_dynamics_and_the_energy_is_kinetic_beside_that_at_rest() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for delan in networks() {
        let n = delan.coordinates().dof();
        let (q, qd) = (random(&mut rng, n, 3.0), random(&mut rng, n, 2.0));
        let qdd = random(&mut rng, n, 2.0);
        let model = Mechanical::conservative(delan);
        let [m, c] = [model.mass_matrix(&q), model.bias(&q, &qd)].map(Result::unwrap);
        let tau = model.inverse_dynamics(&q, &qd, &qdd).unwrap();
        let product = |x: &[f64], i: usize| -> f64 {
            m[i * n..][..n].iter().zip(x).map(|(m, x)| m * x).sum()
        };
        let scale = largest(tau.iter().copied());
        assert!(largest((0..n).map(|i| tau[i] - product(&qdd, i) - c[i])) < 1e-12 * scale);
        // H = T + V, whatever the vector potential.
        let [moving, still] = [&qd, &vec![0.0; n]].map(|qd| model.energy(&q, qd).unwrap()[0]);
        let kinetic: f64 = (0..n).map(|i| 0.5 * qd[i] * product(&qd, i)).sum();
        assert!((moving - still - kinetic).abs() < 1e-12 * (1.0 + moving.abs()));
    }
}

#[test]
fn energy_changes_by_the_power_of_inputs_and_friction_alone() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for delan in networks() {
        let n = delan.coordinates().dof();
        let friction = Dissipation {
            viscous: vec![0.2; n],
            coulomb: vec![0.1; n],
            smoothing: vec![0.3; n],
            stribeck: Some(Stribeck {
                height: vec![0.2; n],
                speed: vec![0.5; n],
            }),
            load: Some(vec![0.3; n]),
            drag: Some(vec![0.05; n]),
            between: Some(
                (0..n * n)
                    .map(|k| if k / n == k % n { 0.0 } else { -0.02 })
                    .collect(),
            ),
            directional: Some(Directional {
                external: vec![0.2; n],
                stribeck_motor: vec![0.1; n],
                stribeck_external: vec![0.15; n],
                quadratic_motor: vec![0.02; n],
                quadratic_external: vec![0.03; n],
            }),
        };
        let matrix = random(&mut rng, n * n, 1.0);
        let actuation = Actuation::new(matrix, random(&mut rng, n, 0.5)).unwrap();
        let mut tau = vec![0.0; n];
        let (q, qd, u) = (
            random(&mut rng, n, 3.0),
            random(&mut rng, n, 2.0),
            random(&mut rng, n, 1.0),
        );
        actuation.forces(&u, &mut tau);
        friction.take_out(&qd, &mut tau);
        let model = Mechanical::dissipative(delan, friction).unwrap();
        let model = model.driven(actuation).unwrap();
        let mut evaluator = model.evaluator();
        let mut qdd = vec![0.0; n];
        assert_eq!(
            evaluator.forward_dynamics(&q, &qd, &u, &mut qdd).singular(),
            0
        );
        let mut energy = |s: f64| {
            let along = |x: &[f64], v: &[f64]| -> Vec<f64> {
                x.iter().zip(v).map(|(x, v)| x + s * v).collect()
            };
            let mut energy = [0.0];
            let _ = evaluator.energy(&along(&q, &qd), &along(&qd, &qdd), &mut energy);
            energy[0]
        };
        let h = 1e-3 / (1.0 + largest(qdd.iter().copied())).sqrt();
        let slope =
            |k: f64, energy: &mut dyn FnMut(f64) -> f64| (energy(k * h) - energy(-k * h)) / h;
        let rate = (45.0 * slope(1.0, &mut energy) - 9.0 * slope(2.0, &mut energy)
            + slope(3.0, &mut energy))
            / 60.0;
        let power: f64 = (0..n).map(|i| tau[i] * qd[i]).sum();
        assert!(
            (rate - power).abs() < 1e-7 * (1.0 + power.abs()),
            "n {n}: {rate} {power}"
        );
    }
}

#[test]
fn inputs_that_inverse_dynamics_asks_for_yield_the_acceleration() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for delan in networks() {
        let n = delan.coordinates().dof();
        let gains: Vec<f64> = (0..n).map(|i| 0.5 + i as f64).collect();
        let model = Mechanical::dissipative(delan, Dissipation::viscous(vec![0.3; n])).unwrap();
        let model = model
            .driven(Actuation::gains(&gains, vec![0.1; n]).unwrap())
            .unwrap();
        let mut evaluator = model.evaluator();
        let (q, qd, qdd) = (
            random(&mut rng, n, 3.0),
            random(&mut rng, n, 2.0),
            random(&mut rng, n, 2.0),
        );
        let (mut u, mut found) = (vec![0.0; n], vec![0.0; n]);
        let _ = evaluator.inverse_dynamics(&q, &qd, &qdd, &mut u);
        let _ = evaluator.forward_dynamics(&q, &qd, &u, &mut found);
        assert!(largest((0..n).map(|i| found[i] - qdd[i])) < 1e-9);
    }
}

#[test]
fn a_vector_potential_bends_motions_without_changing_their_energy() {
    let delan = networks().find(|d| d.coordinates().dof() == 3 && d.config().vector_potential);
    let delan = delan.unwrap();
    let (q, qd) = ([0.3, -0.2, 1.0], [1.0, -0.5, 0.7]);
    let mut jet = Jet::default();
    delan.jets().jet(&q, &qd, &mut jet);
    let (ahead, mut back) = (jet.clone(), Jet::default());
    let reversed = qd.map(|v| -v);
    delan.jets().jet(&q, &reversed, &mut back);
    // The bias is even in q̇ without such a term, and the odd part does no work.
    let odd = |i: usize| {
        let bias = |jet: &Jet| jet.momentum_drift[i] - jet.dl_dq[i];
        0.5 * (bias(&ahead) - bias(&back))
    };
    assert!(largest((0..3).map(odd)) > 1e-3);
    assert!((0..3).map(|i| odd(i) * qd[i]).sum::<f64>().abs() < 1e-12);
}
