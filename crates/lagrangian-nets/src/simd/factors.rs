//! Products with a factored Jacobian that are not matrix products.

use std::ops::Range;

use super::{Arithmetic, Isa, Memory, Real, Shape, Task, Vector};

/// Pairs (component of the sensitivities y, component of the input a) of each raw output of a sample.
type Pairs = [Vec<(usize, usize)>];

/// tile[(i, s), (j, s')] += Σ_(c, k) ∈ pairs i Σ_(c', k') ∈ pairs j  Y[c s, c' s'] A[k s, k' s'].
pub(crate) struct GramTile<'a, T> {
    /// Number of samples of a block, a multiple of LANES.
    pub samples: usize,
    /// Number of components times samples.
    pub rows: usize,
    pub pairs: &'a Pairs,
    /// Products of the components of both blocks: panels of columns of `rows` rows.
    pub y: &'a [T],
    pub a: &'a [T],
    pub tile: &'a mut [f64],
}

impl<T: Real> Task for GramTile<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (b, lanes) = (self.samples, T::LANES);
        let (size, groups) = (self.pairs.len() * b, b / lanes);
        let mut products = [(0, 0); MOST_PRODUCTS];
        for (i, left) in self.pairs.iter().enumerate() {
            for (j, right) in self.pairs.iter().enumerate() {
                let begin = |c: usize, other: usize| (other * groups * self.rows + c * b) * lanes;
                let all = left
                    .iter()
                    .flat_map(|&(c, k)| right.iter().map(move |&(c2, k2)| ((c, c2), (k, k2))));
                let mut count = 0;
                for (product, ((c, c2), (k, k2))) in products.iter_mut().zip(all) {
                    *product = (begin(c, c2), begin(k, k2));
                    count += 1;
                }
                assert_eq!(count, left.len() * right.len());
                for s in 0..b {
                    for g in 0..groups {
                        let at = (g * self.rows + s) * lanes;
                        let mut sum = T::Vec::<I>::of(0.0);
                        for &(y, a) in &products[..count] {
                            let y = T::Vec::<I>::load(&self.y[y + at..]);
                            sum = y.fma(T::Vec::<I>::load(&self.a[a + at..]), sum);
                        }
                        let mut sums = [T::default(); 16];
                        sum.store(&mut sums);
                        let out = &mut self.tile[(i * b + s) * size + j * b + g * lanes..];
                        for (out, x) in out[..lanes].iter_mut().zip(sums) {
                            *out += x.f64();
                        }
                    }
                }
            }
        }
    }
}

/// Maximum number of products of two raw outputs: four pairs of components each.
const MOST_PRODUCTS: usize = 16;

/// out[s, i] += Σ_(c, k) ∈ pairs i  `y_c`[s] · `a_k`[s], over the units of a layer.
pub(crate) struct RowDots<'a, T> {
    pub shape: Shape,
    pub pairs: &'a Pairs,
    pub y: &'a [T],
    pub a: &'a [T],
    pub out: &'a mut [f64],
}

impl<T: Real> Task for RowDots<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let n = self.pairs.len();
        for s in 0..self.shape.samples {
            for (i, pairs) in self.pairs.iter().enumerate() {
                let mut sum = T::Vec::<I>::of(0.0);
                for p in 0..self.shape.panels {
                    for &(c, k) in pairs {
                        let y = T::Vec::<I>::load(&self.y[self.shape.at::<T>(p, c, s)..]);
                        sum = y.fma(
                            T::Vec::<I>::load(&self.a[self.shape.at::<T>(p, k, s)..]),
                            sum,
                        );
                    }
                }
                self.out[s * n + i] += sum.sum().f64();
            }
        }
    }
}

/// `out_k`[s] = `Σ_i` x[s, i] Σ_(c, k) ∈ pairs i  `y_c`[s], for k among `components`.
pub(crate) struct WeighRows<'a, T> {
    pub shape: Shape,
    pub pairs: &'a Pairs,
    pub components: Range<usize>,
    pub x: &'a [f64],
    pub y: &'a [T],
    pub out: &'a mut [T],
}

impl<T: Real> Task for WeighRows<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let n = self.pairs.len();
        for p in 0..self.shape.panels {
            for s in 0..self.shape.samples {
                for k in self.components.clone() {
                    T::Vec::<I>::of(0.0).store(&mut self.out[self.shape.at::<T>(p, k, s)..]);
                }
                for (i, pairs) in self.pairs.iter().enumerate() {
                    let x = T::Vec::<I>::of(self.x[s * n + i]);
                    for &(c, k) in pairs {
                        let y = T::Vec::<I>::load(&self.y[self.shape.at::<T>(p, c, s)..]);
                        let out = &mut self.out[self.shape.at::<T>(p, k, s)..];
                        y.fma(x, T::Vec::<I>::load(out)).store(out);
                    }
                }
            }
        }
    }
}
