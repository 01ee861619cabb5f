//! What happens to single units between the matrix products: activations and gates, over the truncated algebra.
//!
//! Components of a block of B samples stand below each other in every panel: row `c · B + s`. Component 0 is the
//! value, 1 the tangent ′, then `directions` tangents i, then as many mixed second derivatives i′ (theory.md,
//! section 5).

use std::ops::Range;

use super::{Isa, Real, Task, Vector};
use crate::Activation;

/// Where the components of one layer lie.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    /// Samples of the block.
    pub samples: usize,
    /// Components that the buffers have room for.
    pub components: usize,
    /// Number of tangents i that the buffers have room for: i is component 2 + i, i′ is 2 + room + i.
    pub room: usize,
    /// Panels of the layer.
    pub panels: usize,
}

impl Shape {
    /// Rows of a panel.
    #[cfg(test)]
    pub fn rows(&self) -> usize {
        self.components * self.samples
    }

    #[inline(always)]
    pub(super) fn at<T: Real>(&self, panel: usize, component: usize, sample: usize) -> usize {
        ((panel * self.components + component) * self.samples + sample) * T::LANES
    }
    #[inline(always)]
    fn slope<T: Real>(&self, panel: usize, sample: usize) -> usize {
        (panel * self.samples + sample) * T::LANES
    }
    #[inline(always)]
    fn mixed(&self, i: usize) -> usize {
        2 + self.room + i
    }

    /// Panics unless a matrix holds all panels, and each of them components below `end`.
    #[inline(always)]
    fn check<T: Real>(&self, matrix: &[T], end: usize) {
        assert!(end <= self.components);
        assert!(self.panels * self.components * self.samples * T::LANES <= matrix.len());
    }

    /// The same for what has one component.
    #[inline(always)]
    fn check_slope<T: Real>(&self, slope: &[T]) {
        assert!(self.panels * self.samples * T::LANES <= slope.len());
    }
}

/// The vector `offset` numbers behind a pointer.
///
/// # Safety
/// There is a vector there.
#[inline(always)]
unsafe fn load<V: Vector>(from: *const V::Elem, offset: usize) -> V {
    // SAFETY: the caller's.
    unsafe { V::load_ptr(from.add(offset)) }
}

/// a₀ = σ(z₀), and the slopes σ′, σ″, σ‴ at z₀ (theory.md, equation 10).
pub(crate) struct PointForward<'a, T> {
    pub shape: Shape,
    pub activation: Activation,
    pub z: &'a [T],
    pub a: &'a mut [T],
    pub slopes: [&'a mut [T]; 3],
}

impl<T: Real> Task for PointForward<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        match self.activation {
            Activation::Softplus => self.apply::<I>(Activation::Softplus),
            Activation::Tanh => self.apply::<I>(Activation::Tanh),
            Activation::Gelu => self.apply::<I>(Activation::Gelu),
            Activation::XTanh => self.apply::<I>(Activation::XTanh),
            Activation::Square => self.apply::<I>(Activation::Square),
            Activation::Exp => self.apply::<I>(Activation::Exp),
        }
    }
}

impl<T: Real> PointForward<'_, T> {
    #[inline(always)]
    fn apply<I: Isa>(self, activation: Activation) {
        let shape = self.shape;
        shape.check(self.z, 1);
        shape.check(self.a, 1);
        self.slopes.iter().for_each(|s| shape.check_slope(s));
        let [s1, s2, s3] = self.slopes.map(|s| s.as_mut_ptr());
        for p in 0..shape.panels {
            let (first, slope) = (shape.at::<T>(p, 0, 0), shape.slope::<T>(p, 0));
            for s in (0..shape.samples).map(|s| s * T::LANES) {
                // SAFETY: checked above.
                unsafe {
                    let z = load::<T::Vec<I>>(self.z.as_ptr(), first + s);
                    let d = activation.derivatives(z);
                    d.value.store_ptr(self.a.as_mut_ptr().add(first + s));
                    d.first.store_ptr(s1.add(slope + s));
                    d.second.store_ptr(s2.add(slope + s));
                    d.third.store_ptr(s3.add(slope + s));
                }
            }
        }
    }
}

