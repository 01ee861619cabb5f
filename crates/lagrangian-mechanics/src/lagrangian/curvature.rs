//! The second derivatives of L that involve q, which the second variation of the action needs beside M.

use super::{Jet, Jets};
use lagrangian_motion::Coordinates;

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
    pub fn hold(&mut self, coordinates: &Coordinates, row: usize) {
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

    /// Multiplies the derivatives at state `row` of `n` degrees of freedom by a factor.
    pub(crate) fn scale(&mut self, row: usize, n: usize, factor: f64) {
        for field in [&mut self.dl_dqdq, &mut self.dp_dq] {
            let own = &mut field[row * n * n..][..n * n];
            own.iter_mut().for_each(|x| *x *= factor);
        }
    }

    /// Adds the derivatives of another Lagrangian at the same states.
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

/// Step of q for a Lagrangian that is smooth over coordinates of order one: the error of the formula, h⁴, is then
/// as small as the rounding error, 1e-16/h.
pub const STEP: f64 = 1e-3;

/// Weights of f(x + k h), k = −2, −1, 1, 2, in h f′(x): error h⁴ f⁽⁵⁾/30 (Abramowitz, Stegun 1964, 25.3.6).
const NEIGHBOURS: [(f64, f64); 4] = [
    (-2.0, 1.0 / 12.0),
    (-1.0, -2.0 / 3.0),
    (1.0, 2.0 / 3.0),
    (2.0, -1.0 / 12.0),
];

/// Central differences of ∂L/∂q and p over steps h of each coordinate, all in one batch of 4 n m states.
pub fn differences<J: Jets + ?Sized>(
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
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::analytic::systems;

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
                // Derivatives that are 0 are zero to rounding over a step.
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
