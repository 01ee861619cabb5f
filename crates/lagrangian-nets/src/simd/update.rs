//! Updates of whole arrays: sums of gradients, and the moments of Adam.

use super::{Arithmetic, Isa, Memory, Real, Task, Vector};

/// to += from.
pub(crate) struct AddTo<'a, T> {
    pub from: &'a [T],
    pub to: &'a mut [T],
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

/// sums += the rows of one panel.
pub(crate) struct SumRows<'a, T> {
    pub rows: &'a [T],
    pub sums: &'a mut [T],
}

impl<T: Real> Task for SumRows<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let start = T::Vec::<I>::load(self.sums);
        let rows = self.rows.chunks_exact(T::LANES);
        rows.fold(start, |sum, row| sum.add(T::Vec::<I>::load(row)))
            .store(self.sums);
    }
}

/// sum += Σ x² over an array of whole vectors; some hundred terms are added in the precision of the array.
pub(crate) struct SumOfSquares<'a, T> {
    pub of: &'a [T],
    pub sum: &'a mut f64,
}

impl<T: Real> Task for SumOfSquares<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for block in self.of.chunks(64 * T::LANES) {
            let mut sums = [T::Vec::<I>::of(0.0); 4];
            for (k, x) in block.chunks_exact(T::LANES).enumerate() {
                let x = T::Vec::<I>::load(x);
                sums[k % 4] = x.fma(x, sums[k % 4]);
            }
            let [a, b, c, d] = sums;
            *self.sum += a.add(b).add(c.add(d)).sum().f64();
        }
    }
}

/// Constants of a step of `AdamW`.
#[derive(Debug, Clone, Copy)]
pub struct AdamRule {
    /// Decay rates β₁ and β₂ of the moments.
    pub memory: [f64; 2],
    /// Corrections 1 / (1 − β₁ᵗ) and 1 / (1 − β₂ᵗ) of the moments at step t.
    pub corrections: [f64; 2],
    /// Constant ε that is added to the square root of the second moment.
    pub epsilon: f64,
    /// Learning rate.
    pub rate: f64,
    /// Weight decay of `AdamW`.
    pub decay: f64,
    /// Factor on the gradient, which bounds its norm.
    pub shorten: f64,
}

/// One step of `AdamW`, with moments in the precision of the gradient and weights in double precision.
pub struct AdamStep<'a, T> {
    /// Gradient by the weights.
    pub gradient: &'a [T],
    /// First moments, of the same length.
    pub first: &'a mut [T],
    /// Second moments, of the same length.
    pub second: &'a mut [T],
    /// Weights, of the same length.
    pub weights: &'a mut [f64],
    /// Output of the new weights in the precision of the gradient, of the same length.
    pub rounded: Option<&'a mut [T]>,
    /// Constants of the step.
    pub rule: AdamRule,
    /// Lower bound of all weights.
    pub lowest: f64,
}

impl<T: Real> Task for AdamStep<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let whole = self.gradient.len() / T::LANES * T::LANES;
        for at in (0..whole).step_by(T::LANES) {
            self.vector::<I>(at);
        }
        if whole < self.gradient.len() {
            self.tail::<I>(whole);
        }
    }
}

impl<T: Real> AdamStep<'_, T> {
    #[inline(always)]
    fn vector<I: Isa>(&mut self, at: usize) {
        let of = |x: f64| T::Vec::<I>::of(x);
        let rule = self.rule;
        let g = T::Vec::<I>::load(&self.gradient[at..]).mul(of(rule.shorten));
        let [b1, b2] = rule.memory;
        let m = T::Vec::<I>::load(&self.first[at..])
            .mul(of(b1))
            .add(g.mul(of(1.0 - b1)));
        let v = T::Vec::<I>::load(&self.second[at..])
            .mul(of(b2))
            .add(g.mul(g).mul(of(1.0 - b2)));
        let deviation = v.mul(of(rule.corrections[1])).sqrt().add(of(rule.epsilon));
        let step = m.mul(of(rule.corrections[0] * rule.rate)).div(deviation);
        m.store(&mut self.first[at..]);
        v.store(&mut self.second[at..]);
        let mut steps = [T::default(); 16];
        step.store(&mut steps);
        let kept = 1.0 - rule.rate * rule.decay;
        let weights = &mut self.weights[at..][..T::LANES];
        for (w, step) in weights.iter_mut().zip(steps) {
            let next = *w * kept - step.f64();
            *w = if next < self.lowest {
                self.lowest
            } else {
                next
            };
        }
        if let Some(rounded) = &mut self.rounded {
            for (to, w) in rounded[at..][..T::LANES].iter_mut().zip(weights) {
                *to = T::of(*w);
            }
        }
    }

    /// Processes the last few values through padded copies.
    #[inline(always)]
    fn tail<I: Isa>(&mut self, at: usize) {
        let end = self.gradient.len();
        let pad = |x: &[T]| {
            let mut padded = [T::default(); 16];
            padded[..end - at].copy_from_slice(&x[at..end]);
            padded
        };
        let (gradient, mut first, mut second) =
            (pad(self.gradient), pad(self.first), pad(self.second));
        let (mut weights, mut rounded) = ([0.0; 16], [T::default(); 16]);
        weights[..end - at].copy_from_slice(&self.weights[at..end]);
        let mut padded = AdamStep {
            gradient: &gradient,
            first: &mut first,
            second: &mut second,
            weights: &mut weights,
            rounded: Some(&mut rounded),
            rule: self.rule,
            lowest: self.lowest,
        };
        padded.vector::<I>(0);
        self.first[at..end].copy_from_slice(&first[..end - at]);
        self.second[at..end].copy_from_slice(&second[..end - at]);
        self.weights[at..end].copy_from_slice(&weights[..end - at]);
        if let Some(to) = &mut self.rounded {
            to[at..end].copy_from_slice(&rounded[..end - at]);
        }
    }
}
