//! The problem of least squares of a rollout loss: J Jᵀ of whole segments from the factors of every evaluation in them.
//!
//! A residual of a segment depends on the weights through the rates at its evaluations, r′ = Σₑ Bₑ Dₑ Jₑ, with B from
//! back-propagation and Jₑ as for a loss of accelerations. Free starts are parameters of their segments alone: they add
//! C Cᵀ to J Jᵀ (theory.md, equation 99).

use std::ops::Add;

use lagrangian_motion::parallel::prelude::*;

use super::config::{RolloutLoss, SEGMENTS};
use super::flow::Flow;
use super::segments::{Recorded, Rows};
use super::shoot::{Back, Task};
use super::unit::Unit;
use crate::train::System;
use crate::train::learner::Learner;
use crate::train::problem::{LeastSquares, LossValue, ResidualSize};
use nets::{Packed, Terms};

/// The memory in which a batch of segments is evaluated.
pub(super) struct GaussNewton {
    pub(super) units: Vec<Unit>,
    /// S-space J Jᵀ, evaluation by evaluation, and that of the residuals; both row-major, lower part.
    pub(super) gram: Vec<f64>,
    pub(super) kernel: Vec<f64>,
    packed: Packed<f64>,
    direction: Packed<f64>,
}

impl GaussNewton {
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss, segments: usize) -> Self {
        let (net, unit) = (learner.net(), |_| Unit::new(learner, config));
        Self {
            units: (0..segments.div_ceil(SEGMENTS)).map(unit).collect(),
            gram: Vec::new(),
            kernel: Vec::new(),
            packed: Packed::new(net),
            direction: Packed::new(net),
        }
    }
}

/// The segments of a step, and the measure of their errors.
pub(super) struct Segments<'p> {
    pub(super) recorded: Recorded<'p>,
    pub(super) config: &'p RolloutLoss,
    /// The weights of the components of a state, `[2n]`.
    pub(super) weights: &'p [f64],
    pub(super) rows: Rows,
    /// The samples at which they start.
    pub(super) begins: Vec<usize>,
}

impl Segments<'_> {
    /// The task that all segments share; `starts` are the free starts, where they are needed.
    pub(super) fn task<'t>(&'t self, starts: &'t [f64]) -> Task<'t> {
        Task {
            recorded: self.recorded,
            config: self.config,
            weights: self.weights,
            starts,
            rows: &self.rows,
        }
    }
}

/// The residuals of a batch of segments. The free starts follow the parameters of the model in θ.
pub(super) struct RolloutProblem<'p> {
    pub(super) memory: &'p mut GaussNewton,
    pub(super) learner: &'p dyn Learner<f64>,
    pub(super) segments: Segments<'p>,
    pub(super) terms: Terms,
}

impl RolloutProblem<'_> {
    /// The number of blocks of this batch.
    fn used(&self) -> usize {
        let blocks = self.segments.begins.len().div_ceil(SEGMENTS);
        blocks.min(self.memory.units.len())
    }
}

