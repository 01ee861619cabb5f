//! Natural gradient (Gauss–Newton, Levenberg–Marquardt) in the space of samples, with momentum.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | r | residuals of the batch, of order one | N |
//! | J | ∂r/∂θ, never formed | N × P |
//! | φ | step, remembered | P |
//! | μ, λ, η | momentum, damping, rate | |
//!
//! φ ← μ φ + Jᵀ (J Jᵀ + λ N I)⁻¹ (r − μ J φ), θ ← θ − η φ, J by its factors (theory.md, equations 19 and 20)
//! (SPRING: Goldshlager, Abrahamsen, Lin 2024, arXiv 2401.10190).

mod block;
mod config;
mod mix;
mod system;
mod tiles;
mod weights;

use rayon::prelude::*;

use block::{BLOCK, Block, level};
pub use config::NaturalConfig;
pub use system::System;
use tiles::Tiles;

use super::batch::{Samples, Value};
use super::learner::Learner;
use super::loss::Loss;
use super::part::Part;
use nets::{Packed, Terms};

/// The memory of a run and the work space of its batches.
pub(crate) struct Natural {
    /// φ.
    pub(crate) phi: Vec<f64>,
    blocks: Vec<Block>,
    tiles: Tiles,
    system: System,
    packed: Packed<f64>,
    packed_phi: Packed<f64>,
}

impl Natural {
    pub(crate) fn new(learner: &dyn Learner<f64>, batch: usize) -> Self {
        let net = learner.net();
        let count = batch.div_ceil(BLOCK);
        let blocks: Vec<Block> = (0..count).map(|_| Block::new(learner)).collect();
        Self {
            phi: vec![0.0; learner.parameters()],
            tiles: Tiles::new(learner, &blocks),
            blocks,
            system: System::new(),
            packed: Packed::new(net),
            packed_phi: Packed::new(net),
        }
    }

    /// One step at `rate` with damping `damping`; returns the loss before it. A batch whose system cannot be solved
    /// moves nothing but forgets the momentum.
    pub(crate) fn step(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        loss: Loss,
        (rate, damping): (f64, f64),
        (samples, numbers): (&Samples, &[usize]),
        parameters: &mut [f64],
    ) -> Value {
        let nobody = &mut |_| ();
        self.step_in_parts(
            learner,
            (config, loss),
            (rate, damping),
            (samples, numbers),
            parameters,
            nobody,
        )
    }

    /// [`Natural::step`], which says of each part that it is done.
    pub(crate) fn step_in_parts(
        &mut self,
        learner: &dyn Learner<f64>,
        (config, loss): (&NaturalConfig, Loss),
        (rate, damping): (f64, f64),
        (samples, numbers): (&Samples, &[usize]),
        parameters: &mut [f64],
        done: &mut dyn FnMut(Part),
    ) -> Value {
        let m = learner.residuals_each();
        let terms = learner.terms();
        let used = numbers.len().div_ceil(BLOCK);
        self.forward(learner, (samples, numbers), parameters);
        let level = level(&self.blocks[..used], m);
        done(Part::Forward);
        let value = self.backward(learner, (config, loss), (used, level), &terms);
        done(Part::Backward);
        let mean_square = match loss.is_absolute() {
            true => level * level,
            false => value.mean(),
        };
        let damping = on_level(config.damping_rule.on_batch(damping, mean_square), level);
        let blocks = &mut self.blocks[..used];
        self.tiles.fill(learner, blocks, &terms, damping);
        done(Part::Products);
        let solved = weights::solve(&mut self.system, &self.tiles, blocks, (m, damping));
        done(Part::Solve);
        if !solved {
            self.phi.fill(0.0);
            return value;
        }
        blocks
            .par_iter_mut()
            .for_each(|block| block.pull_back(learner, &terms));
        done(Part::PullBack);
        self.advance(learner, config, used, rate, parameters);
        done(Part::Update);
        value
    }

