//! Activations forward: values, tangents and mixed second derivatives (theory.md, equation 10).

use std::ops::Range;

use super::shape::load;
use super::{Arithmetic, Isa, Memory, Real, Shape, Task};
use crate::Activation;

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
