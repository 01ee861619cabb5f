//! What the outputs of a deep Lagrangian network mean at one state: L/E = ½ |Gᵀv|² + A·v − V and its derivatives
//! (theory.md, section 14).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | o | outputs: diagonal of G before softplus, entries below it, V, A | |
//! | G, G′ | lower triangular factor and its change along q̇ | n × n |
//! | v, a | q̇ and q̈ in units of the velocities | n |
//! | u = Gᵀv, w = G′ᵀv + Gᵀa | | n |
//! | π = G u + A, π′ = G′u + G w + A′ | momentum and its rate | n |

use crate::solve::dot;

/// The output that entry (i, j) of G is, j < i.
pub(crate) fn below(n: usize, i: usize, j: usize) -> usize {
    n + i * (i - 1) / 2 + j
}

/// Scratch for one state, read off the outputs of its pass.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    n: usize,
    shift: f64,
    vector_potential: bool,
    /// G and G′, row-major, zero above the diagonal.
    g: Vec<f64>,
    g_rate: Vec<f64>,
    /// softplus′ and softplus″ of the diagonal, and the rate of its argument.
    first: Vec<f64>,
    second: Vec<f64>,
    diagonal_rate: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    u: Vec<f64>,
    w: Vec<f64>,
    potential: f64,
    linear: Vec<f64>,
    linear_rate: Vec<f64>,
    /// Gᵀβ, G′ᵀβ and Ĝᵀv of [`Factor::sensitivities`].
    along: [Vec<f64>; 3],
}

impl Factor {
    pub(crate) fn new(n: usize, vector_potential: bool, shift: f64) -> Self {
        let (row, square) = (|| vec![0.0; n], || vec![0.0; n * n]);
        Self {
            n,
            shift,
            vector_potential,
            g: square(),
            g_rate: square(),
            first: row(),
            second: row(),
            diagonal_rate: row(),
            v: row(),
            a: row(),
            u: row(),
            w: row(),
            potential: 0.0,
            linear: row(),
            linear_rate: row(),
            along: [row(), row(), row()],
        }
    }

    /// Reads G, V and A from `output(c, o)`, with c = 0 the value and 1 its change along q̇; a = 0.
    pub(crate) fn read(&mut self, output: impl Fn(usize, usize) -> f64, v: impl Fn(usize) -> f64) {
        let n = self.n;
        for i in 0..n {
            self.v[i] = v(i);
            let (value, first, second) = softplus(output(0, i));
            self.first[i] = first;
            self.second[i] = second;
            self.diagonal_rate[i] = output(1, i);
            self.g[i * n + i] = value + self.shift;
            self.g_rate[i * n + i] = first * self.diagonal_rate[i];
            for j in 0..i {
                self.g[i * n + j] = output(0, below(n, i, j));
                self.g_rate[i * n + j] = output(1, below(n, i, j));
            }
        }
        let at = n * (n + 1) / 2;
        self.potential = output(0, at);
        if self.vector_potential {
            for i in 0..n {
                self.linear[i] = output(0, at + 1 + i);
                self.linear_rate[i] = output(1, at + 1 + i);
            }
        }
        transposed_product(n, &self.g, &self.v, &mut self.u);
        self.accelerate(|_| 0.0);
    }

    /// Sets the acceleration a.
    pub(crate) fn accelerate(&mut self, a: impl Fn(usize) -> f64) {
        let n = self.n;
        for i in 0..n {
            self.a[i] = a(i);
        }
        transposed_product(n, &self.g_rate, &self.v, &mut self.w);
        for j in 0..n {
            self.w[j] += (j..n).map(|i| self.g[i * n + j] * self.a[i]).sum::<f64>();
        }
    }

    /// L/E.
    pub(crate) fn lagrangian(&self) -> f64 {
        self.kinetic() + dot(&self.linear, &self.v) - self.potential
    }

    /// ½ |Gᵀv|².
    pub(crate) fn kinetic(&self) -> f64 {
        0.5 * dot(&self.u, &self.u)
    }

    /// V/E.
    pub(crate) fn potential(&self) -> f64 {
        self.potential
    }

    /// πᵢ.
    pub(crate) fn momentum(&self, i: usize) -> f64 {
        self.linear[i] + dot(self.row(i), &self.u[..=i])
    }

    /// π′ᵢ.
    pub(crate) fn momentum_rate(&self, i: usize) -> f64 {
        let rate = &self.g_rate[i * self.n..][..=i];
        self.linear_rate[i] + dot(rate, &self.u[..=i]) + dot(self.row(i), &self.w[..=i])
    }

    /// (G Gᵀ)ᵢⱼ.
    pub(crate) fn mass(&self, i: usize, j: usize) -> f64 {
        let m = i.min(j);
        dot(&self.row(i)[..=m], &self.row(j)[..=m])
    }

