//! Natural gradient with J formed: the networks of fields are small, and rings mix their residuals.
//!
//! The step is that of `train/natural` (theory.md, 19); J Jᵀ is a product of tiles, the same bits on any number of
//! threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::rows::{FieldShape, Ring, RowWork};
use lagrangian::train::{NaturalConfig, Samples, System};
use nets::Packed;

/// The memory of a run and the work space of its batches.
pub(super) struct RingNatural {
    /// φ, the step that is remembered.
    phi: Vec<f64>,
    packed: Packed<f64>,
    works: Vec<RowWork>,
    /// r and J of the batch, `[rings · points]` and `[rings · points, P]`.
    residual: Vec<f64>,
    rows: Vec<f64>,
    system: System,
}

/// The loss of a batch.
#[derive(Debug, Clone, Copy)]
pub(super) struct BatchLoss {
    /// Mean squared residual.
    pub(super) mean: f64,
    /// Rings that were left out for a singular mass matrix.
    pub(super) singular: usize,
}

/// Residuals of a tile of J Jᵀ.
const TILE: usize = 64;

impl RingNatural {
    pub(super) fn new(shape: &FieldShape, points: usize, rings: usize) -> Self {
        let parameters = shape.net().parameters;
        Self {
            phi: vec![0.0; parameters],
            packed: Packed::new(shape.net()),
            works: (0..rings).map(|_| shape.work(points)).collect(),
            residual: vec![0.0; rings * points],
            rows: vec![0.0; rings * points * parameters],
            system: System::new(),
        }
    }

    /// Forgets past steps.
    pub(super) fn forget(&mut self) {
        self.phi.fill(0.0);
    }

    /// The loss of at most a batch of rings; nothing moves.
    pub(super) fn loss(
        &mut self,
        shape: &FieldShape,
        (samples, indices): (&Samples, &[usize]),
        parameters: &[f64],
    ) -> BatchLoss {
        self.evaluate(shape, (samples, indices), parameters, false)
    }

    /// The residuals of the rings that were evaluated last.
    pub(super) fn residuals(&self) -> &[f64] {
        &self.residual
    }

    /// Moves `parameters`; returns the loss before. A batch whose system cannot be solved moves nothing but
    /// forgets the momentum.
    pub(super) fn step(
        &mut self,
        shape: &FieldShape,
        config: &NaturalConfig,
        (rate, damping): (f64, f64),
        (samples, indices): (&Samples, &[usize]),
        parameters: &mut [f64],
    ) -> BatchLoss {
        let loss = self.evaluate(shape, (samples, indices), parameters, true);
        let (count, p) = (indices.len() * samples.n, parameters.len());
        let (residual, rows) = (&self.residual[..count], &self.rows[..count * p]);
        let level = residual.iter().map(|r| r.abs()).sum::<f64>() / count as f64;
        let damping = damping * level.clamp(1e-12, 1.0).sqrt();
        let system = &mut self.system;
        system.resize(count);
        gram(rows, p, &mut system.matrix);
        for (i, row) in rows.chunks_exact(p).enumerate() {
            system.matrix[(i, i)] += damping * count as f64;
            let pushed = lagrangian::solve::dot(row, &self.phi);
            system.right[(i, 0)] = residual[i] - config.momentum * pushed;
        }
        if !level.is_finite() || !system.solve() {
            self.phi.fill(0.0);
            return loss;
        }
        self.phi.iter_mut().for_each(|x| *x *= config.momentum);
        for (i, row) in rows.chunks_exact(p).enumerate() {
            let x = system.right[(i, 0)];
            self.phi
                .iter_mut()
                .zip(row)
                .for_each(|(phi, j)| *phi += x * j);
        }
        let length = rate * self.phi.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            self.phi.fill(0.0);
            return loss;
        }
        let rate = rate * (config.longest / length).min(1.0);
        let pairs = parameters.iter_mut().zip(&self.phi);
        pairs.for_each(|(theta, x)| *theta -= rate * x);
        loss
    }

    fn evaluate(
        &mut self,
        shape: &FieldShape,
        (samples, indices): (&Samples, &[usize]),
        parameters: &[f64],
        rows: bool,
    ) -> BatchLoss {
        let (n, p) = (samples.n, parameters.len());
        self.packed.set(shape.net(), parameters);
        let packed = &self.packed;
        let each = self.works.par_iter_mut().zip(indices).zip(
            self.residual
                .par_chunks_exact_mut(n)
                .zip(self.rows.par_chunks_exact_mut(n * p)),
        );
        let regular: Vec<bool> = each
            .map(|((work, &number), (residual, jacobian))| {
                let at = number * n..(number + 1) * n;
                let ring = Ring {
                    phi: &samples.q[at.clone()],
                    phid: &samples.qd[at.clone()],
                    phidd: &samples.qdd[at],
                };
                shape.residuals(packed, ring, work, residual, rows.then_some(jacobian))
            })
            .collect();
        let singular = regular.iter().filter(|ok| !**ok).count();
        let counted = (indices.len() - singular) * n;
        let squares: f64 = self.residual[..indices.len() * n]
            .iter()
            .map(|r| r * r)
            .sum();
        BatchLoss {
            mean: squares / counted as f64,
            singular,
        }
    }
}

/// The lower triangle of J Jᵀ.
fn gram(rows: &[f64], p: usize, out: &mut faer::Mat<f64>) {
    let count = rows.len() / p;
    let j = MatRef::from_row_major_slice(rows, count, p);
    let ends = |k: usize| (k * TILE, ((k + 1) * TILE).min(count));
    let tiles = (0..count.div_ceil(TILE)).flat_map(|k| (0..=k).map(move |l| (k, l)));
    let tiles: Vec<(usize, usize)> = tiles.collect();
    let products: Vec<Vec<f64>> = tiles
        .par_iter()
        .map(|&(k, l)| {
            let ((from, to), (left, right)) = (ends(k), ends(l));
            let (tall, broad) = (to - from, right - left);
            let mut tile = vec![0.0; tall * broad];
            let target = MatMut::from_column_major_slice_mut(&mut tile, tall, broad);
            let (a, b) = (j.subrows(from, tall), j.subrows(left, broad).transpose());
            matmul(target, Accum::Replace, a, b, 1.0, Par::Seq);
            tile
        })
        .collect();
    for (&(k, l), tile) in tiles.iter().zip(&products) {
        let ((from, to), (left, _)) = (ends(k), ends(l));
        for (c, column) in tile.chunks_exact(to - from).enumerate() {
            out.col_as_slice_mut(left + c)[from..to].copy_from_slice(column);
        }
    }
}
