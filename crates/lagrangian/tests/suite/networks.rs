//! Networks evaluated by the kernels, compared with their evaluation over dual numbers.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::{Jet, Lagrangian, Mechanical, Scaling, SpeedChart};
use lagrangian::models::{Delan, Form, Lnn, Trunks};
use lagrangian::trajectory::Topology;
use lagrangian::{Coordinates, DelanConfig, LnnConfig, Model};
use nets::Activation;
use num_dual::{Dual64, DualNum, HyperDual64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Coordinates of both topologies, with scales that differ.
fn coordinates(n: usize) -> (Coordinates, Scaling) {
    let mut coordinates = Coordinates::angles(n);
    for (i, c) in coordinates.0.iter_mut().enumerate() {
        c.topology = if i % 3 == 1 {
            Topology::Line
        } else {
            Topology::Circle
        };
    }
    let scaling = Scaling {
        q_center: (0..n).map(|i| 0.1 * i as f64).collect(),
        q_scale: (0..n).map(|i| 1.0 + 0.2 * i as f64).collect(),
        qd_scale: (0..n).map(|i| 2.0 + 0.5 * i as f64).collect(),
        energy: 3.0,
        cyclic: (2..n).collect(),
    };
    (coordinates, scaling)
}

fn network(n: usize, depth: usize, form: Form, activation: Activation, seed: u64) -> Lnn {
    let (coordinates, scaling) = coordinates(n);
    let config = LnnConfig {
        form,
        width: 32,
        layers: depth,
        activation,
        kinetic: 0.7,
        ..LnnConfig::default()
    };
    Lnn::random(coordinates, config, scaling, seed).unwrap()
}

fn deep(n: usize, depth: usize, trunks: Trunks, activation: Activation, seed: u64) -> Delan {
    let (coordinates, scaling) = coordinates(n);
    let config = DelanConfig {
        width: 24,
        layers: depth,
        activation,
        trunks,
        vector_potential: trunks == Trunks::Separate,
        ..DelanConfig::default()
    };
    let random = Delan::random(coordinates.clone(), config.clone(), scaling.clone(), seed).unwrap();
    let rotors = (0..n).map(|i| 0.1 * i as f64).collect();
    let parameters = random.parameters().to_vec();
    Delan::with_parameters(coordinates, config, scaling, parameters)
        .and_then(|delan| delan.with_rotors(rotors))
        .unwrap()
}

/// A Lagrangian that can be evaluated over any scalar.
trait Slow {
    fn at<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D;
}

impl Slow for Lnn {
    fn at<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        self.lagrangian(q, qd)
    }
}

impl Slow for Delan {
    fn at<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        self.lagrangian(q, qd)
    }
}

/// L and its derivatives at one state by dual and hyper-dual numbers.
fn oracle(slow: &impl Slow, q: &[f64], qd: &[f64]) -> Jet {
    let n = q.len();
    let mut jet = Jet::default();
    jet.resize(1, n);
    let basis = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    for i in 0..n {
        let along_q: Vec<_> = (0..n).map(|k| Dual64::new(q[k], basis(i, k))).collect();
        let rest: Vec<_> = qd.iter().map(|&v| Dual64::from_re(v)).collect();
        let l = slow.at(&along_q, &rest);
        (jet.lagrangian[0], jet.dl_dq[i]) = (l.re, l.eps);
        let second = |dq: &dyn Fn(usize) -> f64, dv: &dyn Fn(usize) -> f64| {
            let x: Vec<_> = (0..n)
                .map(|k| HyperDual64::new(q[k], 0.0, dq(k), 0.0))
                .collect();
            let v: Vec<_> = (0..n)
                .map(|k| HyperDual64::new(qd[k], basis(i, k), dv(k), 0.0))
                .collect();
            slow.at(&x, &v)
        };
        let drift = second(&|k| qd[k], &|_| 0.0);
        (jet.momentum[i], jet.momentum_drift[i]) = (drift.eps1, drift.eps1eps2);
        for j in 0..n {
            jet.mass_matrix[i * n + j] = second(&|_| 0.0, &|k| basis(j, k)).eps1eps2;
        }
    }
    jet
}

fn worst(found: &[f64], truth: &[f64]) -> f64 {
    let scale = truth.iter().fold(1e-3_f64, |m, x| m.max(x.abs()));
    found
        .iter()
        .zip(truth)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs() / scale))
}

