//! Updates of whole arrays: sums of gradients, and the moments of Adam.

use super::{Isa, Real, Task, Vector};

/// to += from.
pub(crate) struct AddTo<'a, T> {
    pub(crate) from: &'a [T],
    pub(crate) to: &'a mut [T],
}

impl<T: Real> Task for AddTo<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut to = self.to.chunks_exact_mut(T::LANES);
        let from = self.from.chunks_exact(T::LANES);
        let rest = from.remainder();
        for (to, from) in (&mut to).zip(from) {
            T::Vec::<I>::load(to).add(T::Vec::<I>::load(from)).store(to);
        }
        for (to, &from) in to.into_remainder().iter_mut().zip(rest) {
            *to = *to + from;
        }
    }
}

/// One step of Adam(W); see `train/adam.rs` for the symbols.
pub(crate) struct AdamStep<'a> {
    pub(crate) gradient: &'a [f64],
    pub(crate) first: &'a mut [f64],
    pub(crate) second: &'a mut [f64],
    pub(crate) parameters: &'a mut [f64],
    /// Memories β₁ and β₂.
    pub(crate) memory: [f64; 2],
    /// 1 / (1 − β₁ᵗ) and 1 / (1 − β₂ᵗ).
    pub(crate) corrections: [f64; 2],
    pub(crate) epsilon: f64,
    pub(crate) rate: f64,
    pub(crate) decay: f64,
    /// Multiplies the gradient.
    pub(crate) shorten: f64,
}

impl Task for AdamStep<'_> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let whole = self.gradient.len() / 8 * 8;
        for at in (0..whole).step_by(8) {
            self.eight::<I::F64>(at);
        }
        let rest = self.gradient.len() - whole;
        if rest > 0 {
            self.tail::<I::F64>(whole, rest);
        }
    }
}

impl AdamStep<'_> {
    #[inline(always)]
    fn eight<V: Vector<Elem = f64>>(&mut self, at: usize) {
        let g = V::load(&self.gradient[at..]).mul(V::of(self.shorten));
        let [b1, b2] = self.memory;
        let m = V::load(&self.first[at..])
            .mul(V::of(b1))
            .add(g.mul(V::of(1.0 - b1)));
        let v = V::load(&self.second[at..])
            .mul(V::of(b2))
            .add(g.mul(g).mul(V::of(1.0 - b2)));
        let deviation = v
            .mul(V::of(self.corrections[1]))
            .sqrt()
            .add(V::of(self.epsilon));
        let theta = V::load(&self.parameters[at..]);
        let step = m
            .mul(V::of(self.corrections[0]))
            .div(deviation)
            .add(theta.mul(V::of(self.decay)));
        m.store(&mut self.first[at..]);
        v.store(&mut self.second[at..]);
        theta
            .sub(step.mul(V::of(self.rate)))
            .store(&mut self.parameters[at..]);
    }

    /// The last few, through a padded copy.
    #[inline(always)]
    fn tail<V: Vector<Elem = f64>>(&mut self, at: usize, rest: usize) {
        let pad = |x: &[f64]| {
            let mut padded = [0.0; 8];
            padded[..rest].copy_from_slice(&x[at..at + rest]);
            padded
        };
        let (gradient, mut first) = (pad(self.gradient), pad(self.first));
        let (mut second, mut parameters) = (pad(self.second), pad(self.parameters));
        let mut padded = AdamStep {
            gradient: &gradient,
            first: &mut first,
            second: &mut second,
            parameters: &mut parameters,
            ..*self
        };
        padded.eight::<V>(0);
        self.first[at..].copy_from_slice(&first[..rest]);
        self.second[at..].copy_from_slice(&second[..rest]);
        self.parameters[at..].copy_from_slice(&parameters[..rest]);
    }
}