    /// Parameters into panels, samples into blocks, r.
    fn forward(
        &mut self,
        learner: &dyn Learner<f64>,
        (samples, numbers): (&Samples, &[usize]),
        parameters: &[f64],
    ) {
        let net = learner.net();
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        self.packed_phi.set(net, &self.phi[..net.parameters]);
        let packed = &self.packed;
        self.blocks
            .par_iter_mut()
            .zip(numbers.par_chunks(BLOCK))
            .for_each(|(block, numbers)| {
                samples.gather(numbers, &mut block.work);
                learner.residuals(packed, extra, &mut block.work);
            });
    }

    /// The factors of J and r − μ J φ of the blocks that are used; the loss.
    fn backward(
        &mut self,
        learner: &dyn Learner<f64>,
        (config, loss): (&NaturalConfig, Loss),
        (used, level): (usize, f64),
        terms: &Terms,
    ) -> Value {
        let m = learner.residuals_each();
        let phi_extra = &self.phi[learner.net().parameters..];
        let (packed, phi) = (&self.packed, (&self.packed_phi, phi_extra));
        self.blocks[..used].par_iter_mut().for_each(|block| {
            block.weigh(loss, level, m);
            block.linearise(learner, packed, terms);
            block.push_momentum(learner, config.momentum, phi, terms);
        });
        self.blocks[..used]
            .iter()
            .fold(Value::default(), |sum, b| sum.add(b.value))
    }

    /// How much of the fall that the quadratic model foresaw for the batch of the last step became true; `values` are its
    /// losses before and after.
    pub(crate) fn gain(
        &self,
        learner: &dyn Learner<f64>,
        at: (f64, f64),
        (before, after): (Value, Value),
        batch: usize,
    ) -> f64 {
        // Absolute values are squares over the mean |r| of the batch (see `Block::weigh`).
        let unit = match learner.loss().0.is_absolute() {
            true => before.mean(),
            false => 1.0,
        };
        let foreseen = before.mean() - self.foreseen(learner, at, batch) / unit;
        (before.mean() - after.mean()) / foreseen.max(f64::MIN_POSITIVE)
    }

    /// The mean square that the quadratic model foresees for the batch of the last step, taken at `rate` with damping
    /// `damping`: with x = (J Jᵀ + λ N I)⁻¹ (r − μ J φ), J φ after the step is r − λ N x whatever the momentum.
    fn foreseen(
        &self,
        learner: &dyn Learner<f64>,
        (rate, damping): (f64, f64),
        batch: usize,
    ) -> f64 {
        let m = learner.residuals_each();
        let used = &self.blocks[..batch.div_ceil(BLOCK)];
        let damping = on_level(damping, level(used, m)) * (used.len() * BLOCK * m) as f64;
        let squares = used.iter().flat_map(|block| {
            let pairs = block.work.residual.iter().zip(&block.right);
            pairs.map(|(r, x)| ((1.0 - rate) * r + rate * damping * x).powi(2))
        });
        squares.sum::<f64>() / (batch * learner.counted()).max(1) as f64
    }

    /// φ ← μ φ + Jᵀ x, θ ← θ − η φ.
    fn advance(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        used: usize,
        rate: f64,
        parameters: &mut [f64],
    ) {
        let net = learner.net();
        self.phi.iter_mut().for_each(|x| *x *= config.momentum);
        let blocks = &mut self.blocks[..used];
        if let Some((first, rest)) = blocks.split_first_mut() {
            rest.iter()
                .for_each(|block| first.gradient.add(&block.gradient));
            first.gradient.add_to(net, &mut self.phi);
        }
        let phi_extra = &mut self.phi[net.parameters..];
        blocks
            .iter_mut()
            .for_each(|block| block.pull_extra_back(learner, phi_extra));
        let length = rate * self.phi.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            self.phi.fill(0.0);
            return;
        }
        let rate = if length > config.longest {
            rate * config.longest / length
        } else {
            rate
        };
        parameters
            .iter_mut()
            .zip(&self.phi)
            .for_each(|(theta, x)| *theta -= rate * x);
        learner.project(parameters);
    }
}

/// λ of a batch whose mean |r| is `level`: far from the solution the quadratic model is poor; near it, damping is all that
/// slows the step.
fn on_level(damping: f64, level: f64) -> f64 {
    damping * level.min(1.0).sqrt()
}
