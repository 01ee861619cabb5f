//! A block of samples: its residuals, the slopes of these, and their gradient.

use super::dot;
use crate::train::{Learner, Loss, Value, Work, value};
use nets::simd::Buffer;
use nets::{Gradient, Packed, Terms};

/// Samples of a block.
pub(super) const BLOCK: usize = 16;

pub(super) struct Block {
    pub(super) work: Work<f64>,
    wide: Buffer<f64>,
    raw: Vec<f64>,
    pub(super) gradient: Gradient<f64>,
}

impl Block {
    pub(super) fn new(learner: &dyn Learner<f64>) -> Self {
        let work = Work::new(learner, BLOCK);
        Self {
            wide: Buffer::new(work.pass.widest()),
            raw: vec![0.0; BLOCK * learner.outputs_each()],
            gradient: Gradient::new(learner.net()),
            work,
        }
    }

    /// r, D, the factors of J, and Jᵀ r of the samples in `work`; the loss.
    pub(super) fn linearise(
        &mut self,
        learner: &dyn Learner<f64>,
        (packed, extra): (&Packed<f64>, &[f64]),
        (loss, terms): (Loss, &Terms),
    ) -> Value {
        let m = learner.residuals_each();
        learner.residuals(packed, extra, &mut self.work);
        let value = value(&self.work, loss, m);
        self.leave_padding_out(m);
        learner.linearise(packed, &mut self.work);
        self.pull_back(learner, terms);
        value
    }

    /// Appends D J v, one sample after the other.
    pub(super) fn push(
        &mut self,
        learner: &dyn Learner<f64>,
        (v, terms): (&Packed<f64>, &Terms),
        out: &mut Vec<f64>,
    ) {
        let m = learner.residuals_each();
        self.raw.fill(0.0);
        let Self {
            work, wide, raw, ..
        } = self;
        work.pass.push_forward(learner.net(), v, terms, wide, raw);
        let k = raw.len() / BLOCK;
        let rows = work.mix.chunks_exact(k).enumerate();
        out.extend(rows.map(|(row, d)| dot(d, &raw[row / m * k..][..k])));
    }

    fn leave_padding_out(&mut self, m: usize) {
        let work = &mut self.work;
        let k = work.mix.len() / work.residual.len();
        work.residual[work.count * m..].fill(0.0);
        work.mix[work.count * m * k..].fill(0.0);
    }

    /// Jᵀ r.
    fn pull_back(&mut self, learner: &dyn Learner<f64>, terms: &Terms) {
        let m = learner.residuals_each();
        let k = self.raw.len() / BLOCK;
        for (at, raw) in self.raw.iter_mut().enumerate() {
            let (s, column) = (at / k, at % k);
            let rows = s * m..s * m + m;
            *raw = rows
                .map(|row| self.work.mix[row * k + column] * self.work.residual[row])
                .sum();
        }
        self.gradient.clear();
        self.work.pass.pull_back_factors(
            learner.net(),
            terms,
            &self.raw,
            &mut self.wide,
            &mut self.gradient,
        );
    }
}
