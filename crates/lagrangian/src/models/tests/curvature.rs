//! Second derivatives of Lagrangians, compared with hyper-dual numbers.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use num_dual::HyperDual64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::models::delan::{Delan, DelanConfig};
use crate::models::lnn::{Form, Lnn, LnnConfig};
use lagrangian_mechanics::analytic::uniform;
use lagrangian_mechanics::{Curvature, Lagrangian, Scaling, Sum};
use lagrangian_motion::{Coordinate, Coordinates, Topology};

/// Largest difference of two lists over the largest entry.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(1e-300, |s: f64, x| s.max(x.abs()));
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max)
}

fn mixed_coordinates() -> Coordinates {
    let mut coordinates = Coordinates::angles(3);
    coordinates.0[1] = Coordinate {
        topology: Topology::Line,
        ..coordinates.0[1].clone()
    };
    coordinates
}

fn scaling() -> Scaling {
    Scaling {
        q_center: vec![0.0, 0.3, 0.0],
        q_scale: vec![1.0, 0.7, 1.0],
        qd_scale: vec![2.0, 0.8, 3.0],
        energy: 5.0,
        cyclic: vec![2],
    }
}

/// Derivatives by hyper-dual numbers through the plain evaluation.
fn oracle(value: impl Fn(&[HyperDual64], &[HyperDual64]) -> HyperDual64, x: &[f64]) -> Vec<f64> {
    let d = x.len();
    let second = |i: usize, j: usize| {
        let mut state: Vec<HyperDual64> = x.iter().map(|&x| HyperDual64::from_re(x)).collect();
        state[i].eps1 = 1.0;
        state[j].eps2 = 1.0;
        let (q, qd) = state.split_at(d / 2);
        value(q, qd).eps1eps2
    };
    (0..d * d).map(|ij| second(ij / d, ij % d)).collect()
}

/// Compares at random states, several at once and one alone.
fn agree(
    lagrangian: &dyn Lagrangian,
    value: impl Fn(&[HyperDual64], &[HyperDual64]) -> HyperDual64,
    tolerance: f64,
) {
    let n = lagrangian.coordinates().dof();
    for m in [1, 5, 16, 19] {
        let mut rng = ChaCha8Rng::seed_from_u64(m as u64);
        let q = uniform(&mut rng, m * n, -1.5, 1.5);
        let qd = uniform(&mut rng, m * n, -2.0, 2.0);
        let mut curvature = Curvature::default();
        lagrangian.jets().curvature(&q, &qd, &mut curvature);
        for k in 0..m {
            let state = [&q[k * n..(k + 1) * n], &qd[k * n..(k + 1) * n]].concat();
            let all = oracle(&value, &state);
            let entry = |i: usize, j: usize| all[i * 2 * n + j];
            let of = |x: &[f64]| x[k * n * n..(k + 1) * n * n].to_vec();
            let qq: Vec<f64> = (0..n * n).map(|ij| entry(ij / n, ij % n)).collect();
            let pq: Vec<f64> = (0..n * n).map(|ij| entry(n + ij / n, ij % n)).collect();
            let (found_qq, found_pq) = (of(&curvature.dl_dqdq), of(&curvature.dp_dq));
            assert!(apart(&found_qq, &qq) < tolerance, "{found_qq:?} {qq:?}");
            assert!(apart(&found_pq, &pq) < tolerance, "{found_pq:?} {pq:?}");
        }
    }
}

#[test]
fn a_network_has_the_second_derivatives_of_its_plain_evaluation() {
    for form in [Form::Free, Form::Convex] {
        let config = LnnConfig {
            form,
            width: 32,
            ..LnnConfig::default()
        };
        let lnn = Lnn::random(mixed_coordinates(), config, scaling(), 3).unwrap();
        agree(&lnn, |q, qd| lnn.lagrangian(q, qd), 1e-12);
    }
}

#[test]
fn a_deep_lagrangian_network_has_them_by_differences() {
    let config = DelanConfig {
        vector_potential: true,
        ..DelanConfig::default()
    };
    let delan = Delan::random(mixed_coordinates(), config, scaling(), 3).unwrap();
    agree(&delan, |q, qd| delan.lagrangian(q, qd), 1e-9);
    let lnn = Lnn::random(mixed_coordinates(), LnnConfig::default(), scaling(), 4).unwrap();
    let sum = Sum::new(delan.clone(), lnn.clone()).unwrap();
    agree(
        &sum,
        |q, qd| delan.lagrangian(q, qd) + lnn.lagrangian(q, qd),
        1e-9,
    );
}