/// `out_c` = σ′ `in_c`: tangents forward, and the value component of the sensitivity backward.
pub(crate) struct PointTangent<'a, T> {
    pub shape: Shape,
    pub components: Range<usize>,
    pub first: &'a [T],
    pub input: &'a [T],
    pub output: &'a mut [T],
}

impl<T: Real> Task for PointTangent<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let shape = self.shape;
        shape.check(self.input, self.components.end);
        shape.check(self.output, self.components.end);
        shape.check_slope(self.first);
        for p in 0..shape.panels {
            let slope = shape.slope::<T>(p, 0);
            for c in self.components.clone() {
                let first = shape.at::<T>(p, c, 0);
                for s in (0..shape.samples).map(|s| s * T::LANES) {
                    // SAFETY: checked above.
                    unsafe {
                        load::<T::Vec<I>>(self.input.as_ptr(), first + s)
                            .mul(load(self.first.as_ptr(), slope + s))
                            .store_ptr(self.output.as_mut_ptr().add(first + s));
                    }
                }
            }
        }
    }
}

/// `a_i`′ = σ′ `z_i`′ + σ″ `z_i` z_′ (theory.md, equation 10).
pub(crate) struct PointSecond<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub slopes: [&'a [T]; 2],
    pub z: &'a [T],
    pub a: &'a mut [T],
}

impl<T: Real> Task for PointSecond<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let shape = self.shape;
        let end = shape.mixed(self.directions);
        shape.check(self.z, end);
        shape.check(self.a, end);
        self.slopes.iter().for_each(|s| shape.check_slope(s));
        let [s1, s2] = self.slopes.map(<[T]>::as_ptr);
        let (z, a) = (self.z.as_ptr(), self.a.as_mut_ptr());
        for p in 0..shape.panels {
            let slope = shape.slope::<T>(p, 0);
            let first = |c| shape.at::<T>(p, c, 0);
            let prime = first(1);
            for i in 0..self.directions {
                let (tangent, mixed) = (first(2 + i), first(shape.mixed(i)));
                for s in (0..shape.samples).map(|s| s * T::LANES) {
                    // SAFETY: checked above.
                    unsafe {
                        let zi: T::Vec<I> = load(z, tangent + s);
                        let curved = load::<T::Vec<I>>(s2, slope + s)
                            .mul(zi)
                            .mul(load(z, prime + s));
                        load::<T::Vec<I>>(z, mixed + s)
                            .fma(load(s1, slope + s), curved)
                            .store_ptr(a.add(mixed + s));
                    }
                }
            }
        }
    }
}

/// Components ′, i and i′ of the sensitivity backward through an activation:
/// the product of σ′(z) and ya in the truncated algebra (theory.md, equation 17).
pub(crate) struct PointReverse2<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub slopes: [&'a [T]; 3],
    pub z: &'a [T],
    pub ya: &'a [T],
    pub yz: &'a mut [T],
    /// Whether of ya only the value is not zero, and the rest was not written: below the output.
    pub value_only: bool,
}

impl<T: Real> Task for PointReverse2<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        if self.value_only {
            self.apply::<I, true>();
        } else {
            self.apply::<I, false>();
        }
    }
}

