//! The natural gradient of a rollout loss: J Jᵀ of whole segments from the factors of every evaluation in them.
//!
//! A residual of a segment depends on the weights through the rates at its evaluations, r′ = Σₑ Bₑ Dₑ Jₑ, with B from
//! the way back and Jₑ as for a loss of accelerations. Free starts are parameters of their segments alone: they add
//! C Cᵀ to J Jᵀ (theory.md, equation 99).

use rayon::prelude::*;

use super::config::{RolloutLoss, SEGMENTS};
use super::flow::Flow;
use super::segments::Rows;
use super::shoot::{Back, Task};
use super::unit::Unit;
use crate::train::batch::Value;
use crate::train::learner::Learner;
use crate::train::natural::{NaturalConfig, System};
use nets::Packed;

/// The memory of a run and the work space of its batches.
pub(super) struct GaussNewton {
    pub(super) units: Vec<Unit>,
    /// S-space J Jᵀ, evaluation by evaluation, and that of the residuals; both row-major, lower part.
    pub(super) gram: Vec<f64>,
    pub(super) kernel: Vec<f64>,
    system: System,
    packed: Packed<f64>,
    packed_phi: Packed<f64>,
}

impl GaussNewton {
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss, segments: usize) -> Self {
        let (net, unit) = (learner.net(), |_| Unit::new(learner, config));
        Self {
            units: (0..segments.div_ceil(SEGMENTS)).map(unit).collect(),
            gram: Vec::new(),
            kernel: Vec::new(),
            system: System::new(),
            packed: Packed::new(net),
            packed_phi: Packed::new(net),
        }
    }

    /// One step at `rate` with damping `damping`; returns the loss before it. `phi` is the memory of the weights;
    /// `starts` are moved where they are free.
    pub(super) fn step(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        (rate, damping): (f64, f64),
        (task, begins): (&Task<'_>, &[usize]),
        (parameters, phi): (&mut [f64], &mut [f64]),
        moves: &mut Vec<(usize, f64)>,
    ) -> Value {
        let net = learner.net();
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        self.packed_phi.set(net, &phi[..net.parameters]);
        let terms = learner.terms();
        let used = begins.len().div_ceil(SEGMENTS).min(self.units.len());
        let (packed, packed_phi) = (&self.packed, &self.packed_phi);
        let phi_extra = &phi[net.parameters..];
        let pairs = self.units[..used].par_iter_mut();
        pairs
            .zip(begins.par_chunks(SEGMENTS))
            .for_each(|(unit, begins)| {
                let flow = Flow {
                    learner,
                    packed,
                    extra,
                    sizes: unit.block.sizes,
                };
                unit.block.shoot(&flow, task, begins);
                unit.block.back(task, Back::Each);
                unit.mix(task.rows);
                let count = task.config.evaluations(task.rows.horizon);
                for (work, factors) in unit.block.works.iter().zip(&mut unit.factors).take(count) {
                    factors.set(net, &work.pass, &terms);
                }
                unit.push(learner, packed_phi, &terms, (phi_extra, config.momentum));
            });
        let value = self.units[..used]
            .iter()
            .fold(Value::default(), |sum, unit| sum.add(unit.block.value()));
        self.gram(learner, used, task, &terms);
        self.mix_gram(used, task);
        let level = value.mean().sqrt();
        let level = if level.is_finite() {
            level.max(1e-12)
        } else {
            1.0
        };
        if !self.solve(used, task.rows, damping * level.min(1.0).sqrt()) {
            phi.fill(0.0);
            return value;
        }
        self.units[..used].par_iter_mut().for_each(|unit| {
            unit.pull(learner, &terms);
        });
        let rate = self.advance(learner, config, (used, rate), parameters, phi);
        self.move_starts(used, task, rate, moves);
        value
    }

    /// Solves for the weights of the residuals; `false` if the system is not positive definite.
    fn solve(&mut self, used: usize, rows: &Rows, damping: f64) -> bool {
        let each = SEGMENTS * rows.count();
        let size = used * each;
        let system = &mut self.system;
        system.resize(size);
        for c in 0..size {
            for (r, x) in system.matrix.col_as_slice_mut(c)[c..]
                .iter_mut()
                .enumerate()
            {
                *x = self.kernel[(c + r) * size + c];
            }
            system.matrix[(c, c)] += damping * size as f64;
        }
        for (u, unit) in self.units[..used].iter().enumerate() {
            for (k, x) in unit.right.iter().enumerate() {
                system.right[(u * each + k, 0)] = *x;
            }
        }
        if !system.solve() {
            return false;
        }
        for (u, unit) in self.units[..used].iter_mut().enumerate() {
            for (k, x) in unit.right.iter_mut().enumerate() {
                *x = system.right[(u * each + k, 0)];
            }
        }
        self.units[..used]
            .iter()
            .all(|u| u.right.iter().all(|x| x.is_finite()))
    }

    /// φ ← μ φ + Jᵀ x, θ ← θ − η φ; returns η as shortened.
    fn advance(
        &mut self,
        learner: &dyn Learner<f64>,
        config: &NaturalConfig,
        (used, rate): (usize, f64),
        parameters: &mut [f64],
        phi: &mut [f64],
    ) -> f64 {
        let (net, n, k) = (learner.net(), learner.dof(), learner.outputs_each());
        let kinds = learner.extra();
        phi.iter_mut().for_each(|x| *x *= config.momentum);
        if let Some((first, rest)) = self.units[..used].split_first_mut() {
            rest.iter()
                .for_each(|unit| first.gradient.add(&unit.gradient));
            first.gradient.add_to(net, phi);
        }
        for unit in &self.units[..used] {
            for (e, raw) in unit.raw.chunks_exact(SEGMENTS * k).enumerate() {
                let slopes = &unit.block.works[e].extra;
                for (at, slope) in slopes.iter().enumerate() {
                    let (output, kind) = (at / kinds, at % kinds);
                    phi[net.parameters + kind * n + output % k % n] += slope * raw[output];
                }
            }
        }
        let length = rate * phi.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            phi.fill(0.0);
            return 0.0;
        }
        let rate = rate * (config.longest / length.max(config.longest));
        let pairs = parameters.iter_mut().zip(&*phi);
        pairs.for_each(|(theta, x)| *theta -= rate * x);
        learner.project(parameters);
        rate
    }

    /// What free starts move by: (place in `Task::starts`, change).
    fn move_starts(&self, used: usize, task: &Task<'_>, rate: f64, moves: &mut Vec<(usize, f64)>) {
        moves.clear();
        if task.starts.is_empty() {
            return;
        }
        let (rows, d) = (task.rows.count(), task.weights.len());
        for unit in &self.units[..used] {
            let block = &unit.block;
            for s in (0..block.count).filter(|s| !block.is_silent(*s)) {
                for c in 0..d {
                    let weight = task.weights[c];
                    let along = |row: usize| {
                        block.to_start[(s * rows + row) * d + c] * unit.right[s * rows + row]
                    };
                    let step = (0..rows).map(along).sum::<f64>() / (weight * weight);
                    moves.push((block.begins[s] * d + c, -rate * step));
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "gauss_newton_tests.rs"]
mod tests;
