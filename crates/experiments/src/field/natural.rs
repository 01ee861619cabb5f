//! The residuals of rings as a problem of least squares, with J formed: the networks of fields are small, and rings mix
//! their residuals.
//!
//! J Jᵀ is a product of tiles, the same bits on any number of threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::density::Shape;
use super::rows::{Ring, RowWork};
use lagrangian::train::{Batch, LeastSquares, LossValue, ResidualSize, System};
use nets::Packed;

/// A network in training, with the memory in which the residuals of rings are evaluated.
pub(super) struct RingMemory {
    pub(super) shape: Shape,
    packed: Packed<f64>,
    works: Vec<RowWork>,
    /// r and J of the batch, `[rings · points]` and `[rings · points, P]`.
    residual: Vec<f64>,
    rows: Vec<f64>,
    /// J φ, `[rings · points]`.
    pushed: Vec<f64>,
}

impl RingMemory {
    /// For batches of a number of rings, each of a number of points.
    pub(super) fn new(shape: Shape, points: usize, rings: usize) -> Self {
        Self {
            packed: Packed::new(&shape.net),
            works: (0..rings).map(|_| shape.work(points)).collect(),
            residual: vec![0.0; rings * points],
            rows: vec![0.0; rings * points * shape.net.parameters],
            pushed: Vec::new(),
            shape,
        }
    }
}

/// The residuals of a batch of rings.
pub(super) struct RingProblem<'p> {
    pub(super) memory: &'p mut RingMemory,
    pub(super) batch: Batch<'p>,
    /// Whether J is evaluated too.
    pub(super) linearised: bool,
}

/// Residuals of a tile of J Jᵀ.
const TILE: usize = 64;

impl RingProblem<'_> {
    /// Residuals of the batch.
    fn count(&self) -> usize {
        self.batch.indices.len() * self.batch.samples.n
    }

    /// J, `[residuals, P]`.
    fn rows(&self) -> &[f64] {
        &self.memory.rows[..self.count() * self.memory.shape.net.parameters]
    }

    /// Evaluates r, and J where it is asked for; returns the rings that were omitted for a singular mass matrix.
    fn evaluate(&mut self, theta: &[f64]) -> usize {
        let linearised = self.linearised;
        let Batch { samples, indices } = self.batch;
        let (n, p) = (samples.n, theta.len());
        let RingMemory {
            shape,
            packed,
            works,
            residual,
            rows,
            ..
        } = &mut *self.memory;
        packed.set(&shape.net, theta);
        let (shape, packed) = (&*shape, &*packed);
        let memory = works.par_iter_mut().zip(indices);
        let outputs = residual
            .par_chunks_exact_mut(n)
            .zip(rows.par_chunks_exact_mut(n * p));
        let regular: Vec<bool> = memory
            .zip(outputs)
            .map(|((work, &index), (residual, jacobian))| {
                let at = index * n..(index + 1) * n;
                let ring = Ring {
                    phi: &samples.q[at.clone()],
                    phid: &samples.qd[at.clone()],
                    phidd: &samples.qdd[at],
                };
                let jacobian = linearised.then_some(jacobian);
                shape.residuals(packed, ring, work, residual, jacobian)
            })
            .collect();
        regular.iter().filter(|ok| !**ok).count()
    }
}

impl LeastSquares for RingProblem<'_> {
    fn residuals(&mut self, theta: &[f64]) -> ResidualSize {
        let singular = self.evaluate(theta);
        let residual = &self.memory.residual[..self.count()];
        let counted = (self.batch.indices.len() - singular) * self.batch.samples.n;
        let loss = LossValue {
            sum: residual.iter().map(|r| r * r).sum(),
            count: counted,
            singular,
        };
        let level = residual.iter().map(|r| r.abs()).sum::<f64>() / residual.len() as f64;
        ResidualSize {
            loss,
            level: level.max(1e-12),
            mean_square: loss.mean(),
        }
    }

    fn linearise(&mut self, phi: &[f64]) {
        let rows = self.rows().chunks_exact(phi.len());
        let pushed: Vec<f64> = rows
            .map(|row| lagrangian::mechanics::dot(row, phi))
            .collect();
        self.memory.pushed = pushed;
    }

    fn products(&mut self, _damping: f64, system: &mut System) -> usize {
        let count = self.count();
        system.resize(count);
        gram(self.rows(), self.memory.shape.net.parameters, system);
        let residual = &self.memory.residual[..count];
        system.residual.copy_from_slice(residual);
        system.pushed.copy_from_slice(&self.memory.pushed);
        count
    }

    fn pull_back(&mut self, x: &[f64], phi: &mut [f64]) {
        let parameters = phi.len();
        for (x, row) in x.iter().zip(self.rows().chunks_exact(parameters)) {
            let pairs = phi.iter_mut().zip(row);
            pairs.for_each(|(phi, j)| *phi += x * j);
        }
    }

    fn settle(&mut self, _theta: &mut [f64], _rate: f64) {}
}

/// The lower triangle of J Jᵀ.
fn gram(rows: &[f64], p: usize, out: &mut System) {
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
            out.column_mut(left + c)[from..to].copy_from_slice(column);
        }
    }
}
