//! The natural gradient of a rollout loss: J Jᵀ of whole segments from the factors of every evaluation in them.
//!
//! A residual of a segment depends on the weights through the rates at its evaluations, r′ = Σₑ Bₑ Dₑ Jₑ, with B from
//! the way back and Jₑ as for a loss of accelerations. Free starts are parameters of their segments alone: they add
//! C Cᵀ to J Jᵀ (theory.md, equation 99).

use rayon::prelude::*;

use super::config::{RolloutLoss, SEGMENTS};
use super::flow::Flow;
use super::segments::Rows;
use super::shoot::{Back, Block, Task};
use crate::mlp::simd::Buffer;
use crate::mlp::{Gradient, Packed, TileScratch, Transposed};
use crate::train::batch::Value;
use crate::train::learner::{Learner, Work};
use crate::train::natural::{NaturalConfig, System};

/// The memory of a run and the work space of its batches.
pub(super) struct GaussNewton {
    units: Vec<Unit>,
    /// S-space J Jᵀ, evaluation by evaluation, and that of the residuals; both row-major, lower part.
    gram: Vec<f64>,
    kernel: Vec<f64>,
    system: System,
    packed: Packed<f64>,
    packed_phi: Packed<f64>,
}

/// A block of segments and what the natural gradient needs of it.
struct Unit {
    block: Block,
    transposed: Vec<Transposed<f64>>,
    gradient: Gradient<f64>,
    wide: Buffer<f64>,
    /// B D, `[samples, rows, evaluations · k]`.
    mixed: Vec<f64>,
    /// r − μ J φ, then the solution, `[samples, rows]`.
    right: Vec<f64>,
    /// J φ, then Dᵀ Bᵀ x, in S-space, `[evaluations, samples, k]`.
    raw: Vec<f64>,
}

impl GaussNewton {
    pub(super) fn new(learner: &dyn Learner<f64>, config: &RolloutLoss, segments: usize) -> Self {
        let net = learner.net();
        let unit = |_| {
            let block = Block::new(learner, config, true);
            let pass = &block.works[0].pass;
            Unit {
                transposed: (0..block.works.len())
                    .map(|_| Transposed::new(net, pass))
                    .collect(),
                wide: Buffer::new(pass.widest()),
                gradient: Gradient::new(net),
                mixed: Vec::new(),
                right: Vec::new(),
                raw: Vec::new(),
                block,
            }
        };
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
                for (work, transposed) in unit
                    .block
                    .works
                    .iter()
                    .zip(&mut unit.transposed)
                    .take(count)
                {
                    transposed.set(net, &work.pass, &terms);
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

    /// The lower part of S-space J Jᵀ, row (evaluation · k + i) · samples + s of each block after the other.
    fn gram(
        &mut self,
        learner: &dyn Learner<f64>,
        used: usize,
        task: &Task<'_>,
        terms: &[Vec<(usize, usize)>],
    ) {
        let (net, n, kinds) = (learner.net(), learner.dof(), learner.extra());
        let count = task.config.evaluations(task.rows.horizon);
        let tile = SEGMENTS * learner.outputs_each();
        let (units, size) = (&self.units, used * count * tile);
        self.gram.resize(size * size, 0.0);
        let rows = self.gram.par_chunks_mut((tile * size).max(1)).enumerate();
        let scratch = || {
            let pass = &units[0].block.works[0].pass;
            (TileScratch::new(pass), vec![0.0; tile * tile])
        };
        rows.for_each_init(scratch, |(scratch, raw), (row, out)| {
            let left = &units[row / count].block.works[row % count];
            for column in 0..=row {
                let right = &units[column / count];
                let transposed = &right.transposed[column % count];
                left.pass.gram_tile(net, transposed, terms, scratch, raw);
                add_extra(left, &right.block.works[column % count], (n, kinds), raw);
                for (to, from) in out.chunks_exact_mut(size).zip(raw.chunks_exact(tile)) {
                    to[column * tile..][..tile].copy_from_slice(from);
                }
            }
        });
        // Within a block both orders of two evaluations are asked for.
        let block = count * tile;
        for first in (0..used).map(|u| u * block) {
            for i in first..first + block {
                for j in first..i {
                    self.gram[j * size + i] = self.gram[i * size + j];
                }
            }
        }
    }

    /// The lower part of the kernel of the residuals, segment by segment: B D G Dᵀ Bᵀ + C Cᵀ.
    fn mix_gram(&mut self, used: usize, task: &Task<'_>) {
        let rows = task.rows.count();
        let segments = used * SEGMENTS;
        let (units, gram) = (&self.units[..used], &self.gram);
        self.kernel.resize((segments * rows).pow(2), 0.0);
        let chunks = self.kernel.par_chunks_mut((rows * segments * rows).max(1));
        chunks.enumerate().for_each(|(left, out)| {
            let mut between = Vec::new();
            for right in 0..=left {
                let (a, b) = (&units[left / SEGMENTS], &units[right / SEGMENTS]);
                let (s, t) = (left % SEGMENTS, right % SEGMENTS);
                let skip = a.block.is_silent(s) || b.block.is_silent(t);
                for (i, out) in out.chunks_exact_mut(segments * rows).enumerate() {
                    let out = &mut out[right * rows..][..rows];
                    out.fill(0.0);
                    if skip {
                        continue;
                    }
                    a.row(gram, (used, left, right), (s, i), &mut between);
                    let width = between.len();
                    let others = b.mixed[t * rows * width..][..rows * width].chunks_exact(width);
                    for (x, other) in out.iter_mut().zip(others) {
                        *x = crate::solve::dot(&between, other);
                    }
                    starts_kernel((&a.block, s, i), (&b.block, t), task, out);
                }
            }
        });
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
                    if task.rows.end {
                        let row = task.rows.first(task.rows.horizon + 1) + c;
                        let pull = task.config.continuity * unit.right[s * rows + row] / weight;
                        let next = block.begins[s] + task.rows.horizon;
                        moves.push((next * d + c, rate * pull));
                    }
                }
            }
        }
    }
}

