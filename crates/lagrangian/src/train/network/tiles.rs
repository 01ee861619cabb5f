//! The lower triangle of J Jᵀ, tile by tile, and the scratch of the threads that fill it.

use std::sync::{Mutex, PoisonError};

use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::sort_by_number;

use super::block::{BLOCK, Block};
use super::products::tile_of_residuals;
use crate::train::learner::Learner;
use nets::simd::Real;
use nets::{Factors, Terms, TileScratch};

/// J Jᵀ may be rounded to single precision where the damping on its diagonal exceeds this part of its largest entry.
const ROUNDED: f64 = 1e-6;

/// The number of tiles on the side of a square.
const SQUARE: usize = 2;

/// The products of two blocks, of m residuals and `BLOCK` samples each: `[residual, sample]` of one by that of the other.
pub(super) struct Tile {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) values: Vec<f64>,
}

/// J Jᵀ of a batch.
pub(super) struct Tiles {
    tiles: Vec<Tile>,
    /// The scratch of each thread.
    scratch: Vec<Mutex<Scratch>>,
    /// The number of residuals of a block.
    count: usize,
}

impl Tiles {
    pub(super) fn new(learner: &dyn Learner<f64>, blocks: &[Block]) -> Self {
        let count = BLOCK * learner.residuals_each();
        let tile = |(row, column)| Tile {
            row,
            column,
            values: vec![0.0; count * count],
        };
        let scratch = |_| {
            Some(Mutex::new(Scratch::new(
                blocks.first()?,
                learner.outputs_each(),
            )))
        };
        Self {
            tiles: in_squares(blocks.len()).into_iter().map(tile).collect(),
            scratch: (0..lagrangian_motion::parallel::current_num_threads())
                .filter_map(scratch)
                .collect(),
            count,
        }
    }

    /// The tiles of the first `used` blocks.
    pub(super) fn of(&self, used: usize) -> impl Iterator<Item = &Tile> {
        self.tiles.iter().filter(move |t| t.row < used)
    }

    /// J Jᵀ of the blocks: first the tiles on the diagonal in double precision, then the others, in single where `damping`
    /// hides the rounding.
    pub(super) fn fill(
        &mut self,
        learner: &dyn Learner<f64>,
        blocks: &mut [Block],
        terms: &Terms,
        damping: f64,
    ) {
        let (used, count, scratch) = (blocks.len(), self.count, &self.scratch[..]);
        let (mut diagonal, mut others): (Vec<_>, Vec<_>) = self
            .tiles
            .iter_mut()
            .filter(|t| t.row < used)
            .partition(|t| t.row == t.column);
        let of = (learner, terms);
        fill(
            &mut diagonal,
            (blocks, scratch),
            of,
            |b| &b.factors,
            Scratch::double,
        );
        let largest = diagonal
            .iter()
            .flat_map(|t| t.values.iter().step_by(count + 1))
            .fold(0.0, |largest: f64, x| largest.max(*x));
        if damping * (used * count) as f64 > ROUNDED * largest {
            blocks
                .par_iter_mut()
                .for_each(|b| b.rounded.set(learner.net(), &b.work.pass, terms));
            fill(
                &mut others,
                (blocks, scratch),
                of,
                |b| &b.rounded,
                Scratch::single,
            );
        } else {
            fill(
                &mut others,
                (blocks, scratch),
                of,
                |b| &b.factors,
                Scratch::double,
            );
        }
    }
}

/// The lower triangle of a matrix of `count` × `count` tiles, square after square, so that the factors of neighbours are
/// still in the cache.
fn in_squares(count: usize) -> Vec<(usize, usize)> {
    let mut tiles: Vec<_> = (0..count)
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .collect();
    sort_by_number(&mut tiles, |&(i, j)| {
        (i / SQUARE * count + j / SQUARE) as f64
    });
    tiles
}

/// The scratch of a thread for a tile, in both precisions; kept, since allocating it is slow.
struct Scratch {
    double: TileScratch<f64>,
    single: TileScratch<f32>,
    raw: Vec<f64>,
}

impl Scratch {
    fn new(block: &Block, outputs: usize) -> Self {
        Self {
            double: TileScratch::new(&block.factors),
            single: TileScratch::new(&block.rounded),
            raw: vec![0.0; (BLOCK * outputs).pow(2)],
        }
    }

    fn double(&mut self) -> (&mut TileScratch<f64>, &mut [f64]) {
        (&mut self.double, &mut self.raw)
    }

    fn single(&mut self) -> (&mut TileScratch<f32>, &mut [f64]) {
        (&mut self.single, &mut self.raw)
    }
}

/// Fills tiles from the factors of the blocks: `factors` returns the factors of a block, `own` its scratch.
fn fill<S: Real>(
    tiles: &mut [&mut Tile],
    (blocks, scratch): (&[Block], &[Mutex<Scratch>]),
    (learner, terms): (&dyn Learner<f64>, &Terms),
    factors: impl Fn(&Block) -> &Factors<S> + Sync + Send,
    own: impl Fn(&mut Scratch) -> (&mut TileScratch<S>, &mut [f64]) + Sync + Send,
) {
    let net = learner.net();
    tiles.par_iter_mut().for_each(|tile| {
        let mine = lagrangian_motion::parallel::current_thread_index().unwrap_or(0) % scratch.len();
        let mut mine = scratch[mine].lock().unwrap_or_else(PoisonError::into_inner);
        let (scratch, raw) = own(&mut mine);
        let (left, right) = (&blocks[tile.row], &blocks[tile.column]);
        factors(left).tile(net, factors(right), terms, scratch, raw);
        tile_of_residuals(&left.work, &right.work, learner, raw, &mut tile.values);
    });
}
