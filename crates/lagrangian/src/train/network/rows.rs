//! The rows of the residuals of a batch in its system.

use super::block::BLOCK;
use super::tiles::{Tile, Tiles};
use crate::train::System;

/// The row of each residual in the system; `None` for residuals without weight (of parameters, of padding), whose rows of
/// J Jᵀ are zero.
#[derive(Default)]
pub(super) struct Rows {
    /// `[block, residual, sample]`.
    rows: Vec<Option<usize>>,
    /// The number of residuals of a sample.
    m: usize,
}

impl Rows {
    /// The rows of the first `used` blocks, of `m` residuals a sample.
    pub(super) fn of(tiles: &Tiles, used: usize, m: usize) -> Self {
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

    /// The number of residuals with a row.
    pub(super) fn count(&self) -> usize {
        self.rows.iter().flatten().count()
    }

    /// The number of all residuals.
    pub(super) fn all(&self) -> usize {
        self.rows.len()
    }

    /// The rows of a block.
    fn of_block(&self, block: usize) -> &[Option<usize>] {
        let count = BLOCK * self.m;
        &self.rows[block * count..][..count]
    }

    /// The row of residual `k` of a block, `[sample, residual]`.
    pub(super) fn of_residual(&self, block: usize, k: usize) -> Option<usize> {
        self.of_block(block)[k % self.m * BLOCK + k / self.m]
    }

    /// Writes a tile of J Jᵀ.
    pub(super) fn write(&self, tile: &Tile, system: &mut System) {
        let rows = self.of_block(tile.row);
        for (column, place) in self.of_block(tile.column).iter().enumerate() {
            let Some(place) = *place else { continue };
            let target = system.column_mut(place);
            for (values, row) in tile.values.chunks_exact(rows.len()).zip(rows) {
                if let Some(row) = *row {
                    target[row] = values[column];
                }
            }
        }
    }
}