impl<T: Real> PointReverse2<'_, T> {
    #[inline(always)]
    fn apply<I: Isa, const VALUE_ONLY: bool>(self) {
        let shape = self.shape;
        let end = shape.mixed(self.directions);
        for matrix in [self.z, self.ya, &*self.yz] {
            shape.check(matrix, end);
        }
        self.slopes.iter().for_each(|s| shape.check_slope(s));
        let slopes = self.slopes.map(<[T]>::as_ptr);
        let (z, ya, yz) = (self.z.as_ptr(), self.ya.as_ptr(), self.yz.as_mut_ptr());
        let step = shape.samples * T::LANES;
        for p in 0..shape.panels {
            let (first, slope) = (shape.at::<T>(p, 0, 0), shape.slope::<T>(p, 0));
            for s in (0..shape.samples).map(|s| s * T::LANES) {
                let at = |c: usize| first + c * step + s;
                // SAFETY: checked above.
                unsafe {
                    let [s1, s2, s3] = slopes.map(|x| load::<T::Vec<I>>(x, slope + s));
                    let (z1, y0): (_, T::Vec<I>) = (load(z, at(1)), load(ya, at(0)));
                    let s2y0 = s2.mul(y0);
                    if VALUE_ONLY {
                        s2y0.mul(z1).store_ptr(yz.add(at(1)));
                        let with_zi = s3.mul(z1).mul(y0);
                        for i in 0..self.directions {
                            let mixed = at(shape.mixed(i));
                            let (zi, zm): (T::Vec<I>, T::Vec<I>) =
                                (load(z, at(2 + i)), load(z, mixed));
                            s2y0.mul(zi).store_ptr(yz.add(at(2 + i)));
                            with_zi.fma(zi, s2y0.mul(zm)).store_ptr(yz.add(mixed));
                        }
                        continue;
                    }
                    let y1: T::Vec<I> = load(ya, at(1));
                    y1.fma(s1, s2y0.mul(z1)).store_ptr(yz.add(at(1)));
                    // Everything of component i′ that z_i multiplies: σ″ ya_′ + σ‴ z_′ ya₀.
                    let with_zi = s2.fma(y1, s3.mul(z1).mul(y0));
                    let s2z1 = s2.mul(z1);
                    for i in 0..self.directions {
                        let mixed = at(shape.mixed(i));
                        let (zi, yi): (_, T::Vec<I>) = (load(z, at(2 + i)), load(ya, at(2 + i)));
                        yi.fma(s1, s2y0.mul(zi)).store_ptr(yz.add(at(2 + i)));
                        let (zm, ym): (_, T::Vec<I>) = (load(z, mixed), load(ya, mixed));
                        let sum = ym.fma(s1, s2z1.mul(yi)).add(with_zi.fma(zi, s2y0.mul(zm)));
                        sum.store_ptr(yz.add(mixed));
                    }
                }
            }
        }
    }
}

/// Sensitivities of scalars `S_i` that depend on a value, on its tangent ′ and on one further tangent i each, backward
/// through an activation: to ′ in component 1 + i, to the value in component 1 + directions + i, and to the tangent
/// i, one for all, in component 0 (theory.md, equation 32):
/// yz_′ = σ′ ya_′, yz = σ′ ya + σ″ (z_′ ya_′ + `z_i` ya₀).
pub(crate) struct PointReverseTangents<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub slopes: [&'a [T]; 2],
    pub z: &'a [T],
    pub ya: &'a [T],
    pub yz: &'a mut [T],
}

impl<T: Real> Task for PointReverseTangents<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let load = |x: &[T], at: usize| T::Vec::<I>::load(&x[at..]);
        let n = self.directions;
        for p in 0..self.shape.panels {
            for s in 0..self.shape.samples {
                let at = |c| self.shape.at::<T>(p, c, s);
                let slope = self.shape.slope::<T>(p, s);
                let (s1, s2) = (load(self.slopes[0], slope), load(self.slopes[1], slope));
                let s2y0 = s2.mul(load(self.ya, at(0)));
                let s2z1 = s2.mul(load(self.z, at(1)));
                for i in 0..n {
                    let prime = load(self.ya, at(1 + i));
                    prime.mul(s1).store(&mut self.yz[at(1 + i)..]);
                    let curved = s2z1.fma(prime, s2y0.mul(load(self.z, at(2 + i))));
                    let value = load(self.ya, at(1 + n + i));
                    value.fma(s1, curved).store(&mut self.yz[at(1 + n + i)..]);
                }
            }
        }
    }
}

/// Adds `Σ_units` σ″ ya₀ `z_t` `z_u` of one layer to the second derivatives of the output along the tangents:
/// `hessian[s, i, j]` for i ≥ j, and `hessian[s, i, directions]` for the pair of i with ′
/// (`[samples, directions, directions + 1]`; theory.md, equation 14).
pub(crate) struct Contract<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub second: &'a [T],
    pub z: &'a [T],
    pub ya: &'a [T],
    pub hessian: &'a mut [T],
}

impl<T: Real> Task for Contract<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        // Few directions: all sums of a sample in registers, every layer read once.
        match self.directions {
            1 => self.all_at_once::<I, 1>(),
            2 => self.all_at_once::<I, 2>(),
            3 => self.all_at_once::<I, 3>(),
            _ => self.four_by_four::<I>(),
        }
    }
}