/// Compares kernels and dual numbers at some random states.
fn assert_agrees<L: Slow + Lagrangian>(lagrangian: &L, n: usize, what: &str) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let states = 19; // one block and a part of another
    let q: Vec<f64> = (0..states * n)
        .map(|_| rng.random_range(-3.0..3.0))
        .collect();
    let qd: Vec<f64> = (0..states * n)
        .map(|_| rng.random_range(-5.0..5.0))
        .collect();
    let mut jet = Jet::default();
    lagrangian.jets().jet(&q, &qd, &mut jet);
    for row in 0..states {
        let (from, to) = (row * n, row * n + n);
        let truth = oracle(lagrangian, &q[from..to], &qd[from..to]);
        let pairs = [
            (&jet.lagrangian[row..=row], &truth.lagrangian[..]),
            (&jet.dl_dq[from..to], &truth.dl_dq[..]),
            (&jet.momentum[from..to], &truth.momentum[..]),
            (&jet.momentum_drift[from..to], &truth.momentum_drift[..]),
            (&jet.mass_matrix[from * n..to * n], &truth.mass_matrix[..]),
        ];
        for (k, (found, truth)) in pairs.into_iter().enumerate() {
            let error = worst(found, truth);
            assert!(error < 1e-12, "{what} field {k}: {error:e}");
        }
    }
}

#[test]
fn every_derivative_of_a_network_agrees_with_dual_numbers_to_rounding() {
    let activations = [
        Activation::Softplus,
        Activation::Tanh,
        Activation::Gelu,
        Activation::XTanh,
        Activation::Square,
    ];
    for n in 1..=7 {
        for depth in 1..=4 {
            for form in [Form::Free, Form::Convex] {
                let activation = activations[(n + depth) % activations.len()];
                let lnn = network(n, depth, form, activation, (n * 10 + depth) as u64);
                let what = format!("n {n} depth {depth} {form:?} {activation:?}");
                assert_agrees(&lnn, n, &what);
            }
            for trunks in [Trunks::Shared, Trunks::Separate] {
                let activation = activations[(n + depth) % activations.len()];
                let delan = deep(n, depth, trunks, activation, (n * 10 + depth) as u64);
                let what = format!("n {n} depth {depth} {trunks:?} {activation:?}");
                assert_agrees(&delan, n, &what);
            }
        }
    }
}

#[test]
fn derivatives_through_charts_of_the_speed_and_exponential_units_agree_with_dual_numbers() {
    for n in 1..=3 {
        for (form, speed_limit, speed_chart) in [
            (Form::Free, Some(6.0), SpeedChart::Artanh),
            (Form::Free, Some(6.0), SpeedChart::Arcsin),
            (Form::Convex, None, SpeedChart::default()),
        ] {
            let (coordinates, scaling) = coordinates(n);
            let config = LnnConfig {
                form,
                exponential: true,
                speed_limit,
                speed_chart,
                ..LnnConfig::default()
            };
            let lnn = Lnn::random(coordinates, config, scaling, n as u64).unwrap();
            let what = format!("n {n} {form:?} {speed_limit:?} {speed_chart:?}");
            assert_agrees(&lnn, n, &what);
        }
    }
}

/// A single state is evaluated separately through networks whose layers are a chain; blocks are tested above.
fn assert_alone_as_in_a_block(lagrangian: &impl Lagrangian, n: usize, what: &str) {
    let wave = |k: usize, f: f64| 3.0 * (k as f64 * f).sin();
    let column = |f: f64| (0..3 * n).map(|k| wave(k + 1, f)).collect::<Vec<_>>();
    let (q, qd) = (column(0.73), column(1.91));
    let (mut block, mut alone) = (Jet::default(), Jet::default());
    let mut jets = lagrangian.jets();
    jets.jet(&q, &qd, &mut block);
    for row in 0..3 {
        let (from, to) = (row * n, row * n + n);
        jets.jet(&q[from..to], &qd[from..to], &mut alone);
        let pairs = [
            (&alone.lagrangian, &block.lagrangian[row..=row]),
            (&alone.dl_dq, &block.dl_dq[from..to]),
            (&alone.momentum, &block.momentum[from..to]),
            (&alone.momentum_drift, &block.momentum_drift[from..to]),
            (&alone.mass_matrix, &block.mass_matrix[from * n..to * n]),
        ];
        for (k, (alone, block)) in pairs.into_iter().enumerate() {
            let error = worst(alone, block);
            assert!(error < 1e-13, "{what} field {k}: {error:e}");
        }
    }
}

