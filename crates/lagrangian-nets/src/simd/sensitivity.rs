//! Sensitivities backward through an activation (theory.md, equations 17 and 32).

use super::shape::load;
use super::{Arithmetic, Isa, Memory, Real, Shape, Task};

/// Components ′, i and i′ of the sensitivity backward through an activation:
/// the product of σ′(z) and ya in the truncated algebra (theory.md, equation 17).
pub(crate) struct PointReverse2<'a, T> {
    pub shape: Shape,
    pub directions: usize,
    pub slopes: [&'a [T]; 3],
    pub z: &'a [T],
    pub ya: &'a [T],
    pub yz: &'a mut [T],
    /// Whether only the value of ya is nonzero, as below the output; the rest was not written.
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
                    // All factors of z_i in component i′: σ″ ya_′ + σ‴ z_′ ya₀.
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
