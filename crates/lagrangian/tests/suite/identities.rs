//! Laws of mechanics on random Lagrangians of no known system: they must hold for any L.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{Analytic, Domain, Parameter, System, systems};
use lagrangian::mechanics::{
    Dissipation, EulerLagrange, Evaluation, Jet, Lagrangian, Mechanical, bias,
};
use lagrangian::{Coordinates, Evaluator, Model, State};
use num_dual::DualNum;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const UNITS: usize = 8;

/// L = |q̇|² ± q̇ₙ² + Σₖ aₖ tanh(uₖ·cos q + vₖ·sin q + wₖ·q̇): not quadratic, not separable.
///
/// `family` 1 adds dF/dt with F = sin(Σ q) (another gauge), 2 multiplies by −3.5, 3 makes M indefinite.
#[derive(Clone)]
struct Arbitrary {
    n: usize,
    weights: Vec<f64>,
    family: usize,
}

impl System for Arbitrary {
    const NAME: &'static str = "arbitrary";
    const ABOUT: &'static str = "a random network";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter {
            name: "n",
            unit: "",
            value: 2.0,
            domain: Domain::Count,
        },
        Parameter {
            name: "seed",
            unit: "",
            value: 1.0,
            domain: Domain::Finite,
        },
        Parameter {
            name: "family",
            unit: "",
            value: 0.0,
            domain: Domain::Finite,
        },
    ];

    fn new(values: &[f64]) -> Self {
        let n = values[0] as usize;
        let mut rng = ChaCha8Rng::seed_from_u64(values[1] as u64);
        let weights = (0..UNITS * (3 * n + 1))
            .map(|_| rng.random_range(-0.5..0.5))
            .collect();
        Self {
            n,
            weights,
            family: values[2] as usize,
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::angles(self.n)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let mut l = qd.iter().fold(D::from(0.0), |sum, v| sum + *v * *v);
        if self.family == 3 {
            l -= qd[self.n - 1] * qd[self.n - 1] * 4.0;
        }
        for w in self.weights.chunks_exact(3 * self.n + 1) {
            let mut z = D::from(0.0);
            for i in 0..self.n {
                z += q[i].cos() * w[3 * i] + q[i].sin() * w[3 * i + 1] + qd[i] * w[3 * i + 2];
            }
            l += z.tanh() * w[3 * self.n];
        }
        let (sum, rate) = q
            .iter()
            .zip(qd)
            .fold((D::from(0.0), D::from(0.0)), |(s, r), (q, v)| {
                (s + *q, r + *v)
            });
        match self.family {
            1 => l + sum.cos() * rate,
            2 => l * -3.5,
            _ => l,
        }
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(random(rng, self.n, 3.0), random(rng, self.n, 2.0))
    }
}

fn random(rng: &mut dyn Rng, n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-size..size)).collect()
}

fn arbitrary(n: usize, seed: u64, family: usize) -> Analytic<Arbitrary> {
    Analytic::new(Arbitrary::new(&[n as f64, seed as f64, family as f64]))
}

fn jet(lagrangian: &dyn Lagrangian, q: &[f64], qd: &[f64]) -> Jet {
    let mut jet = Jet::default();
    lagrangian.jets().jet(q, qd, &mut jet);
    jet
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!(
            (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs())),
            "{a} is not {b}"
        );
    }
}

/// d/ds of `f` at 0 by differences of order 6.
fn derivative(f: &mut dyn FnMut(f64) -> f64) -> f64 {
    derivative_with_step(4e-3, f)
}

fn derivative_with_step(h: f64, f: &mut dyn FnMut(f64) -> f64) -> f64 {
    let mut slope = |k: f64| (f(k * h) - f(-k * h)) / h;
    (45.0 * slope(1.0) - 9.0 * slope(2.0) + slope(3.0)) / 60.0
}

fn along(x: &[f64], slope: &[f64], s: f64) -> Vec<f64> {
    x.iter().zip(slope).map(|(x, d)| x + s * d).collect()
}