impl<T: Real> Contract<'_, T> {
    #[inline(always)]
    fn load<I: Isa>(x: &[T], at: usize) -> T::Vec<I> {
        T::Vec::<I>::load(&x[at..])
    }

    #[inline(always)]
    fn add(&mut self, s: usize, i: usize, j: usize, sum: T) {
        let n = self.directions;
        let h = &mut self.hessian[(s * n + i) * (n + 1) + j];
        *h = *h + sum;
    }

    #[inline(always)]
    fn all_at_once<I: Isa, const N: usize>(&mut self) {
        let shape = self.shape;
        shape.check(self.z, 2 + N);
        shape.check(self.ya, 1);
        shape.check_slope(self.second);
        let (second, ya, from) = (self.second.as_ptr(), self.ya.as_ptr(), self.z.as_ptr());
        let step = shape.samples * T::LANES;
        for s in 0..shape.samples {
            let mut pairs = [[T::Vec::<I>::of(0.0); N]; N];
            let mut primes = [T::Vec::<I>::of(0.0); N];
            for p in 0..shape.panels {
                let first = shape.at::<T>(p, 0, s);
                // SAFETY: checked above, here and below.
                let (weight, prime) = unsafe {
                    let second: T::Vec<I> = load(second, shape.slope::<T>(p, s));
                    (
                        second.mul(load(ya, first)),
                        load::<T::Vec<I>>(from, first + step),
                    )
                };
                let mut z = [T::Vec::<I>::of(0.0); N];
                for i in 0..N {
                    // SAFETY: as above.
                    z[i] = unsafe { load(from, first + (2 + i) * step) };
                    let weighed = weight.mul(z[i]);
                    primes[i] = weighed.fma(prime, primes[i]);
                    for j in 0..=i {
                        pairs[i][j] = weighed.fma(z[j], pairs[i][j]);
                    }
                }
            }
            for i in 0..N {
                self.add(s, i, N, primes[i].sum());
                for (j, pair) in pairs[i].iter().enumerate().take(i + 1) {
                    self.add(s, i, j, pair.sum());
                }
            }
        }
    }

    /// For each direction i, the sums with four others at a time in registers.
    #[inline(always)]
    fn four_by_four<I: Isa>(&mut self) {
        let (shape, n) = (self.shape, self.directions);
        for s in 0..shape.samples {
            for i in 0..n {
                for first in (0..i + 2).step_by(4) {
                    // Behind the directions up to i comes ′.
                    let other = |k: usize| match first + k {
                        j if j <= i => j,
                        _ => n,
                    };
                    let component = |k: usize| match other(k) {
                        j if j == n => 1,
                        j => 2 + j,
                    };
                    let components: [usize; 4] = std::array::from_fn(component);
                    let mut sums = [T::Vec::<I>::of(0.0); 4];
                    for p in 0..shape.panels {
                        let at = |c| shape.at::<T>(p, c, s);
                        let second = Self::load::<I>(self.second, shape.slope::<T>(p, s));
                        let weight = second.mul(Self::load::<I>(self.ya, at(0)));
                        let zi = weight.mul(Self::load::<I>(self.z, at(2 + i)));
                        for (sum, &c) in sums.iter_mut().zip(&components) {
                            *sum = zi.fma(Self::load::<I>(self.z, at(c)), *sum);
                        }
                    }
                    for (k, sum) in sums.iter().enumerate().take(i + 2 - first) {
                        self.add(s, i, other(k), sum.sum());
                    }
                }
            }
        }
    }
}

/// The two sides of a gate z = `Σ_j` `g_j` `v_j` + `g_n`: the gates g (from q) and the velocities v.
pub(crate) struct Gates<'a, T> {
    /// Of the gated layer.
    pub shape: Shape,
    /// Degrees of freedom.
    pub n: usize,
    /// Gates in panels: block j of `shape.panels` panels multiplies `v_j`, the last block is added.
    pub g: &'a [T],
    /// Velocities, `[components, samples, n]`.
    pub v: &'a [T],
}

