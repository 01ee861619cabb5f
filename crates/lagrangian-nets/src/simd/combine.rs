//! Tangents as linear combinations of others, sample by sample.

use super::shape::load;
use super::{Arithmetic, Isa, Memory, Real, Shape, Task};

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
    /// Keeps all weights of a sample and all its tangents of a panel in registers.
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