/// Adds what free starts that two segments share add to row `i` of their kernel, in units of their weights.
fn starts_kernel(
    (a, s, i): (&Block, usize, usize),
    (b, t): (&Block, usize),
    task: &Task<'_>,
    out: &mut [f64],
) {
    if task.starts.is_empty() {
        return;
    }
    let (rows, d, horizon) = (out.len(), task.weights.len(), task.rows.horizon);
    let gap = task.rows.first(horizon + 1);
    // ∂(residual)/∂(component c of the start at sample `begin`) over its weight.
    let slope = |block: &Block, s: usize, row: usize, begin: usize, c: usize| {
        let mut slope = 0.0;
        if block.begins[s] == begin {
            slope += block.to_start[(s * rows + row) * d + c] / task.weights[c];
        }
        if task.rows.end && row == gap + c && block.begins[s] + horizon == begin {
            slope -= task.config.continuity;
        }
        slope
    };
    let own = [a.begins[s], a.begins[s] + horizon];
    for begin in own.into_iter().take(1 + usize::from(task.rows.end)) {
        if begin != b.begins[t] && !(task.rows.end && begin == b.begins[t] + horizon) {
            continue;
        }
        for c in 0..d {
            let left = slope(a, s, i, begin, c);
            if left == 0.0 {
                continue;
            }
            for (row, x) in out.iter_mut().enumerate() {
                *x += left * slope(b, t, row, begin, c);
            }
        }
    }
}

/// Adds the forces' part to a tile of S-space J Jᵀ.
fn add_extra(left: &Work<f64>, right: &Work<f64>, (n, kinds): (usize, usize), raw: &mut [f64]) {
    if kinds == 0 {
        return;
    }
    let tile = left.along.len();
    let k = tile / SEGMENTS;
    for (i, j) in (0..k).flat_map(|i| (0..k).map(move |j| (i, j))) {
        if i % n != j % n {
            continue;
        }
        for s in 0..SEGMENTS {
            let row = &mut raw[(i * SEGMENTS + s) * tile + j * SEGMENTS..][..SEGMENTS];
            let a = &left.extra[(s * k + i) * kinds..][..kinds];
            for (t, x) in row.iter_mut().enumerate() {
                let b = &right.extra[(t * k + j) * kinds..][..kinds];
                *x += crate::solve::dot(a, b);
            }
        }
    }
}

