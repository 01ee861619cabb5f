//! From products of raw outputs to products of residuals.

use super::block::BLOCK;
use crate::train::learner::{Learner, Work};

/// K = D (S-space tile + extra parameters) D'ᵀ (theory.md, section 7), rows and columns i · samples + s.
pub(super) fn tile_of_residuals(
    left: &Work<f64>,
    right: &Work<f64>,
    learner: &dyn Learner<f64>,
    raw: &mut [f64],
    out: &mut [f64],
) {
    add_extra(left, right, learner, raw);
    let (m, k) = (
        left.linear.residual.len() / BLOCK,
        left.linear.along.len() / BLOCK,
    );
    let raw_size = k * BLOCK;
    out.fill(0.0);
    let mut between = [0.0; BLOCK];
    for s in 0..BLOCK {
        for (i, l) in (0..m).flat_map(|i| (0..k).map(move |l| (i, l))) {
            // Sum over the outputs of the left sample, then over those of the right ones.
            between.fill(0.0);
            for (c, d) in left.linear.d[(s * m + i) * k..][..k].iter().enumerate() {
                let source = &raw[(c * BLOCK + s) * raw_size + l * BLOCK..][..BLOCK];
                if *d != 0.0 {
                    between
                        .iter_mut()
                        .zip(source)
                        .for_each(|(x, y)| *x += d * y);
                }
            }
            for j in 0..m {
                let target = &mut out[(i * BLOCK + s) * m * BLOCK + j * BLOCK..][..BLOCK];
                for (t, (x, y)) in target.iter_mut().zip(&between).enumerate() {
                    *x += y * right.linear.d[(t * m + j) * k + l];
                }
            }
        }
    }
}

/// Adds the products of the slopes along parameters beside the network, which couple outputs of one coordinate.
fn add_extra(left: &Work<f64>, right: &Work<f64>, learner: &dyn Learner<f64>, raw: &mut [f64]) {
    let force_terms = learner.extra();
    let same = |i: usize, j: usize| learner.coordinate(i) == learner.coordinate(j);
    let k = left.linear.along.len() / BLOCK;
    for (i, j) in pairs(k).filter(|(i, j)| force_terms > 0 && same(*i, *j)) {
        for s in 0..BLOCK {
            let row = &mut raw[(i * BLOCK + s) * k * BLOCK + j * BLOCK..][..BLOCK];
            for e in 0..force_terms {
                let slope = left.linear.extra[(s * k + i) * force_terms + e];
                for (t, x) in row.iter_mut().enumerate() {
                    *x += slope * right.linear.extra[(t * k + j) * force_terms + e];
                }
            }
        }
    }
}

/// All pairs of numbers below `k`.
fn pairs(k: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..k).flat_map(move |i| (0..k).map(move |j| (i, j)))
}
