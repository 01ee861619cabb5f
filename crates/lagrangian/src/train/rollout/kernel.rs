//! The kernel of the residuals of a rollout loss: J Jᵀ between single evaluations, and their combination by the chain rule.

use lagrangian_motion::parallel::prelude::*;

use super::config::SEGMENTS;
use super::gauss_newton::GaussNewton;
use super::shoot::{Block, Task};
use crate::train::learner::{Learner, Work};
use nets::{Terms, TileScratch};

impl GaussNewton {
    /// The lower part of S-space J Jᵀ, row (evaluation · k + i) · samples + s of each block after the other.
    pub(super) fn gram(
        &mut self,
        learner: &dyn Learner<f64>,
        used: usize,
        task: &Task<'_>,
        terms: &Terms,
    ) {
        let (net, n, force_terms) = (learner.net(), learner.dof(), learner.extra());
        let count = task.config.evaluations(task.rows.horizon);
        let tile = SEGMENTS * learner.outputs_each();
        let (units, size) = (&self.units, used * count * tile);
        grow(&mut self.gram, size * size);
        let rows = self.gram.par_chunks_mut((tile * size).max(1)).enumerate();
        let scratch = || {
            let scratch = TileScratch::new(&units[0].factors[0]);
            (scratch, vec![0.0; tile * tile])
        };
        rows.for_each_init(scratch, |(scratch, raw), (row, out)| {
            let unit = &units[row / count];
            let left = &unit.block.works[row % count];
            for column in 0..=row {
                let right = &units[column / count];
                let factors = &right.factors[column % count];
                unit.factors[row % count].tile(net, factors, terms, scratch, raw);
                add_extra(
                    left,
                    &right.block.works[column % count],
                    (n, force_terms),
                    raw,
                );
                for (to, from) in out.chunks_exact_mut(size).zip(raw.chunks_exact(tile)) {
                    to[column * tile..][..tile].copy_from_slice(from);
                }
            }
        });
        // Within a block both orders of two evaluations are needed.
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
    pub(super) fn fill_kernel(&mut self, used: usize, task: &Task<'_>) {
        let rows = task.rows.count();
        let segments = used * SEGMENTS;
        let (units, gram) = (&self.units[..used], &self.gram);
        grow(&mut self.kernel, (segments * rows).pow(2));
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
                    let others = b.chained[t * rows * width..][..rows * width].chunks_exact(width);
                    for (x, other) in out.iter_mut().zip(others) {
                        *x = lagrangian_motion::solve::dot(&between, other);
                    }
                    starts_kernel((&a.block, s, i), (&b.block, t), task, out);
                }
            }
        });
    }
}

/// Adds to row `i` of the kernel of two segments the contribution of a free start at which both begin, in units of its
/// weights.
fn starts_kernel(
    (a, s, i): (&Block, usize, usize),
    (b, t): (&Block, usize),
    task: &Task<'_>,
    out: &mut [f64],
) {
    if !task.rows.start || a.begins[s] != b.begins[t] {
        return;
    }
    let (rows, d) = (out.len(), task.weights.len());
    // ∂(residual)/∂(component c of its start) over the weight of c.
    let slope = |block: &Block, s: usize, row: usize, c: usize| {
        block.sensitivities.to_start[(s * rows + row) * d + c] / task.weights[c]
    };
    for c in 0..d {
        let left = slope(a, s, i, c);
        if left == 0.0 {
            continue;
        }
        for (row, x) in out.iter_mut().enumerate() {
            *x += left * slope(b, t, row, c);
        }
    }
}

/// Adds the forces' part to a tile of S-space J Jᵀ.
fn add_extra(
    left: &Work<f64>,
    right: &Work<f64>,
    (n, force_terms): (usize, usize),
    raw: &mut [f64],
) {
    if force_terms == 0 {
        return;
    }
    let tile = left.linear.along.len();
    let k = tile / SEGMENTS;
    for (i, j) in (0..k).flat_map(|i| (0..k).map(move |j| (i, j))) {
        if i % n != j % n {
            continue;
        }
        for s in 0..SEGMENTS {
            let row = &mut raw[(i * SEGMENTS + s) * tile + j * SEGMENTS..][..SEGMENTS];
            let a = &left.linear.extra[(s * k + i) * force_terms..][..force_terms];
            for (t, x) in row.iter_mut().enumerate() {
                let b = &right.linear.extra[(t * k + j) * force_terms..][..force_terms];
                *x += lagrangian_motion::solve::dot(a, b);
            }
        }
    }
}

/// Gives it this length. Where it has to grow, its memory is returned first: all of it is written again, and both would be held.
fn grow(matrix: &mut Vec<f64>, size: usize) {
    if size > matrix.capacity() {
        *matrix = Vec::new();
    }
    matrix.resize(size, 0.0);
}