impl Block {
    /// Whether segment `s` weighs nothing.
    pub(super) fn is_silent(&self, s: usize) -> bool {
        self.failed[s] || s >= self.count
    }
}

impl Unit {
    /// B D of every residual and evaluation.
    fn mix(&mut self, rows: &Rows) {
        let block = &self.block;
        let (rates, k, d) = (block.sizes.rates, block.sizes.outputs, block.sizes.state());
        let rows = rows.count();
        let total = block.direct.len() / (SEGMENTS * rows * d);
        self.mixed.clear();
        self.mixed.resize(SEGMENTS * rows * total * k, 0.0);
        for (at, direct) in block.direct.chunks_exact(d).enumerate() {
            let (s, e) = (at / (rows * total), at % total);
            let mix = &block.points[e].mix[s * rates * k..][..rates * k];
            let out = &mut self.mixed[at * k..][..k];
            for (weight, mix) in direct[d - rates..].iter().zip(mix.chunks_exact(k)) {
                if *weight != 0.0 {
                    out.iter_mut().zip(mix).for_each(|(o, m)| *o += weight * m);
                }
            }
        }
    }

    /// right = r − μ J φ.
    fn push(
        &mut self,
        learner: &dyn Learner<f64>,
        phi: &Packed<f64>,
        terms: &[Vec<(usize, usize)>],
        (phi_extra, momentum): (&[f64], f64),
    ) {
        let (net, n, kinds) = (learner.net(), learner.dof(), learner.extra());
        let k = self.block.sizes.outputs;
        let rows = self.block.residual.len() / SEGMENTS;
        let total = self.mixed.len() / (SEGMENTS * rows * k);
        self.raw.clear();
        self.raw.resize(total * SEGMENTS * k, 0.0);
        for (work, raw) in self
            .block
            .works
            .iter()
            .zip(self.raw.chunks_exact_mut(SEGMENTS * k))
        {
            work.pass.push_forward(net, phi, terms, &mut self.wide, raw);
            for (at, raw) in raw.iter_mut().enumerate() {
                for e in 0..kinds {
                    *raw += work.extra[at * kinds + e] * phi_extra[e * n + at % k % n];
                }
            }
        }
        self.right.clone_from(&self.block.residual);
        for (at, right) in self.right.iter_mut().enumerate() {
            let (s, mixed) = (at / rows, &self.mixed[at * total * k..][..total * k]);
            for (e, mixed) in mixed.chunks_exact(k).enumerate() {
                let raw = &self.raw[(e * SEGMENTS + s) * k..][..k];
                *right -= momentum * crate::solve::dot(mixed, raw);
            }
        }
    }

    /// Row `i` of B D of segment `s`, times the part of S-space J Jᵀ between it and another, to `out`
    /// `[evaluations · k]`.
    fn row(
        &self,
        gram: &[f64],
        (used, left, right): (usize, usize, usize),
        (s, i): (usize, usize),
        out: &mut Vec<f64>,
    ) {
        let rows = self.block.residual.len() / SEGMENTS;
        let width = self.mixed.len() / (SEGMENTS * rows);
        let size = used * width * SEGMENTS;
        out.clear();
        out.resize(width, 0.0);
        let (first, column) = (left / SEGMENTS, right / SEGMENTS);
        for (j, weight) in self.mixed[(s * rows + i) * width..][..width]
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
    fn pull(&mut self, learner: &dyn Learner<f64>, terms: &[Vec<(usize, usize)>]) {
        let k = self.block.sizes.outputs;
        let rows = self.block.residual.len() / SEGMENTS;
        let total = self.raw.len() / (SEGMENTS * k);
        self.raw.fill(0.0);
        for (at, weight) in self.right.iter().enumerate() {
            let (s, mixed) = (at / rows, &self.mixed[at * total * k..][..total * k]);
            for (e, mixed) in mixed.chunks_exact(k).enumerate() {
                let raw = &mut self.raw[(e * SEGMENTS + s) * k..][..k];
                raw.iter_mut()
                    .zip(mixed)
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

#[cfg(test)]
#[path = "gauss_newton_tests.rs"]
mod tests;
