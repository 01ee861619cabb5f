//! A block of samples: its residuals, the factors of its rows of J, and products with them.

use super::lanes::value;
use crate::train::learner::{Learner, Work};
use crate::train::loss::Loss;
use crate::train::problem::LossValue;
use nets::simd::Buffer;
use nets::{Factors, Gradient, Packed, Terms};

/// The number of samples of a block.
pub(super) const BLOCK: usize = 16;

/// Residuals below this part of the mean |r| have the weight of one of that size.
const SMALL: f64 = 0.1;

/// A direction in the space of the parameters.
pub(super) struct Direction<'a> {
    /// The part of the network, in panels.
    pub(super) packed: &'a Packed<f64>,
    /// The part of the parameters beside it.
    pub(super) extra: &'a [f64],
}

/// A block of samples.
pub(super) struct Block {
    pub(super) work: Work<f64>,
    pub(super) factors: Factors<f64>,
    /// The factors in single precision.
    pub(super) rounded: Factors<f32>,
    pub(super) gradient: Gradient<f64>,
    pub(super) value: LossValue,
    /// J φ, then the solution x, `[samples, m]`.
    pub(super) right: Vec<f64>,
    /// J φ, then Dᵀ x, in S-space, `[samples, k]`.
    pub(super) raw: Vec<f64>,
    moved: Vec<f64>,
    wide: Buffer<f64>,
}

impl Block {
    pub(super) fn new(learner: &dyn Learner<f64>) -> Self {
        let net = learner.net();
        let work = Work::new(learner, BLOCK);
        Self {
            factors: Factors::new(net, &work.pass),
            rounded: Factors::new(net, &work.pass),
            wide: Buffer::new(work.pass.widest()),
            work,
            gradient: Gradient::new(net),
            right: vec![0.0; BLOCK * learner.residuals_each()],
            raw: vec![0.0; BLOCK * learner.outputs_each()],
            moved: Vec::new(),
            value: LossValue::default(),
        }
    }

    /// Weights residuals so that their squares are minimised; those of the padding of the block become 0.
    pub(super) fn weigh(&mut self, loss: Loss, level: f64, m: usize) {
        let work = &mut self.work;
        self.value = value(work, loss, m);
        let k = work.linear.d.len() / work.linear.residual.len();
        for at in 0..work.linear.residual.len() {
            let r = work.linear.residual[at];
            let weight = match loss {
                _ if at >= work.count * m => 0.0,
                // |r| = r² / |r|: squares, reweighted at every step, in units of the mean |r| of the batch.
                _ if loss.is_absolute() => (level / r.abs().max(SMALL * level)).sqrt(),
                _ => 1.0,
            };
            work.linear.residual[at] = r * weight;
            work.linear.d[at * k..at * k + k]
                .iter_mut()
                .for_each(|d| *d *= weight);
        }
    }

    /// The factors of J, from the weighed residuals.
    pub(super) fn linearise(
        &mut self,
        learner: &dyn Learner<f64>,
        packed: &Packed<f64>,
        terms: &Terms,
    ) {
        learner.linearise(packed, &mut self.work);
        self.factors.set(learner.net(), &self.work.pass, terms);
    }

    /// right = J φ, of φ in panels and of the parameters beside the network.
    pub(super) fn push(&mut self, learner: &dyn Learner<f64>, phi: &Direction<'_>, terms: &Terms) {
        self.raw.fill(0.0);
        let Self {
            work, wide, raw, ..
        } = self;
        work.pass
            .push_forward(learner.net(), phi.packed, terms, wide, raw);
        self.by_sample(learner.points());
        let linear = &self.work.linear;
        linear.push_forces(learner, phi.extra, &mut self.raw);
        let (m, k) = (self.right.len() / BLOCK, self.raw.len() / BLOCK);
        for (at, right) in self.right.iter_mut().enumerate() {
            let along = &self.raw[at / m * k..][..k];
            let row = &self.work.linear.d[at * k..][..k];
            *right = row.iter().zip(along).map(|(d, x)| d * x).sum::<f64>();
        }
    }

    /// gradient = Jᵀ x of the network's parameters; leaves Dᵀ x in `raw`, in the order of the pass.
    pub(super) fn pull_back(&mut self, learner: &dyn Learner<f64>, terms: &Terms) {
        self.apply_d_transposed();
        self.by_point(learner.points());
        self.gradient.clear();
        let Self {
            work,
            raw,
            wide,
            gradient,
            ..
        } = self;
        work.pass
            .pull_back_factors(learner.net(), terms, raw, wide, gradient);
    }

    /// raw = Dᵀ right.
    fn apply_d_transposed(&mut self) {
        let (m, k) = (self.right.len() / BLOCK, self.raw.len() / BLOCK);
        for (at, raw) in self.raw.iter_mut().enumerate() {
            let (s, column) = (at / k, at % k);
            *raw = (0..m)
                .map(|i| self.work.linear.d[(s * m + i) * k + column] * self.right[s * m + i])
                .sum();
        }
    }

    /// Adds Jᵀ x of the parameters beside the network, after [`Block::pull_back`].
    pub(super) fn pull_extra_back(&mut self, learner: &dyn Learner<f64>, phi_extra: &mut [f64]) {
        self.by_sample(learner.points());
        let linear = &self.work.linear;
        linear.pull_forces(learner, &self.raw, phi_extra);
    }

    /// Brings `raw` from the order of the pass, `[point, sample, n]`, to that of the samples, `[sample, n, point]`.
    fn by_sample(&mut self, points: usize) {
        self.reorder(points, |by_point, by_sample| (by_sample, by_point));
    }

    /// Returns `raw` to the order of the pass.
    fn by_point(&mut self, points: usize) {
        self.reorder(points, |by_point, by_sample| (by_point, by_sample));
    }

    /// Moves every entry of `raw` from the second to the first of the positions that `way` returns.
    fn reorder(&mut self, points: usize, way: impl Fn(usize, usize) -> (usize, usize)) {
        if points == 1 {
            return;
        }
        let n = self.raw.len() / BLOCK / points;
        self.moved.clone_from(&self.raw);
        for (s, i, j) in
            (0..BLOCK).flat_map(|s| (0..n).flat_map(move |i| (0..points).map(move |j| (s, i, j))))
        {
            let (to, from) = way((j * BLOCK + s) * n + i, (s * n + i) * points + j);
            self.raw[to] = self.moved[from];
        }
    }
}

/// Mean |r| of the batch, never zero.
pub(super) fn level(blocks: &[Block], m: usize) -> f64 {
    let residuals = || {
        blocks
            .iter()
            .flat_map(|b| &b.work.linear.residual[..b.work.count * m])
    };
    let counted = blocks.iter().map(|b| b.work.count * b.work.counted);
    let mean = residuals().map(|r| r.abs()).sum::<f64>() / counted.sum::<usize>().max(1) as f64;
    if mean.is_finite() {
        mean.max(1e-12)
    } else {
        1.0
    }
}
