//! Losses of samples as problems: the residuals of a network sample by sample, their Jacobian by its factors, and their
//! gradient (theory.md, section 7).

mod block;
mod descent;
mod lanes;
mod products;
mod rows;
mod tiles;

pub(crate) use descent::NetworkDescent;
pub(crate) use lanes::Batches;

use std::ops::Add;

use lagrangian_motion::parallel::prelude::*;

use block::{BLOCK, Block, Direction, level};
use nets::{Packed, Terms};
use rows::Rows;
use tiles::Tiles;

use super::System;
use super::engine::Problems;
use super::learner::Learner;
use super::loss::Loss;
use super::problem::{Batch, LeastSquares, LossValue, ResidualSize, StepAt};

/// The memory in which the residuals of a batch are evaluated.
pub(crate) struct NetworkMemory {
    blocks: Vec<Block>,
    tiles: Tiles,
    weights: Packed<f64>,
    direction: Packed<f64>,
}

impl NetworkMemory {
    /// Memory for batches of at most `batch` samples.
    pub(crate) fn new(learner: &dyn Learner<f64>, batch: usize) -> Self {
        let net = learner.net();
        let count = batch.div_ceil(BLOCK);
        let blocks: Vec<Block> = (0..count).map(|_| Block::new(learner)).collect();
        Self {
            tiles: Tiles::new(learner, &blocks),
            blocks,
            weights: Packed::new(net),
            direction: Packed::new(net),
        }
    }

    /// The problem that `learner` poses on a batch.
    pub(crate) fn problem<'p>(
        &'p mut self,
        learner: &'p dyn Learner<f64>,
        loss: Loss,
        batch: Batch<'p>,
    ) -> NetworkProblem<'p> {
        NetworkProblem {
            used: batch.indices.len().div_ceil(BLOCK),
            terms: learner.terms(),
            rows: Rows::default(),
            memory: self,
            learner,
            loss,
            batch,
        }
    }
}

/// The problems of a fit of samples, a batch each.
pub(crate) struct NetworkProblems<'a> {
    memory: NetworkMemory,
    learner: &'a dyn Learner<f64>,
    loss: Loss,
}

impl<'a> NetworkProblems<'a> {
    /// Problems for batches of at most `batch` samples.
    pub(crate) fn new(learner: &'a dyn Learner<f64>, loss: Loss, batch: usize) -> Self {
        Self {
            memory: NetworkMemory::new(learner, batch),
            learner,
            loss,
        }
    }
}

impl Problems for NetworkProblems<'_> {
    fn parameters(&self) -> usize {
        self.learner.parameters()
    }

    fn at<'p>(&'p mut self, at: &StepAt<'p>) -> Box<dyn LeastSquares + 'p> {
        Box::new(self.memory.problem(self.learner, self.loss, at.batch))
    }

    fn unit(&self, loss: LossValue) -> f64 {
        // Absolute values are squares over the mean |r| of the batch, see `Block::weigh`.
        match self.loss.is_absolute() {
            true => loss.mean(),
            false => 1.0,
        }
    }
}

/// The residuals of a network on a batch of samples.
pub(crate) struct NetworkProblem<'p> {
    memory: &'p mut NetworkMemory,
    learner: &'p dyn Learner<f64>,
    loss: Loss,
    batch: Batch<'p>,
    /// The number of blocks of this batch.
    used: usize,
    terms: Terms,
    rows: Rows,
}

impl LeastSquares for NetworkProblem<'_> {
    fn residuals(&mut self, theta: &[f64]) -> ResidualSize {
        let (learner, Batch { samples, indices }) = (self.learner, self.batch);
        let net = learner.net();
        let (weights, extra) = theta[..learner.parameters()].split_at(net.parameters);
        self.memory.weights.set(net, weights);
        let packed = &self.memory.weights;
        let blocks = self.memory.blocks[..self.used].par_iter_mut();
        blocks
            .zip(indices.par_chunks(BLOCK))
            .for_each(|(block, indices)| {
                block.work.gather(samples, indices);
                learner.residuals(packed, extra, &mut block.work);
            });
        self.weigh()
    }

    fn linearise(&mut self, phi: &[f64]) {
        let (learner, terms, memory) = (self.learner, &self.terms, &mut *self.memory);
        let (weights, extra) = phi.split_at(learner.net().parameters);
        memory.direction.set(learner.net(), weights);
        let packed = &memory.direction;
        let direction = Direction { packed, extra };
        memory.blocks[..self.used].par_iter_mut().for_each(|block| {
            block.linearise(learner, &memory.weights, terms);
            block.push(learner, &direction, terms);
        });
    }

    fn products(&mut self, damping: f64, system: &mut System) -> usize {
        let blocks = &mut self.memory.blocks[..self.used];
        let tiles = &mut self.memory.tiles;
        tiles.fill(self.learner, blocks, &self.terms, damping);
        let rows = Rows::of(tiles, self.used, self.learner.residuals_each());
        system.resize(rows.count());
        tiles
            .of(self.used)
            .for_each(|tile| rows.write(tile, system));
        for (b, block) in blocks.iter().enumerate() {
            for (k, (r, pushed)) in block
                .work
                .linear
                .residual
                .iter()
                .zip(&block.right)
                .enumerate()
            {
                if let Some(row) = rows.of_residual(b, k) {
                    (system.residual[row], system.pushed[row]) = (*r, *pushed);
                }
            }
        }
        self.rows = rows;
        self.rows.all()
    }

    fn pull_back(&mut self, x: &[f64], phi: &mut [f64]) {
        let (learner, terms, rows) = (self.learner, &self.terms, &self.rows);
        let blocks = &mut self.memory.blocks[..self.used];
        blocks.par_iter_mut().enumerate().for_each(|(b, block)| {
            for (k, right) in block.right.iter_mut().enumerate() {
                *right = rows.of_residual(b, k).map_or(0.0, |row| x[row]);
            }
            block.pull_back(learner, terms);
        });
        if let Some((first, rest)) = blocks.split_first_mut() {
            rest.iter()
                .for_each(|block| first.gradient.add(&block.gradient));
            first.gradient.add_to(learner.net(), phi);
        }
        let extra = &mut phi[learner.net().parameters..];
        blocks
            .iter_mut()
            .for_each(|block| block.pull_extra_back(learner, extra));
    }

    fn settle(&mut self, theta: &mut [f64], _rate: f64) {
        let parameters = self.learner.parameters();
        self.learner.project(&mut theta[..parameters]);
    }
}

impl NetworkProblem<'_> {
    /// Weights residuals so that their squares are minimised.
    fn weigh(&mut self) -> ResidualSize {
        let (m, loss) = (self.learner.residuals_each(), self.loss);
        let blocks = &mut self.memory.blocks[..self.used];
        let level = level(blocks, m);
        blocks
            .iter_mut()
            .for_each(|block| block.weigh(loss, level, m));
        let values = blocks.iter().map(|block| block.value);
        let value = values.fold(LossValue::default(), LossValue::add);
        ResidualSize {
            loss: value,
            level,
            mean_square: match loss.is_absolute() {
                true => level * level,
                false => value.mean(),
            },
        }
    }
}