#[test]
fn one_state_alone_and_in_a_block_gives_the_same_derivatives() {
    let activations = [
        Activation::Softplus,
        Activation::Tanh,
        Activation::Gelu,
        Activation::XTanh,
        Activation::Square,
    ];
    // Whole vectors and parts of them, in widths and in numbers of features and rows.
    for (k, width) in [1, 5, 8, 13, 32, 70, 136].into_iter().enumerate() {
        for n in 1..=9 {
            let (coordinates, scaling) = coordinates(n);
            let (layers, activation) = (1 + (n + k) % 3, activations[(n + k) % activations.len()]);
            let lnn = LnnConfig {
                width,
                layers,
                activation,
                ..LnnConfig::default()
            };
            let limited = LnnConfig {
                speed_limit: Some(4.0),
                ..lnn.clone()
            };
            let delan = DelanConfig {
                width,
                layers,
                activation,
                vector_potential: n % 2 == 0,
                ..DelanConfig::default()
            };
            let what = format!("width {width} n {n} layers {layers} {activation:?}");
            for config in [lnn, limited] {
                let lnn = Lnn::random(coordinates.clone(), config, scaling.clone(), 3).unwrap();
                assert_alone_as_in_a_block(&lnn, n, &what);
            }
            let delan = Delan::random(coordinates, delan, scaling, 3).unwrap();
            assert_alone_as_in_a_block(&delan, n, &what);
        }
    }
}

#[test]
fn the_convex_form_has_a_positive_definite_mass_matrix_everywhere() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let lnn = network(2, 2, Form::Convex, Activation::Tanh, 11);
    let q: Vec<f64> = (0..4000).map(|_| rng.random_range(-10.0..10.0)).collect();
    let qd: Vec<f64> = (0..4000).map(|_| rng.random_range(-50.0..50.0)).collect();
    let mut jet = Jet::default();
    lnn.jets().jet(&q, &qd, &mut jet);
    for m in jet.mass_matrix.chunks(4) {
        assert!(m[0] > 0.0 && m[0] * m[3] > m[1] * m[2], "{m:?}");
    }
}

/// dE/dt along (q̇, q̈) for E = q̇·∂L/∂q̇ − L, by hyper-dual numbers: ε₁ scales the velocity, ε₂ is time.
fn power(lnn: &Lnn, q: &[f64], qd: &[f64], qdd: &[f64]) -> f64 {
    let q: Vec<_> = q
        .iter()
        .zip(qd)
        .map(|(&q, &v)| HyperDual64::new(q, 0.0, v, 0.0))
        .collect();
    let qd: Vec<_> = qd
        .iter()
        .zip(qdd)
        .map(|(&v, &a)| HyperDual64::new(v, v, a, a))
        .collect();
    let l = lnn.lagrangian(&q, &qd);
    l.eps1eps2 - l.eps2
}

#[test]
fn the_energy_of_a_random_network_changes_by_the_power_of_the_forces_alone() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for n in 1..=7 {
        for form in [Form::Free, Form::Convex] {
            let lnn = network(n, 2, form, Activation::Softplus, n as u64);
            let model = Mechanical::conservative(&lnn);
            let mut evaluator = model.evaluator();
            for _ in 0..20 {
                let mut state =
                    || -> Vec<f64> { (0..n).map(|_| rng.random_range(-3.0..3.0)).collect() };
                let (q, qd, tau) = (state(), state(), state());
                let mut qdd = vec![0.0; n];
                let _ = evaluator.forward_dynamics(&q, &qd, &tau, &mut qdd);
                let given: f64 = tau.iter().zip(&qd).map(|(f, v)| f * v).sum();
                let scale: f64 = tau.iter().zip(&qd).map(|(f, v)| (f * v).abs()).sum();
                let largest = qdd.iter().fold(1.0_f64, |m, a| m.max(a.abs()));
                let error = (power(&lnn, &q, &qd, &qdd) - given).abs() / (scale * largest);
                assert!(error < 1e-10, "n {n} {form:?}: {error:e}");
            }
        }
    }
}