impl<T: Real> Gates<'_, T> {
    #[inline(always)]
    fn gate<V: Vector<Elem = T>>(&self, j: usize, p: usize, c: usize, s: usize) -> V {
        V::load(&self.g[self.shape.at::<T>(j * self.shape.panels + p, c, s)..])
    }
    #[inline(always)]
    fn velocity<V: Vector<Elem = T>>(&self, j: usize, c: usize, s: usize) -> V {
        V::splat(self.v[(c * self.shape.samples + s) * self.n + j])
    }
    /// The pairs (component of one factor, component of the other) whose products make component c of a product.
    #[inline(always)]
    fn pairs(&self, c: usize) -> ([(usize, usize); 4], usize) {
        let mixed = self.shape.mixed(0);
        match c {
            0 => ([(0, 0); 4], 1),
            c if c < mixed => ([(c, 0), (0, c), (0, 0), (0, 0)], 2),
            c => {
                let i = 2 + c - mixed;
                ([(c, 0), (i, 1), (1, i), (0, c)], 4)
            }
        }
    }
}

/// Components of z = `Σ_j` `g_j` `v_j` + `g_n`.
pub(crate) struct GateForward<'a, T> {
    pub gates: Gates<'a, T>,
    pub components: Range<usize>,
    pub z: &'a mut [T],
}

impl<T: Real> Task for GateForward<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (g, n) = (&self.gates, self.gates.n);
        for p in 0..g.shape.panels {
            for c in self.components.clone() {
                let (pairs, count) = g.pairs(c);
                for s in 0..g.shape.samples {
                    let mut sum = g.gate::<T::Vec<I>>(n, p, c, s);
                    for j in 0..n {
                        for &(cg, cv) in &pairs[..count] {
                            sum = g
                                .gate::<T::Vec<I>>(j, p, cg, s)
                                .fma(g.velocity(j, cv, s), sum);
                        }
                    }
                    sum.store(&mut self.z[g.shape.at::<T>(p, c, s)..]);
                }
            }
        }
    }
}

/// The sensitivity to the gates, from the sensitivity yz to z.
pub(crate) struct GateReverse<'a, T> {
    pub gates: Gates<'a, T>,
    pub components: Range<usize>,
    pub yz: &'a [T],
    /// Same panels as the gates; written.
    pub yg: &'a mut [T],
    /// Where component 0 is wanted: the sensitivity to the velocities, `[samples, n]`, added to.
    pub yv: Option<&'a mut [T]>,
    /// As in [`Contract`], with the number of directions; added to.
    pub hessian: Option<(&'a mut [T], usize)>,
}

impl<T: Real> Task for GateReverse<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let (g, n) = (&self.gates, self.gates.n);
        for p in 0..g.shape.panels {
            for c in self.components.clone() {
                let (pairs, count) = g.pairs(c);
                for s in 0..g.shape.samples {
                    let y = |c| T::Vec::<I>::load(&self.yz[g.shape.at::<T>(p, c, s)..]);
                    for j in 0..n {
                        let mut sum = T::Vec::<I>::of(0.0);
                        for &(cy, cv) in &pairs[..count] {
                            sum = y(cy).fma(g.velocity(j, cv, s), sum);
                        }
                        sum.store(&mut self.yg[g.shape.at::<T>(j * g.shape.panels + p, c, s)..]);
                    }
                    y(c).store(&mut self.yg[g.shape.at::<T>(n * g.shape.panels + p, c, s)..]);
                }
            }
        }
        if let Some(yv) = &mut self.yv {
            velocity_sensitivity::<I, T>(g, self.yz, yv);
        }
        if let Some((hessian, directions)) = &mut self.hessian {
            gate_curvature::<I, T>(g, self.yz, *directions, hessian);
        }
    }
}

/// `yv_j` += `Σ_units` yz₀ `g_j`.
#[inline(always)]
fn velocity_sensitivity<I: Isa, T: Real>(g: &Gates<'_, T>, yz: &[T], yv: &mut [T]) {
    for s in 0..g.shape.samples {
        for j in 0..g.n {
            let mut sum = T::Vec::<I>::of(0.0);
            for p in 0..g.shape.panels {
                let y = T::Vec::<I>::load(&yz[g.shape.at::<T>(p, 0, s)..]);
                sum = y.fma(g.gate(j, p, 0, s), sum);
            }
            let y = &mut yv[s * g.n + j];
            *y = *y + sum.sum();
        }
    }
}

