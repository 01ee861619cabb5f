//! Lane-wise parts of the products with a factored Jacobian.

use super::elementwise::Shape;
use super::{Isa, Real, Task, Vector};

type Terms = [Vec<(usize, usize)>];

/// tile[(i, s), (j, s')] += Σ_(c, k) ∈ terms i Σ_(c', k') ∈ terms j  Y[c s, c' s'] (A[k s, k' s'] + one if k = k' = 0).
pub(crate) struct GramTile<'a, T> {
    pub(crate) shape: Shape,
    pub(crate) terms: &'a Terms,
    /// 1 where the layer has a bias, whose input is 1.
    pub(crate) one: T,
    /// Products of the components of both blocks: panels of columns, `[components · samples]` rows.
    pub(crate) y: &'a [T],
    pub(crate) a: &'a [T],
    pub(crate) tile: &'a mut [T],
}

impl<T: Real> Task for GramTile<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (b, rows) = (
            self.shape.samples,
            self.shape.samples * self.shape.components,
        );
        let size = self.terms.len() * b;
        let groups = b / T::LANES;
        let at = |c: usize, s: usize, other: usize, g: usize| {
            ((other * groups + g) * rows + c * b + s) * T::LANES
        };
        let load = |x: &[T], at: usize| T::Vec::<I>::load(&x[at..]);
        let one = T::Vec::<I>::splat(self.one);
        for (i, left) in self.terms.iter().enumerate() {
            for (j, right) in self.terms.iter().enumerate() {
                for s in 0..b {
                    for g in 0..groups {
                        let out = &mut self.tile[(i * b + s) * size + j * b + g * T::LANES..];
                        let mut sum = T::Vec::<I>::load(out);
                        for &(c, k) in left {
                            for &(c2, k2) in right {
                                let mut a = load(self.a, at(k, s, k2, g));
                                if k == 0 && k2 == 0 {
                                    a = a.add(one);
                                }
                                sum = load(self.y, at(c, s, c2, g)).fma(a, sum);
                            }
                        }
                        sum.store(out);
                    }
                }
            }
        }
    }
}

/// out[s, i] += Σ_(c, k) ∈ terms i  `y_c`[s] · `a_k`[s], over the units of a layer.
pub(crate) struct RowDots<'a, T> {
    pub(crate) shape: Shape,
    pub(crate) terms: &'a Terms,
    pub(crate) y: &'a [T],
    pub(crate) a: &'a [T],
    pub(crate) out: &'a mut [f64],
}

impl<T: Real> Task for RowDots<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let n = self.terms.len();
        for s in 0..self.shape.samples {
            for (i, pairs) in self.terms.iter().enumerate() {
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

/// `out_k`[s] = `Σ_i` x[s, i] Σ_(c, k) ∈ terms i  `y_c`[s], for the first `components` k.
pub(crate) struct WeighRows<'a, T> {
    pub(crate) shape: Shape,
    pub(crate) terms: &'a Terms,
    pub(crate) components: usize,
    pub(crate) x: &'a [f64],
    pub(crate) y: &'a [T],
    pub(crate) out: &'a mut [T],
}

impl<T: Real> Task for WeighRows<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let n = self.terms.len();
        for p in 0..self.shape.panels {
            for s in 0..self.shape.samples {
                for k in 0..self.components {
                    T::Vec::<I>::of(0.0).store(&mut self.out[self.shape.at::<T>(p, k, s)..]);
                }
                for (i, pairs) in self.terms.iter().enumerate() {
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