impl LeastSquares for RolloutProblem<'_> {
    fn residuals(&mut self, theta: &[f64]) -> ResidualSize {
        let (learner, used) = (self.learner, self.used());
        let (parameters, starts) = theta.split_at(learner.parameters());
        let (weights, extra) = parameters.split_at(learner.net().parameters);
        let GaussNewton { units, packed, .. } = &mut *self.memory;
        packed.set(learner.net(), weights);
        let (task, packed) = (self.segments.task(starts), &*packed);
        let pairs = units[..used].par_iter_mut();
        pairs
            .zip(self.segments.begins.par_chunks(SEGMENTS))
            .for_each(|(unit, begins)| {
                let flow = Flow {
                    learner,
                    packed,
                    extra,
                    sizes: unit.block.sizes,
                };
                unit.block.shoot(&flow, &task, begins);
            });
        let values = units[..used].iter().map(|unit| unit.block.value());
        let loss = values.fold(LossValue::default(), LossValue::add);
        let level = loss.mean().sqrt();
        ResidualSize {
            loss,
            level: if level.is_finite() {
                level.max(1e-12)
            } else {
                1.0
            },
            mean_square: loss.mean(),
        }
    }

    fn linearise(&mut self, phi: &[f64]) {
        let (learner, used) = (self.learner, self.used());
        let net = learner.net();
        let (weights, extra) = phi.split_at(net.parameters);
        let GaussNewton {
            units, direction, ..
        } = &mut *self.memory;
        direction.set(net, weights);
        let (task, direction, terms) = (self.segments.task(&[]), &*direction, &self.terms);
        let count = task.config.evaluations(task.rows.horizon);
        units[..used].par_iter_mut().for_each(|unit| {
            unit.block.back(&task, Back::Each);
            unit.chain(task.rows);
            for (work, factors) in unit.block.works.iter().zip(&mut unit.factors).take(count) {
                factors.set(net, &work.pass, terms);
            }
            unit.push(learner, direction, terms, extra);
        });
    }

    fn products(&mut self, _damping: f64, system: &mut System) -> usize {
        let used = self.used();
        let (memory, task) = (&mut *self.memory, self.segments.task(&[]));
        memory.gram(self.learner, used, &task, &self.terms);
        memory.fill_kernel(used, &task);
        let each = SEGMENTS * self.segments.rows.count();
        let size = used * each;
        system.resize(size);
        for column in 0..size {
            let below = system.column_mut(column)[column..].iter_mut();
            for (r, x) in below.enumerate() {
                *x = memory.kernel[(column + r) * size + column];
            }
        }
        for (unit, rows) in memory.units[..used].iter().zip((0..size).step_by(each)) {
            system.residual[rows..rows + each].copy_from_slice(&unit.block.residual);
            system.pushed[rows..rows + each].copy_from_slice(&unit.right);
        }
        size
    }

    fn pull_back(&mut self, x: &[f64], phi: &mut [f64]) {
        let (learner, terms, used) = (self.learner, &self.terms, self.used());
        let units = &mut self.memory.units[..used];
        let each = SEGMENTS * self.segments.rows.count();
        units
            .par_iter_mut()
            .zip(x.par_chunks(each))
            .for_each(|(unit, x)| {
                unit.right.copy_from_slice(x);
                unit.pull(learner, terms);
            });
        let (net, k) = (learner.net(), learner.outputs_each());
        if let Some((first, rest)) = units.split_first_mut() {
            rest.iter()
                .for_each(|unit| first.gradient.add(&unit.gradient));
            first.gradient.add_to(net, phi);
        }
        let phi = &mut phi[net.parameters..];
        for unit in units.iter() {
            for (work, raw) in unit
                .block
                .works
                .iter()
                .zip(unit.raw.chunks_exact(SEGMENTS * k))
            {
                work.linear.pull_forces(learner, raw, phi);
            }
        }
    }

    fn settle(&mut self, theta: &mut [f64], rate: f64) {
        let (parameters, starts) = theta.split_at_mut(self.learner.parameters());
        self.learner.project(parameters);
        if self.segments.rows.start {
            self.move_starts(starts, rate);
        }
    }
}

impl RolloutProblem<'_> {
    /// Moves the free starts of the segments.
    fn move_starts(&self, starts: &mut [f64], rate: f64) {
        let (rows, weights) = (self.segments.rows.count(), self.segments.weights);
        let d = weights.len();
        for unit in &self.memory.units[..self.used()] {
            let block = &unit.block;
            for s in (0..block.count).filter(|s| !block.is_silent(*s)) {
                for (c, weight) in weights.iter().enumerate() {
                    let along = |row: usize| {
                        block.sensitivities.to_start[(s * rows + row) * d + c]
                            * unit.right[s * rows + row]
                    };
                    let change = -rate * ((0..rows).map(along).sum::<f64>() / (weight * weight));
                    if change.is_finite() {
                        starts[block.begins[s] * d + c] += change;
                    }
                }
            }
        }
    }
}