fn power_balance(model: &dyn Model, start: &State, tau: &[f64], friction: &[f64]) -> [f64; 2] {
    let mut evaluator = model.evaluator();
    let mut qdd = vec![0.0; tau.len()];
    let _ = evaluator.forward_dynamics(&start.q, &start.qd, tau, &mut qdd);
    // The faster the velocity changes, the shorter the step.
    let fastest = qdd.iter().fold(1.0, |fastest: f64, a| fastest.max(a.abs()));
    let rate = derivative_with_step(4e-3 / fastest.sqrt().max(1.0), &mut |s| {
        let mut energy = [0.0];
        let (q, qd) = (along(&start.q, &start.qd, s), along(&start.qd, &qdd, s));
        assert!(evaluator.energy(&q, &qd, &mut energy).is_finite());
        energy[0]
    });
    let forces = tau.iter().zip(friction).zip(&start.qd);
    let power: f64 = forces.map(|((tau, d), v)| (tau - d) * v).sum();
    [rate, power]
}

#[test]
fn energy_changes_by_the_power_of_the_forces_and_of_friction() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for n in 1..=5 {
        for family in [0, 1, 2, 3] {
            let model = arbitrary(n, n as u64, family);
            let start = model.system().sample_state(&mut rng);
            let tau = random(&mut rng, n, 3.0);
            let [rate, power] = power_balance(&model, &start, &tau, &vec![0.0; n]);
            close(&[rate], &[power], 1e-10);
            let friction = Dissipation {
                viscous: vec![0.3; n],
                coulomb: vec![0.2; n],
                smoothing: vec![0.1; n],
                ..Dissipation::default()
            };
            let mut d = vec![0.0; n];
            friction.force(&start.qd, &mut d);
            let model = Mechanical::dissipative(model, friction).unwrap();
            let [rate, power] = power_balance(&model, &start, &tau, &d);
            close(&[rate], &[power], 1e-10);
        }
    }
}

#[test]
fn every_analytic_system_balances_power() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for entry in systems() {
        // Far from the speed of light, where differences would be inaccurate.
        let relativistic = entry.name.starts_with("relativistic");
        let model = entry
            .build(if relativistic { &[("field", 1.0)] } else { &[] })
            .unwrap();
        for _ in 0..5 {
            let mut start = model.sample_state(&mut rng);
            if relativistic {
                start.qd[0] *= 0.5;
            }
            let tau = random(&mut rng, start.q.len(), 1.0);
            let [rate, power] = power_balance(&*model, &start, &tau, &vec![0.0; tau.len()]);
            close(&[rate], &[power], 1e-8);
        }
    }
}

#[test]
fn derivatives_of_a_lagrangian_are_those_of_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    for n in 1..=4 {
        let model = arbitrary(n, 7 + n as u64, 1);
        let State { q, qd } = model.system().sample_state(&mut rng);
        let exact = jet(&model, &q, &qd);
        for i in 0..n {
            let mut e = vec![0.0; n];
            e[i] = 1.0;
            let dl_dq = derivative(&mut |s| jet(&model, &along(&q, &e, s), &qd).lagrangian[0]);
            let p = derivative(&mut |s| jet(&model, &q, &along(&qd, &e, s)).lagrangian[0]);
            let drift = derivative(&mut |s| jet(&model, &along(&q, &qd, s), &qd).momentum[i]);
            close(
                &[dl_dq, p, drift],
                &[exact.dl_dq[i], exact.momentum[i], exact.momentum_drift[i]],
                1e-10,
            );
            for j in 0..n {
                let m = derivative(&mut |s| jet(&model, &q, &along(&qd, &e, s)).momentum[j]);
                close(
                    &[m, m],
                    &[exact.mass_matrix[i * n + j], exact.mass_matrix[j * n + i]],
                    1e-10,
                );
            }
        }
    }
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics_also_where_the_mass_is_indefinite() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    for n in 1..=7 {
        for family in [0, 2, 3] {
            let model = arbitrary(n, 20 + n as u64, family);
            // A batch of states at once.
            let (q, qd) = (random(&mut rng, 3 * n, 3.0), random(&mut rng, 3 * n, 2.0));
            let qdd = random(&mut rng, 3 * n, 5.0);
            let friction = Dissipation::viscous(vec![0.4; n]);
            let mut evaluator = EulerLagrange::new(&model, Some(&friction));
            let (mut tau, mut back) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
            assert!(
                evaluator
                    .inverse_dynamics(&q, &qd, &qdd, &mut tau)
                    .is_finite()
            );
            assert_eq!(
                evaluator
                    .forward_dynamics(&q, &qd, &tau, &mut back)
                    .singular(),
                0
            );
            close(&back, &qdd, 1e-11);
        }
    }
}

