//! A block of segments with the factors of every evaluation: its residuals along a step, and the gradient of any sum of
//! them.

use super::config::{RolloutLoss, SEGMENTS};
use super::segments::Rows;
use super::shoot::Block;
use crate::train::learner::Learner;
use nets::simd::Buffer;
use nets::{Factors, Gradient, Packed, Terms};

/// A block of segments with the memory of the natural gradient.
pub(super) struct Unit {
    pub(super) block: Block,
    pub(super) factors: Vec<Factors<f64>>,
    pub(super) gradient: Gradient<f64>,
    pub(super) wide: Buffer<f64>,
    /// B D, `[samples, rows, evaluations · k]`.
    pub(super) chained: Vec<f64>,
    /// J φ, then the solution, `[samples, rows]`.
    pub(super) right: Vec<f64>,
    /// J φ, then Dᵀ Bᵀ x, in S-space, `[evaluations, samples, k]`.
    pub(super) raw: Vec<f64>,
}

impl Unit {
    /// The memory for blocks of segments of `config`.
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss) -> Self {
        let net = learner.net();
        let block = Block::new(learner, config, true);
        let pass = &block.works[0].pass;
        Self {
            factors: (0..block.works.len())
                .map(|_| Factors::new(net, pass))
                .collect(),
            wide: Buffer::new(pass.widest()),
            gradient: Gradient::new(net),
            chained: Vec::new(),
            right: Vec::new(),
            raw: Vec::new(),
            block,
        }
    }

    /// B D of every residual and evaluation.
    pub(super) fn chain(&mut self, rows: &Rows) {
        let block = &self.block;
        let (rates, k, d) = (block.sizes.rates, block.sizes.outputs, block.sizes.state());
        let rows = rows.count();
        let total = block.sensitivities.direct.len() / (SEGMENTS * rows * d);
        self.chained.clear();
        self.chained.resize(SEGMENTS * rows * total * k, 0.0);
        for (at, direct) in block.sensitivities.direct.chunks_exact(d).enumerate() {
            let (s, e) = (at / (rows * total), at % total);
            let by_output = &block.points[e].by_output[s * rates * k..][..rates * k];
            let out = &mut self.chained[at * k..][..k];
            for (weight, row) in direct[d - rates..].iter().zip(by_output.chunks_exact(k)) {
                if *weight != 0.0 {
                    out.iter_mut().zip(row).for_each(|(o, m)| *o += weight * m);
                }
            }
        }
    }

    /// right = J φ.
    pub(super) fn push(
        &mut self,
        learner: &dyn Learner<f64>,
        phi: &Packed<f64>,
        terms: &Terms,
        phi_extra: &[f64],
    ) {
        let net = learner.net();
        let k = self.block.sizes.outputs;
        let rows = self.block.residual.len() / SEGMENTS;
        let total = self.chained.len() / (SEGMENTS * rows * k);
        self.raw.clear();
        self.raw.resize(total * SEGMENTS * k, 0.0);
        for (work, raw) in self
            .block
            .works
            .iter()
            .zip(self.raw.chunks_exact_mut(SEGMENTS * k))
        {
            work.pass.push_forward(net, phi, terms, &mut self.wide, raw);
            work.linear.push_forces(learner, phi_extra, raw);
        }
        self.right.clear();
        self.right.resize(self.block.residual.len(), 0.0);
        for (at, right) in self.right.iter_mut().enumerate() {
            let (s, chained) = (at / rows, &self.chained[at * total * k..][..total * k]);
            for (e, chained) in chained.chunks_exact(k).enumerate() {
                let raw = &self.raw[(e * SEGMENTS + s) * k..][..k];
                *right += lagrangian_motion::solve::dot(chained, raw);
            }
        }
    }

    /// Row `i` of B D of segment `s`, times the part of S-space J Jᵀ between it and another, to `out`
    /// `[evaluations · k]`.
    pub(super) fn row(
        &self,
        gram: &[f64],
        (used, left, right): (usize, usize, usize),
        (s, i): (usize, usize),
        out: &mut Vec<f64>,
    ) {
        let rows = self.block.residual.len() / SEGMENTS;
        let width = self.chained.len() / (SEGMENTS * rows);
        let size = used * width * SEGMENTS;
        out.clear();
        out.resize(width, 0.0);
        let (first, column) = (left / SEGMENTS, right / SEGMENTS);
        for (j, weight) in self.chained[(s * rows + i) * width..][..width]
            .iter()
            .enumerate()
        {
            if *weight == 0.0 {
                continue;
            }
            let row = (first * width + j) * SEGMENTS + s;
            let from = &gram[row * size + column * width * SEGMENTS..][..width * SEGMENTS];
            let from = from[right % SEGMENTS..].iter().step_by(SEGMENTS);
            out.iter_mut().zip(from).for_each(|(o, g)| *o += weight * g);
        }
    }

    /// The gradient of the weighted residuals; `right` holds their weights.
    pub(super) fn pull(&mut self, learner: &dyn Learner<f64>, terms: &Terms) {
        let k = self.block.sizes.outputs;
        let rows = self.block.residual.len() / SEGMENTS;
        let total = self.raw.len() / (SEGMENTS * k);
        self.raw.fill(0.0);
        for (at, weight) in self.right.iter().enumerate() {
            let (s, chained) = (at / rows, &self.chained[at * total * k..][..total * k]);
            for (e, chained) in chained.chunks_exact(k).enumerate() {
                let raw = &mut self.raw[(e * SEGMENTS + s) * k..][..k];
                raw.iter_mut()
                    .zip(chained)
                    .for_each(|(r, m)| *r += weight * m);
            }
        }
        self.gradient.clear();
        let net = learner.net();
        for (work, raw) in self
            .block
            .works
            .iter()
            .zip(self.raw.chunks_exact(SEGMENTS * k))
        {
            let pass = &work.pass;
            pass.pull_back_factors(net, terms, raw, &mut self.wide, &mut self.gradient);
        }
    }
}
