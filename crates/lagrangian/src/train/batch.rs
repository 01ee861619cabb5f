//! Samples, and how they are copied into a block.

use std::ops::{Deref, DerefMut};

use super::learner::Work;
use crate::trajectory::Signals;
use nets::simd::Real;

/// Samples to fit: states with the accelerations and forces that belong to them, row-major `[m, n]`.
///
/// Its [`Signals`] can be used as if they were its own fields: `samples.q` is `samples.signals.q`. Forces are 0 where
/// the motion is free; momenta and their rates are empty where they are not known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// The number n of degrees of freedom.
    pub n: usize,
    /// The signals q, q̇, q̈, τ, p and ṗ of all samples.
    pub signals: Signals,
    /// The time steps for losses of positions alone, s, `[m, 2]`, else empty: the steps h⁻ to the middle one of three neighbouring
    /// positions and h⁺ from it. Then q is the middle one, q̇ the velocity to it, q̈ the second divided difference, and
    /// τ the mean over both steps.
    pub steps: Vec<f64>,
}

impl Deref for Samples {
    type Target = Signals;

    fn deref(&self) -> &Signals {
        &self.signals
    }
}

impl DerefMut for Samples {
    fn deref_mut(&mut self) -> &mut Signals {
        &mut self.signals
    }
}

impl Samples {
    /// The samples with these signals of `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize, signals: Signals) -> Self {
        Self {
            n,
            signals,
            steps: Vec::new(),
        }
    }

    /// The signals of sample `s`.
    #[must_use]
    pub fn row(&self, s: usize) -> Signals<&[f64]> {
        self.signals.row(self.n, s)
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.q.len().checked_div(self.n).unwrap_or(0)
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// At most `count` of the samples, evenly spread: states, accelerations and forces.
    pub(crate) fn spread(&self, count: usize) -> Self {
        let every = self.len().div_ceil(count).max(1);
        let mut signals: Signals = Signals::default();
        for row in (0..self.len()).step_by(every).map(|s| self.row(s)) {
            signals.q.extend(row.q);
            signals.qd.extend(row.qd);
            signals.qdd.extend(row.qdd);
            signals.tau.extend(row.tau);
        }
        Self::new(self.n, signals)
    }

    /// Copies the samples with these indices into a block, whose rest repeats the first of them.
    pub(crate) fn gather<T: Real>(&self, indices: &[usize], work: &mut Work<T>) {
        let (n, samples) = (self.n, work.samples);
        work.count = indices.len();
        let index = |s: usize| indices[if s < indices.len() { s } else { 0 }];
        let Samples { signals, steps, .. } = &mut work.states;
        let signals = self.signals.iter().zip(signals.iter_mut());
        let columns = signals.map(|((_, from), (_, to))| (from, to, n));
        let all = columns.chain([(&self.steps, steps, 2)]);
        for (source, target, n) in all.filter(|(source, ..)| !source.is_empty()) {
            for (s, target) in (0..samples).zip(target.chunks_exact_mut(n)) {
                let row = &source[index(s) * n..][..n];
                // A loop, because a copy of two numbers is not worth a call.
                for (to, &from) in target.iter_mut().zip(row) {
                    *to = from;
                }
            }
        }
    }
}
