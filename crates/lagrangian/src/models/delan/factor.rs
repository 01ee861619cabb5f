//! The meaning of the outputs of a deep Lagrangian network: L/E = ½ |Gᵀv|² + A·v − V and its derivatives (theory.md,
//! section 14), at one state or at a vector of them.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | o | outputs: diagonal of G before softplus, entries below it, V, A | |
//! | G, G′ | lower triangular factor and its change along q̇ | n × n |
//! | v, a | q̇ and q̈ in units of the velocities | n |
//! | u = Gᵀv, w = G′ᵀv + Gᵀa | | n |
//! | π = G u + A, π′ = G′u + G w + A′ | momentum and its rate | n |
//!
//! Every number is a vector `V` over the states; for one state `V` is `f64`. Methods over a longer vector are called
//! inside a kernel only.

use nets::Activation;
use nets::simd::{Buffer, Real, Vector, set_vector, vector};

/// The number of the output that is entry (i, j) of G, j < i.
#[inline(always)]
pub(crate) fn below(n: usize, i: usize, j: usize) -> usize {
    n + i * (i - 1) / 2 + j
}

/// The position of entry (i, j) of a lower triangular matrix, j ≤ i.
#[inline(always)]
fn entry(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Scratch for one state or for a vector of them, read from the outputs of their pass.
#[derive(Debug, Clone)]
pub(crate) struct Factor<T = f64> {
    n: usize,
    /// The constant that is added to the diagonal of G.
    shift: f64,
    /// Whether the outputs include A.
    vector_potential: bool,
    /// The lower triangle of G, row by row.
    g: WithRate<T>,
    diagonal: Diagonal<T>,
    /// q̇ in units of the velocities.
    v: Buffer<T>,
    /// q̈ in the same units.
    a: Buffer<T>,
    /// Gᵀv.
    u: Buffer<T>,
    /// G′ᵀv + Gᵀa.
    w: Buffer<T>,
    /// V, one number.
    potential: Buffer<T>,
    /// The vector potential A.
    linear: WithRate<T>,
    /// Gᵀβ, G′ᵀβ and Ĝᵀv of [`Factor::velocity_slopes`].
    along: [Buffer<T>; 3],
}

/// A quantity and its change along q̇.
#[derive(Debug, Clone)]
struct WithRate<T> {
    value: Buffer<T>,
    rate: Buffer<T>,
}

/// Derivatives of the diagonal of G, which is softplus of its outputs.
#[derive(Debug, Clone)]
struct Diagonal<T> {
    /// softplus′.
    first: Buffer<T>,
    /// softplus″.
    second: Buffer<T>,
    /// The change of the outputs along q̇.
    rate: Buffer<T>,
}

impl<T: Real> Factor<T> {
    /// Scratch for vectors of `lanes` states.
    pub(crate) fn new(n: usize, vector_potential: bool, shift: f64, lanes: usize) -> Self {
        let row = || Buffer::new(n * lanes);
        let triangle = || Buffer::new(n * (n + 1) / 2 * lanes);
        Self {
            n,
            shift,
            vector_potential,
            g: WithRate {
                value: triangle(),
                rate: triangle(),
            },
            diagonal: Diagonal {
                first: row(),
                second: row(),
                rate: row(),
            },
            v: row(),
            a: row(),
            u: row(),
            w: row(),
            potential: Buffer::new(lanes),
            linear: WithRate {
                value: row(),
                rate: row(),
            },
            along: [row(), row(), row()],
        }
    }

    /// Reads G, V and A from `output(c, o)`, with c = 0 the value and 1 its change along q̇; a = 0.
    #[inline(always)]
    pub(crate) fn read<V: Vector<Elem = T>>(
        &mut self,
        output: impl Fn(usize, usize) -> V,
        v: impl Fn(usize) -> V,
    ) {
        let n = self.n;
        for i in 0..n {
            let (diagonal, rate) = (Activation::Softplus.derivatives(output(0, i)), output(1, i));
            set_vector(&mut self.v, i, v(i));
            set_vector(&mut self.diagonal.first, i, diagonal.first);
            set_vector(&mut self.diagonal.second, i, diagonal.second);
            set_vector(&mut self.diagonal.rate, i, rate);
            let value = diagonal.value.add(V::of(self.shift));
            set_vector(&mut self.g.value, entry(i, i), value);
            set_vector(&mut self.g.rate, entry(i, i), diagonal.first.mul(rate));
            for j in 0..i {
                set_vector(&mut self.g.value, entry(i, j), output(0, below(n, i, j)));
                set_vector(&mut self.g.rate, entry(i, j), output(1, below(n, i, j)));
            }
        }
        let at = n * (n + 1) / 2;
        set_vector(&mut self.potential, 0, output(0, at));
        if self.vector_potential {
            for i in 0..n {
                set_vector(&mut self.linear.value, i, output(0, at + 1 + i));
                set_vector(&mut self.linear.rate, i, output(1, at + 1 + i));
            }
        }
        transposed_product::<V>(n, &self.g.value, &self.v, &mut self.u);
        self.accelerate(|_| V::of(0.0));
    }

    /// Sets the acceleration a.
    #[inline(always)]
    pub(crate) fn accelerate<V: Vector<Elem = T>>(&mut self, a: impl Fn(usize) -> V) {
        let n = self.n;
        for i in 0..n {
            set_vector(&mut self.a, i, a(i));
        }
        for j in 0..n {
            let mut sum = V::of(0.0);
            for i in j..n {
                let (g, rate): (V, V) = (
                    vector(&self.g.value, entry(i, j)),
                    vector(&self.g.rate, entry(i, j)),
                );
                sum = rate.fma(vector(&self.v, i), g.fma(vector(&self.a, i), sum));
            }
            set_vector(&mut self.w, j, sum);
        }
    }

    /// L/E.
    #[inline(always)]
    pub(crate) fn lagrangian<V: Vector<Elem = T>>(&self) -> V {
        let linear = product::<V>(&self.linear.value, &self.v, self.n);
        let kinetic = V::of(0.5).mul(product(&self.u, &self.u, self.n));
        kinetic.add(linear).sub(vector(&self.potential, 0))
    }

    /// πᵢ.
    #[inline(always)]
    pub(crate) fn momentum<V: Vector<Elem = T>>(&self, i: usize) -> V {
        let own = product::<V>(row::<V>(&self.g.value, i), &self.u, i + 1);
        own.add(vector(&self.linear.value, i))
    }

    /// π′ᵢ.
    #[inline(always)]
    pub(crate) fn momentum_rate<V: Vector<Elem = T>>(&self, i: usize) -> V {
        let mut sum: V = vector(&self.linear.rate, i);
        for j in 0..=i {
            let (g, rate): (V, V) = (
                vector(&self.g.value, entry(i, j)),
                vector(&self.g.rate, entry(i, j)),
            );
            sum = rate.fma(vector(&self.u, j), g.fma(vector(&self.w, j), sum));
        }
        sum
    }

    /// (G Gᵀ)ᵢⱼ.
    #[inline(always)]
    pub(crate) fn mass<V: Vector<Elem = T>>(&self, i: usize, j: usize) -> V {
        let g = &self.g.value;
        product(row::<V>(g, i), row::<V>(g, j), i.min(j) + 1)
    }

    /// ∂(L/E)/∂o at fixed v, for every output.
    #[inline(always)]
    pub(crate) fn seeds<V: Vector<Elem = T>>(&self, seed: &mut [T]) {
        let n = self.n;
        for i in 0..n {
            let v: V = vector(&self.v, i);
            let first = vector(&self.diagonal.first, i);
            let own = v.mul(vector(&self.u, i)).mul(first);
            set_vector(seed, i, own);
            for j in 0..i {
                set_vector(seed, below(n, i, j), v.mul(vector(&self.u, j)));
            }
        }
        let at = n * (n + 1) / 2;
        set_vector(seed, at, V::of(-1.0));
        if self.vector_potential {
            for i in 0..n {
                set_vector::<V>(seed, at + 1 + i, vector(&self.v, i));
            }
        }
    }

    /// Sensitivities of S = β·π′ + Σₒ (∂(L/E)/∂o) ôₒ to o′ (`to_rate`) and to o (`to_value`), with ô the change of
    /// the outputs along one more direction (theory.md, equation 31).
    #[inline(always)]
    pub(crate) fn sensitivities<V: Vector<Elem = T>>(
        &mut self,
        beta: &[T],
        hat: impl Fn(usize) -> V,
        to_rate: &mut [T],
        to_value: &mut [T],
    ) {
        let n = self.n;
        for j in 0..n {
            // Gᵀβ and G′ᵀβ + Ĝᵀv of this column.
            let (mut g_beta, mut rest) = (V::of(0.0), V::of(0.0));
            for i in j..n {
                let (b, at) = (vector::<V>(beta, i), entry(i, j));
                g_beta = b.fma(vector(&self.g.value, at), g_beta);
                rest = b.fma(vector(&self.g.rate, at), rest);
                let mut hat = hat(if i == j { j } else { below(n, i, j) });
                if i == j {
                    hat = hat.mul(vector(&self.diagonal.first, j));
                }
                rest = hat.fma(vector(&self.v, i), rest);
            }
            let (u, w): (V, V) = (vector(&self.u, j), vector(&self.w, j));
            for i in j..n {
                let (b, v): (V, V) = (vector(beta, i), vector(&self.v, i));
                let rate = b.fma(u, g_beta.mul(v));
                let value = g_beta.fma(vector(&self.a, i), rest.fma(v, b.mul(w)));
                if i == j {
                    let first: V = vector(&self.diagonal.first, j);
                    let bend = hat(j).mul(v).mul(u);
                    let curved = rate.fma(vector(&self.diagonal.rate, j), bend);
                    let curved = curved.mul(vector(&self.diagonal.second, j));
                    set_vector(to_rate, j, rate.mul(first));
                    set_vector(to_value, j, value.fma(first, curved));
                } else {
                    set_vector(to_rate, below(n, i, j), rate);
                    set_vector(to_value, below(n, i, j), value);
                }
            }
        }
        let zero = V::of(0.0);
        for o in n * (n + 1) / 2..to_rate.len() / V::LANES {
            set_vector(to_rate, o, zero);
            set_vector(to_value, o, zero);
        }
        if self.vector_potential {
            for i in 0..n {
                set_vector::<V>(to_rate, n * (n + 1) / 2 + 1 + i, vector(beta, i));
            }
        }
    }

    /// Writes ∂/∂v of the same scalar S at fixed outputs, `[n]`: (G G′ᵀ + G′ Gᵀ) β + (Ĝ Gᵀ + G Ĝᵀ) v + Â (theory.md,
    /// equation 96).
    #[inline(always)]
    pub(crate) fn velocity_slopes<V: Vector<Elem = T>>(
        &mut self,
        beta: &[T],
        hat: impl Fn(usize) -> V,
        slopes: &mut [T],
    ) {
        let n = self.n;
        let [g_beta, rate_beta, hat_v] = &mut self.along;
        transposed_product::<V>(n, &self.g.value, beta, g_beta);
        transposed_product::<V>(n, &self.g.rate, beta, rate_beta);
        for j in 0..n {
            let own = hat(j).mul(vector(&self.diagonal.first, j));
            let mut sum = own.mul(vector(&self.v, j));
            for i in j + 1..n {
                sum = hat(below(n, i, j)).fma(vector(&self.v, i), sum);
            }
            set_vector(hat_v, j, sum);
        }
        for i in 0..n {
            let own = hat(i).mul(vector(&self.diagonal.first, i));
            let mut sum = own.mul(vector(&self.u, i));
            for j in 0..i {
                sum = hat(below(n, i, j)).fma(vector(&self.u, j), sum);
            }
            for j in 0..=i {
                let (g, rate): (V, V) = (
                    vector(&self.g.value, entry(i, j)),
                    vector(&self.g.rate, entry(i, j)),
                );
                let along_g = vector::<V>(rate_beta, j).add(vector(hat_v, j));
                sum = g.fma(along_g, rate.fma(vector(g_beta, j), sum));
            }
            if self.vector_potential {
                sum = sum.add(hat(n * (n + 1) / 2 + 1 + i));
            }
            set_vector(slopes, i, sum);
        }
    }
}

/// Row i of a lower triangular matrix.
#[inline(always)]
fn row<V: Vector>(triangle: &[V::Elem], i: usize) -> &[V::Elem] {
    &triangle[entry(i, 0) * V::LANES..][..(i + 1) * V::LANES]
}

/// Σ xₖ yₖ over the first `count`.
#[inline(always)]
fn product<V: Vector>(x: &[V::Elem], y: &[V::Elem], count: usize) -> V {
    let mut sum = V::of(0.0);
    for k in 0..count {
        sum = vector::<V>(x, k).fma(vector(y, k), sum);
    }
    sum
}

/// out = Mᵀ x for a lower triangular M.
#[inline(always)]
fn transposed_product<V: Vector>(n: usize, m: &[V::Elem], x: &[V::Elem], out: &mut [V::Elem]) {
    for j in 0..n {
        let mut sum = V::of(0.0);
        for i in j..n {
            sum = vector::<V>(m, entry(i, j)).fma(vector(x, i), sum);
        }
        set_vector(out, j, sum);
    }
}
