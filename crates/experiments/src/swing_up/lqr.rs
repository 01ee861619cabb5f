//! A linear-quadratic regulator about an equilibrium of any model.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | x = (q − q*, q̇) | state | 2n |
//! | A, B | x′ = A x + B u, from differences of the forward dynamics | `[2n, 2n]`, `[2n]` |
//! | F, G | the same over one tick: exp of [A B; 0 0] h | |
//! | Q, R, P, K | costs of state and input, cost to go, gain | |
//!
//! One input. P is the limit of P ← Q + Fᵀ P F − Fᵀ P G (R + Gᵀ P G)⁻¹ Gᵀ P F, u = −K x (theory.md, 55 and 56).

use lagrangian::mechanics::dot;
use lagrangian::{Error, Model, Result};

/// A model near an equilibrium: x′ = A x + B u.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linearisation {
    /// A, `[2n, 2n]`.
    pub(crate) a: Vec<f64>,
    /// B, the column of the one input, `[2n]`.
    pub(crate) b: Vec<f64>,
}

/// Step of the differences, in rad, rad/s and N·m (of order one): rounding and curvature both stay below 1e-8.
const STEP: f64 = 1e-5;

impl Linearisation {
    /// Linearises `model` about (`q`, 0) without force, with the force on coordinate `actuated` as input.
    ///
    /// # Errors
    /// [`Error::NotFinite`] where the model is not finite there.
    pub(crate) fn about(model: &dyn Model, q: &[f64], actuated: usize) -> Result<Self> {
        let n = q.len();
        let mut evaluator = model.evaluator();
        let at = vec![0.0; 3 * n];
        let mut slope = |k: usize| -> Vec<f64> {
            let mut ends = [vec![0.0; n], vec![0.0; n]];
            for (end, step) in ends.iter_mut().zip([-STEP, STEP]) {
                let mut x = at.clone();
                x[..n].copy_from_slice(q);
                x[k] += step;
                let _ = evaluator.forward_dynamics(&x[..n], &x[n..2 * n], &x[2 * n..], end);
            }
            let pairs = ends[0].iter().zip(&ends[1]);
            pairs
                .map(|(low, high)| (high - low) / (2.0 * STEP))
                .collect()
        };
        let size = 2 * n;
        let (mut a, mut b) = (vec![0.0; size * size], vec![0.0; size]);
        for k in 0..size {
            for (i, x) in slope(k).into_iter().enumerate() {
                a[(n + i) * size + k] = x;
            }
        }
        (0..n).for_each(|i| a[i * size + n + i] = 1.0);
        b[n..].copy_from_slice(&slope(2 * n + actuated));
        if let Some(index) = a.iter().chain(&b).position(|x| !x.is_finite()) {
            return Err(Error::not_finite("linearisation of the model", index));
        }
        Ok(Self { a, b })
    }

    /// F and G over a tick of `h` seconds, by the power series of the exponential.
    fn over(&self, h: f64) -> Discrete {
        let size = self.b.len();
        let (mut f, mut g) = (identity(size), vec![0.0; size]);
        // term = (A h)ᵏ / k!, and Σ Aᵏ hᵏ⁺¹ / (k + 1)! B.
        let mut term = identity(size);
        for k in 1..=TERMS {
            let scaled: Vec<f64> = term.iter().map(|x| x * h / k as f64).collect();
            g.iter_mut()
                .zip(times(&scaled, &self.b, 1))
                .for_each(|(g, x)| *g += x);
            term = times(&scaled, &self.a, size);
            f.iter_mut().zip(&term).for_each(|(f, x)| *f += x);
        }
        Discrete { f, g }
    }
}

/// The linearised model over one tick: x ← F x + G u.
struct Discrete {
    f: Vec<f64>,
    g: Vec<f64>,
}

/// Terms of the exponential: exact to rounding where ‖A‖ h < 1.
const TERMS: usize = 18;
/// The largest number of ticks of the recursion.
const HORIZON: usize = 200_000;

/// A linear-quadratic regulator, u = −K (q − q*, q̇).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lqr {
    /// K, `[2n]`.
    pub(crate) gain: Vec<f64>,
    /// P, `[2n, 2n]`.
    pub(crate) cost_to_go: Vec<f64>,
}

impl Lqr {
    /// The regulator for a tick of `h` seconds, the costs `state` of x² (`[2n]`) and the cost `input` of u².
    ///
    /// # Errors
    /// [`Error::Argument`] for costs or a tick outside their domain, or where the input cannot stabilise the state.
    pub(crate) fn design(
        linear: &Linearisation,
        h: f64,
        state: &[f64],
        input: f64,
    ) -> Result<Self> {
        let size = linear.b.len();
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if !(h > 0.0 && h <= 0.1) {
            return argument("tick", h.to_string(), "above 0 and at most 0.1 s");
        }
        let fits = state.len() == size && state.iter().all(|x| x.is_finite() && *x >= 0.0);
        if !(fits && input.is_finite() && input > 0.0) {
            let must = "one for each of q and q̇, 0 or above, and above 0 for the input";
            return argument("costs", format!("{state:?} and {input}"), must);
        }
        let tick = linear.over(h);
        let mut p = diagonal(state);
        for _ in 0..HORIZON {
            let Lqr {
                gain,
                cost_to_go: next,
            } = tick.backward(&p, state, input);
            let change = next
                .iter()
                .zip(&p)
                .fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            let largest = next.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            p = next;
            if change <= 1e-11 * largest {
                return Ok(Self {
                    gain,
                    cost_to_go: p,
                });
            }
            if !largest.is_finite() {
                break;
            }
        }
        let must = "one that the drive can hold at this equilibrium";
        argument("linearised model", "not stabilisable".into(), must)
    }

    /// The input u for a deviation x from the equilibrium, `[2n]`.
    #[must_use]
    pub(crate) fn input(&self, x: &[f64]) -> f64 {
        -self.gain.iter().zip(x).map(|(k, x)| k * x).sum::<f64>()
    }
}

impl Discrete {
    /// One tick of the Riccati recursion, from the cost to go `p` after the tick to that before it.
    fn backward(&self, p: &[f64], state: &[f64], input: f64) -> Lqr {
        let Self { f, g } = self;
        let size = g.len();
        let pf = times(p, f, size);
        let pg = times(p, g, 1);
        let stiffness = input + dot(g, &pg);
        let gain: Vec<f64> = times(g, &pf, size).iter().map(|x| x / stiffness).collect();
        let mut next = diagonal(state);
        for i in 0..size {
            for j in 0..size {
                let carried: f64 = (0..size).map(|k| f[k * size + i] * pf[k * size + j]).sum();
                next[i * size + j] += carried - stiffness * gain[i] * gain[j];
            }
        }
        Lqr {
            gain,
            cost_to_go: next,
        }
    }
}

/// The product of a row-major matrix (or a row) with one of `columns` columns.
fn times(a: &[f64], b: &[f64], columns: usize) -> Vec<f64> {
    let inner = b.len() / columns;
    let rows = a.chunks_exact(inner);
    let entry = |row: &[f64], j| (0..inner).map(|k| row[k] * b[k * columns + j]).sum();
    rows.flat_map(|row| (0..columns).map(move |j| entry(row, j)))
        .collect()
}

fn identity(size: usize) -> Vec<f64> {
    diagonal(&vec![1.0; size])
}

fn diagonal(entries: &[f64]) -> Vec<f64> {
    let size = entries.len();
    let entry = |at: usize| {
        if at / size == at % size {
            entries[at / size]
        } else {
            0.0
        }
    };
    (0..size * size).map(entry).collect()
}