    /// The change of (G Gᵀ)ᵢⱼ with G′.
    pub(crate) fn mass_rate(&self, i: usize, j: usize) -> f64 {
        let m = i.min(j);
        let rate = |i: usize| &self.g_rate[i * self.n..][..=m];
        dot(rate(i), &self.row(j)[..=m]) + dot(&self.row(i)[..=m], rate(j))
    }

    /// Row i of G up to its diagonal.
    fn row(&self, i: usize) -> &[f64] {
        &self.g[i * self.n..][..=i]
    }

    /// ∂(L/E)/∂o at fixed v, for every output.
    pub(crate) fn seeds(&self, seed: &mut [f64]) {
        let n = self.n;
        for i in 0..n {
            seed[i] = self.v[i] * self.u[i] * self.first[i];
            for j in 0..i {
                seed[below(n, i, j)] = self.v[i] * self.u[j];
            }
        }
        seed[n * (n + 1) / 2] = -1.0;
        if self.vector_potential {
            seed[n * (n + 1) / 2 + 1..].copy_from_slice(&self.v);
        }
    }

    /// Sensitivities of S = β·π′ + Σₒ (∂(L/E)/∂o) ôₒ to o′ (`to_rate`) and to o (`to_value`), with ô the change of
    /// the outputs along one more direction (theory.md, equation 31).
    pub(crate) fn sensitivities(
        &mut self,
        beta: &[f64],
        hat: impl Fn(usize) -> f64,
        to_rate: &mut [f64],
        to_value: &mut [f64],
    ) {
        let n = self.n;
        let [g_beta, rate_beta, hat_v] = &mut self.along;
        transposed_product(n, &self.g, beta, g_beta);
        transposed_product(n, &self.g_rate, beta, rate_beta);
        for (j, sum) in hat_v.iter_mut().enumerate() {
            let rest = (j + 1..n).map(|i| hat(below(n, i, j)) * self.v[i]);
            *sum = self.first[j] * hat(j) * self.v[j] + rest.sum::<f64>();
        }
        let (u, v, a, w) = (&self.u, &self.v, &self.a, &self.w);
        for i in 0..n {
            for j in 0..=i {
                let rate = beta[i] * u[j] + g_beta[j] * v[i];
                let value = (rate_beta[j] + hat_v[j]) * v[i] + beta[i] * w[j] + g_beta[j] * a[i];
                if i > j {
                    let o = below(n, i, j);
                    (to_rate[o], to_value[o]) = (rate, value);
                } else {
                    to_rate[i] = rate * self.first[i];
                    let curved = self.diagonal_rate[i] * rate + hat(i) * v[i] * u[i];
                    to_value[i] = value * self.first[i] + curved * self.second[i];
                }
            }
        }
        let at = n * (n + 1) / 2;
        (to_rate[at], to_value[at]) = (0.0, 0.0);
        if self.vector_potential {
            to_rate[at + 1..].copy_from_slice(beta);
            to_value[at + 1..].fill(0.0);
        }
    }

    /// Writes ∂/∂v of the same scalar S at fixed outputs, `[n]`: (G G′ᵀ + G′ Gᵀ) β + (Ĝ Gᵀ + G Ĝᵀ) v + Â (theory.md,
    /// equation 96).
    pub(crate) fn velocity_slopes(
        &mut self,
        beta: &[f64],
        hat: impl Fn(usize) -> f64,
        slopes: &mut [f64],
    ) {
        let n = self.n;
        let [g_beta, rate_beta, hat_v] = &mut self.along;
        transposed_product(n, &self.g, beta, g_beta);
        transposed_product(n, &self.g_rate, beta, rate_beta);
        let hat_g = |i: usize, j: usize| match i == j {
            true => self.first[i] * hat(i),
            false => hat(below(n, i, j)),
        };
        for (j, sum) in hat_v.iter_mut().enumerate() {
            *sum = (j..n).map(|i| hat_g(i, j) * self.v[i]).sum();
        }
        for (i, slope) in slopes[..n].iter_mut().enumerate() {
            let (g, rate) = (&self.g[i * n..], &self.g_rate[i * n..]);
            let entry = |j: usize| {
                let along_v = hat_g(i, j) * self.u[j] + g[j] * hat_v[j];
                g[j] * rate_beta[j] + rate[j] * g_beta[j] + along_v
            };
            *slope = (0..=i).map(entry).sum();
            if self.vector_potential {
                *slope += hat(n * (n + 1) / 2 + 1 + i);
            }
        }
    }
}

/// out = Mᵀ x for a lower triangular M.
fn transposed_product(n: usize, m: &[f64], x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (i, &x) in x.iter().enumerate() {
        let row = &m[i * n..][..=i];
        out.iter_mut().zip(row).for_each(|(out, m)| *out += m * x);
    }
}

/// softplus and its first two derivatives.
fn softplus(x: f64) -> (f64, f64, f64) {
    let e = (-x.abs()).exp();
    let value = x.max(0.0) + e.ln_1p();
    let first = if x >= 0.0 {
        1.0 / (1.0 + e)
    } else {
        e / (1.0 + e)
    };
    (value, first, e / ((1.0 + e) * (1.0 + e)))
}
