//! Second derivatives of the output as a sum over the units of every layer (theory.md, equation 14).

use super::shape::load;
use super::{Arithmetic, Isa, Memory, Real, Shape, Task, Vector};

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
        // Few directions: all sums of a sample stay in registers, and every layer is read once.
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

    /// For each direction i, computes the sums with four others at a time in registers.
    #[inline(always)]
    fn four_by_four<I: Isa>(&mut self) {
        let (shape, n) = (self.shape, self.directions);
        for s in 0..shape.samples {
            for i in 0..n {
                for first in (0..i + 2).step_by(4) {
                    // The tangent ′ follows the directions up to i.
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