/// hessian[t, u] += `Σ_units` yz₀ `Σ_j` (`g_j,t` `v_j,u` + `g_j,u` `v_j,t`).
#[inline(always)]
fn gate_curvature<I: Isa, T: Real>(g: &Gates<'_, T>, yz: &[T], n: usize, hessian: &mut [T]) {
    for s in 0..g.shape.samples {
        for i in 0..n {
            for k in (0..=i).chain([n]) {
                let (t, u) = (2 + i, if k == n { 1 } else { 2 + k });
                let mut sum = T::Vec::<I>::of(0.0);
                for p in 0..g.shape.panels {
                    let y = T::Vec::<I>::load(&yz[g.shape.at::<T>(p, 0, s)..]);
                    for j in 0..g.n {
                        let cross = g.gate::<T::Vec<I>>(j, p, t, s).mul(g.velocity(j, u, s));
                        sum = y.fma(
                            g.gate::<T::Vec<I>>(j, p, u, s)
                                .fma(g.velocity(j, t, s), cross),
                            sum,
                        );
                    }
                }
                let h = &mut hessian[(s * n + i) * (n + 1) + k];
                *h = *h + sum.sum();
            }
        }
    }
}

/// Linear combinations of tangents: ′ += Σ `along[s, i]` i, and direction 0 = Σ `onto[s, i]` i.
pub(crate) struct Combine<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub along: &'a [T],
    pub onto: Option<&'a [T]>,
    pub buffer: &'a mut [T],
}

impl<T: Real> Task for Combine<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        match self.directions {
            1 => self.few::<I, 1>(),
            2 => self.few::<I, 2>(),
            3 => self.few::<I, 3>(),
            _ => self.many::<I>(),
        }
    }
}

impl<T: Real> Combine<'_, T> {
    /// With all weights of a sample and all its tangents of a panel in registers.
    #[inline(always)]
    fn few<I: Isa, const N: usize>(self) {
        let zero = T::Vec::<I>::of(0.0);
        self.shape.check(self.buffer, 2 + N);
        let step = self.shape.samples * T::LANES;
        for s in 0..self.shape.samples {
            let (mut along, mut onto) = ([zero; N], [zero; N]);
            for i in 0..N {
                along[i] = T::Vec::<I>::splat(self.along[s * N + i]);
                if let Some(weights) = self.onto {
                    onto[i] = T::Vec::<I>::splat(weights[s * N + i]);
                }
            }
            for p in 0..self.shape.panels {
                let first = self.shape.at::<T>(p, 1, s);
                // SAFETY: checked above.
                unsafe {
                    let buffer = self.buffer.as_mut_ptr().add(first);
                    let mut prime = T::Vec::<I>::load_ptr(buffer);
                    let mut direction = zero;
                    for i in 0..N {
                        let tangent = load::<T::Vec<I>>(buffer, (1 + i) * step);
                        prime = tangent.fma(along[i], prime);
                        direction = tangent.fma(onto[i], direction);
                    }
                    prime.store_ptr(buffer);
                    if self.onto.is_some() {
                        direction.store_ptr(buffer.add(step));
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn many<I: Isa>(self) {
        let n = self.directions;
        for p in 0..self.shape.panels {
            for s in 0..self.shape.samples {
                let at = |c| self.shape.at::<T>(p, c, s);
                let sum = |weights: &[T], start: T::Vec<I>, buffer: &[T]| {
                    (0..n).fold(start, |sum, i| {
                        let w = T::Vec::<I>::splat(weights[s * n + i]);
                        T::Vec::<I>::load(&buffer[at(2 + i)..]).fma(w, sum)
                    })
                };
                let prime = sum(
                    self.along,
                    T::Vec::<I>::load(&self.buffer[at(1)..]),
                    self.buffer,
                );
                if let Some(onto) = self.onto {
                    sum(onto, T::Vec::<I>::of(0.0), self.buffer).store(&mut self.buffer[at(2)..]);
                }
                prime.store(&mut self.buffer[at(1)..]);
            }
        }
    }
}