#[test]
fn a_total_derivative_and_a_factor_leave_the_motion_alone() {
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    for n in 1..=4 {
        let State { q, qd } = arbitrary(n, 5, 0).system().sample_state(&mut rng);
        let accelerations = [0, 1, 2].map(|family| {
            let mut qdd = vec![0.0; n];
            let model = arbitrary(n, 5, family);
            let _ = model
                .evaluator()
                .forward_dynamics(&q, &qd, &vec![0.0; n], &mut qdd);
            qdd
        });
        close(&accelerations[1], &accelerations[0], 1e-12);
        close(&accelerations[2], &accelerations[0], 1e-12);
    }
}

#[test]
fn coriolis_forces_of_a_quadratic_kinetic_energy_do_half_the_work_of_the_changing_mass() {
    // q̇ᵀ(Ṁ − 2C)q̇ = 0, with C q̇ = c(q, q̇) − c(q, 0).
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    for name in ["double-pendulum", "n-link-pendulum"] {
        let model = lagrangian::analytic::by_name(name, &[]).unwrap();
        let State { q, qd } = model.sample_state(&mut rng);
        let n = q.len();
        let bias_at = |qd: &[f64]| {
            let mut c = vec![0.0; n];
            bias(&jet(model.lagrangian(), &q, qd), &mut c);
            c
        };
        let (moving, still) = (bias_at(&qd), bias_at(&vec![0.0; n]));
        let work: f64 = (0..n).map(|i| qd[i] * (moving[i] - still[i])).sum();
        let change = derivative(&mut |s| {
            let m = jet(model.lagrangian(), &along(&q, &qd, s), &qd).mass_matrix;
            (0..n * n).map(|ij| qd[ij / n] * m[ij] * qd[ij % n]).sum()
        });
        close(&[2.0 * work], &[change], 1e-7);
    }
}

/// L = ½ (q̇₁ + q̇₂)² − ½ (q₁ + q₂)²: only the sum of the coordinates has a mass.
struct Degenerate;

impl System for Degenerate {
    const NAME: &'static str = "degenerate";
    const ABOUT: &'static str = "a mass matrix of rank 1";
    const PARAMETERS: &'static [Parameter] = &[];

    fn new(_: &[f64]) -> Self {
        Self
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(2)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (x, v) = (q[0] + q[1], qd[0] + qd[1]);
        (v * v - x * x) * 0.5
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(random(rng, 2, 1.0), random(rng, 2, 1.0))
    }
}

#[test]
fn a_singular_mass_matrix_is_counted_and_moves_with_the_least_acceleration() {
    let model = Analytic::<Degenerate>::standard();
    let mut qdd = [0.0; 4];
    let q = [0.5, 0.3, 1.0, 1.0];
    let outcome = model
        .evaluator()
        .forward_dynamics(&q, &[0.0; 4], &[0.0; 4], &mut qdd);
    assert_eq!(outcome, Evaluation::Singular { states: 2 });
    close(&qdd, &[-0.4, -0.4, -1.0, -1.0], 1e-14);
}
