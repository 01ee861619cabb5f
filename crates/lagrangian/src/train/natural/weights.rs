//! x = (J Jᵀ + λ N I)⁻¹ (r − μ J φ): the tiles of a batch become a system, its solution the weights of the residuals.

use super::block::{BLOCK, Block};
use super::system::System;
use super::tiles::{Tile, Tiles};

/// Replaces the right-hand side of each block by its part of x; `false` if the system is not positive definite.
pub(super) fn solve(
    system: &mut System,
    tiles: &Tiles,
    blocks: &mut [Block],
    (m, damping): (usize, f64),
) -> bool {
    let places = Places::of(tiles, blocks.len(), m);
    system.resize(places.rows.iter().flatten().count());
    tiles
        .of(blocks.len())
        .for_each(|tile| places.write(tile, system));
    for i in 0..system.matrix.nrows() {
        system.matrix[(i, i)] += damping * places.rows.len() as f64;
    }
    for (b, block) in blocks.iter().enumerate() {
        for (k, x) in block.right.iter().enumerate() {
            if let Some(row) = places.of_residual(b, k) {
                system.right[(row, 0)] = *x;
            }
        }
    }
    if system.matrix.nrows() > 0 && !system.solve() {
        return false;
    }
    for (b, block) in blocks.iter_mut().enumerate() {
        for (k, x) in block.right.iter_mut().enumerate() {
            let row = places.of_residual(b, k);
            *x = row.map_or(0.0, |row| system.right[(row, 0)]);
        }
    }
    blocks.iter().all(|b| b.right.iter().all(|x| x.is_finite()))
}

/// The row of each residual in the system; none for those that weigh nothing (of parameters, of padding), whose rows of
/// J Jᵀ are zeros.
struct Places {
    /// `[block, residual, sample]`.
    rows: Vec<Option<usize>>,
    m: usize,
}

impl Places {
    fn of(tiles: &Tiles, used: usize, m: usize) -> Self {
        let count = BLOCK * m;
        let mut rows = vec![None; used * count];
        for tile in tiles.of(used).filter(|tile| tile.row == tile.column) {
            for (i, row) in rows[tile.row * count..][..count].iter_mut().enumerate() {
                *row = (tile.values[i * count + i] != 0.0).then_some(0);
            }
        }
        for (place, row) in rows.iter_mut().flatten().enumerate() {
            *row = place;
        }
        Self { rows, m }
    }

    /// The rows of a block.
    fn of_block(&self, block: usize) -> &[Option<usize>] {
        let count = BLOCK * self.m;
        &self.rows[block * count..][..count]
    }

    /// The row of number `k` of a block, `[sample, residual]`.
    fn of_residual(&self, block: usize, k: usize) -> Option<usize> {
        self.of_block(block)[k % self.m * BLOCK + k / self.m]
    }

    fn write(&self, tile: &Tile, system: &mut System) {
        let rows = self.of_block(tile.row);
        for (column, place) in self.of_block(tile.column).iter().enumerate() {
            let Some(place) = *place else { continue };
            let target = system.matrix.col_as_slice_mut(place);
            for (values, row) in tile.values.chunks_exact(rows.len()).zip(rows) {
                if let Some(row) = *row {
                    target[row] = values[column];
                }
            }
        }
    }
}
