//! The second derivatives of L that involve q: what the second variation of the action needs beside M.

use super::{Jet, Jets};
use crate::Coordinates;

/// ∂²L/∂q∂q and ∂p/∂q at a batch of `m` states, row-major (theory.md, equation 75).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curvature {
    /// ∂²L/∂qᵢ∂qⱼ, symmetric, `[m, n, n]`.
    pub dl_dqdq: Vec<f64>,
    /// ∂pᵢ/∂qⱼ = ∂²L/∂q̇ᵢ∂qⱼ, `[m, n, n]`; its rows times q̇ are [`Jet::momentum_drift`].
    pub dp_dq: Vec<f64>,
}

impl Curvature {
    /// Sizes both fields for `m` states of `n` degrees of freedom; allocates only when it grows.
    pub fn resize(&mut self, m: usize, n: usize) {
        self.dl_dqdq.resize(m * n * n, 0.0);
        self.dp_dq.resize(m * n * n, 0.0);
    }

    /// Holds the parameters among the coordinates at state `row`, as [`Jet::hold`] does.
    pub(crate) fn hold(&mut self, coordinates: &Coordinates, row: usize) {
        let n = coordinates.dof();
        for i in coordinates.parameters() {
            for j in 0..n {
                let (across, down) = ((row * n + i) * n + j, (row * n + j) * n + i);
                for field in [&mut self.dl_dqdq, &mut self.dp_dq] {
                    (field[across], field[down]) = (0.0, 0.0);
                }
            }
        }
    }

    /// Multiplies those at state `row` of `n` degrees of freedom.
    pub(crate) fn scale(&mut self, row: usize, n: usize, factor: f64) {
        for field in [&mut self.dl_dqdq, &mut self.dp_dq] {
            let own = &mut field[row * n * n..][..n * n];
            own.iter_mut().for_each(|x| *x *= factor);
        }
    }

    /// Adds those of another Lagrangian at the same states.
    pub fn add(&mut self, other: &Self) {
        let pairs = [
            (&mut self.dl_dqdq, &other.dl_dqdq),
            (&mut self.dp_dq, &other.dp_dq),
        ];
        for (own, other) in pairs {
            own.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        }
    }
}

/// A step of q over which a Lagrangian of coordinates of order one is smooth: the error of the formula, h⁴, is then
/// as small as that of rounding, 1e-16/h.
pub(crate) const STEP: f64 = 1e-3;

/// Weights of f(x + k h), k = −2, −1, 1, 2, in h f′(x): error h⁴ f⁽⁵⁾/30 (Abramowitz, Stegun 1964, 25.3.6).
const NEIGHBOURS: [(f64, f64); 4] = [
    (-2.0, 1.0 / 12.0),
    (-1.0, -2.0 / 3.0),
    (1.0, 2.0 / 3.0),
    (2.0, -1.0 / 12.0),
];

/// Central differences of ∂L/∂q and p over steps h of each coordinate, all in one batch of 4 n m states.
pub(crate) fn differences<J: Jets + ?Sized>(
    jets: &mut J,
    (q, qd): (&[f64], &[f64]),
    steps: &[f64],
    curvature: &mut Curvature,
) {
    let n = steps.len();
    let m = q.len() / n.max(1);
    curvature.resize(m, n);
    let around = NEIGHBOURS.len() * n;
    let (mut near, mut speeds) = (Vec::new(), Vec::new());
    for (q, qd) in q.chunks_exact(n).zip(qd.chunks_exact(n)) {
        for (j, step) in steps.iter().enumerate() {
            for (k, _) in NEIGHBOURS {
                let at = near.len();
                near.extend_from_slice(q);
                near[at + j] += k * step;
                speeds.extend_from_slice(qd);
            }
        }
    }
    let mut jet = Jet::default();
    jets.jet(&near, &speeds, &mut jet);
    let slope = |signal: &[f64], state: usize, i: usize, j: usize| {
        let value = |k: usize| signal[(state * around + j * NEIGHBOURS.len() + k) * n + i];
        let terms = NEIGHBOURS.iter().enumerate();
        terms.map(|(k, (_, weight))| weight * value(k)).sum::<f64>() / steps[j]
    };
    for state in 0..m {
        for i in 0..n {
            for j in 0..n {
                let at = (state * n + i) * n + j;
                let both = slope(&jet.dl_dq, state, i, j) + slope(&jet.dl_dq, state, j, i);
                curvature.dl_dqdq[at] = 0.5 * both;
                curvature.dp_dq[at] = slope(&jet.momentum, state, i, j);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use num_dual::HyperDual64;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::mechanics::analytic::{systems, uniform};
    use crate::mechanics::lagrangian::{Lagrangian, Scaling, Sum};
    use crate::models::delan::{Delan, DelanConfig};
    use crate::models::lnn::{Form, Lnn, LnnConfig};
    use crate::{Coordinate, Topology};

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
        }
    }

    /// By hyper-dual numbers through the plain evaluation.
    fn oracle(
        value: impl Fn(&[HyperDual64], &[HyperDual64]) -> HyperDual64,
        x: &[f64],
    ) -> Vec<f64> {
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

    #[test]
    fn of_every_analytic_system_they_agree_with_differences_and_with_the_drift_of_the_momentum() {
        for entry in systems() {
            let system = entry.build(&[]).unwrap();
            let n = system.coordinates().dof();
            let state = system.sample_state(&mut ChaCha8Rng::seed_from_u64(1));
            let mut jets = system.lagrangian().jets();
            let (mut exact, mut near) = (Curvature::default(), Curvature::default());
            jets.curvature(&state.q, &state.qd, &mut exact);
            differences(&mut *jets, (&state.q, &state.qd), &vec![STEP; n], &mut near);
            let pairs = [(&near.dl_dqdq, &exact.dl_dqdq), (&near.dp_dq, &exact.dp_dq)];
            for (near, exact) in pairs {
                // Derivatives that are 0 are so to rounding over a step.
                let size = exact.iter().fold(1e-3, |s: f64, x| s.max(x.abs()));
                let mut both = near.iter().zip(exact);
                assert!(
                    both.all(|(a, b)| (a - b).abs() < 1e-7 * size),
                    "{}",
                    entry.name
                );
            }
            let mut jet = Jet::default();
            jets.jet(&state.q, &state.qd, &mut jet);
            for (row, drift) in exact.dp_dq.chunks_exact(n).zip(&jet.momentum_drift) {
                let sum: f64 = row.iter().zip(&state.qd).map(|(a, b)| a * b).sum();
                assert!(
                    (sum - drift).abs() <= 1e-12 * (1.0 + drift.abs()),
                    "{}",
                    entry.name
                );
            }
        }
    }
}
