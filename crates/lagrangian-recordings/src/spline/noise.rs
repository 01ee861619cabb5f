//! The noise of a column, from the evidence of short blocks, each with an intensity of its own.

use std::f64::consts::LN_10;

use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::sort_numbers;

use super::process::{Observation, Problem, Process};
use super::smoother::ORDER_OF_NOISE;

/// Samples of a block, in which the intensity hardly changes, and the most blocks that are looked at: for white noise, and for
/// correlated noise, which is told from the motion over longer times only.
const BLOCK: [usize; 2] = [32, 128];
const BLOCKS: [usize; 2] = [120, 12];
/// Correlations of successive values that are tried.
const MEMORIES: [f64; 7] = [0.3, 0.5, 0.65, 0.8, 0.88, 0.93, 0.96];
/// A memory is found where it adds this much to ln p.
pub(super) const FOUND: f64 = 6.0;
/// ln(σ²/w) of the smoothers that are tried: from one that interpolates to one that fits a single polynomial.
const LOWEST: f64 = -8.0 * LN_10;
const RATIOS: usize = 45;
const RATIO: f64 = 0.5 * LN_10;
/// Ratios below those, where all follows from the first: squared residuals are proportional to the ratio.
const BELOW: usize = 80;
/// Step of ln σ.
const STEP: f64 = 0.1;

/// Noise of a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Its standard deviation.
    pub(super) sigma: f64,
    /// ln of the mean intensity at [`ORDER_OF_NOISE`].
    pub(super) log_w: f64,
    /// Correlation of the noise of two values that are one median step apart.
    pub(super) memory: f64,
    /// ln p of the blocks.
    evidence: f64,
}

/// Squared residuals and the rest of ln p for σ = 1, at each ratio.
struct Block {
    parts: Vec<(f64, f64)>,
    /// Samples less unknowns.
    freedom: f64,
}

impl Block {
    fn new(steps: &[f64], y: &[f64], memory: f64) -> Self {
        let process = Process::<{ ORDER_OF_NOISE + 1 }>::new();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let value = |y: &f64| Observation {
            value: Some((y - mean, 1.0)),
            rate: None,
        };
        let observations: Vec<Observation> = y.iter().map(value).collect();
        let problem = Problem {
            steps,
            observations: &observations,
            memory,
        };
        let part = |k| problem.forward(&process, |_| -ratio(k), false).parts();
        Self {
            parts: (0..RATIOS).map(part).collect(),
            freedom: (y.len() - ORDER_OF_NOISE - 1) as f64,
        }
    }

    /// ln p of the block and ln w for each ratio.
    fn terms(&self, log_sigma: f64) -> Vec<(f64, f64)> {
        let precision = 0.5 * (-2.0 * log_sigma).exp();
        let term = |squares: f64, rest: f64, ratio: f64| {
            let log_p = rest - squares * precision - self.freedom * log_sigma;
            (log_p, 2.0 * log_sigma - ratio)
        };
        let tried = (self.parts.iter().enumerate()).map(|(k, (s, rest))| term(*s, *rest, ratio(k)));
        let (first, rest) = self.parts[0];
        let below = (1..=BELOW).map(|k| {
            let change = -RATIO * k as f64;
            let rest = rest + 0.5 * self.freedom * change;
            term(first * change.exp(), rest, LOWEST + change)
        });
        tried.chain(below).collect()
    }
}

fn ratio(k: usize) -> f64 {
    LOWEST + RATIO * k as f64
}

/// ln Σ eˣ.
fn log_sum(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = x.clone().fold(f64::NEG_INFINITY, f64::max);
    largest + x.map(|x| (x - largest).exp()).sum::<f64>().ln()
}

impl Noise {
    /// White noise.
    pub(super) fn white(pieces: &[(Vec<f64>, Vec<f64>)]) -> Self {
        Self::of(pieces, 0.0, false)
    }

    /// The noise with a memory that explains the pieces best, where it explains them better than white noise or that `fails`.
    pub(super) fn coloured(pieces: &[(Vec<f64>, Vec<f64>)], fails: bool) -> Option<Self> {
        let of = |memory: &f64| Self::of(pieces, *memory, true);
        let white = (!fails).then(|| of(&0.0).evidence);
        if white.is_some_and(|white| of(&MEMORIES[MEMORIES.len() / 2]).evidence < white) {
            return None;
        }
        let better = |a: &Self, b: &Self| a.evidence.total_cmp(&b.evidence);
        let best = MEMORIES.par_iter().map(of).max_by(better);
        best.filter(|best| white.is_none_or(|white| best.evidence > white + FOUND))
    }

    /// Deviation of white noise with the same power in slow motions.
    pub(super) fn slow(&self) -> f64 {
        self.sigma * ((1.0 + self.memory) / (1.0 - self.memory)).sqrt()
    }

    /// Noise of the pieces `(steps, values)` of a column, with this memory, from long blocks or short ones, not below that of its rounding.
    fn of(pieces: &[(Vec<f64>, Vec<f64>)], memory: f64, long: bool) -> Self {
        let (blocks, floor) = (blocks(pieces, memory, long), floor(pieces));
        let residual = |block: &Block| (block.parts[RATIOS - 1].0 / block.freedom).sqrt();
        let largest = blocks.iter().map(residual).fold(floor, f64::max);
        let count = ((largest / floor).ln() / STEP).ceil() as usize;
        let log_sigma = |k: usize| floor.ln() + STEP * k as f64;
        let log_p = |k: usize| -> f64 {
            let of_block = |block: &Block| {
                let terms = block.terms(log_sigma(k));
                log_sum(terms.iter().map(|t| t.0))
            };
            blocks.iter().map(of_block).sum()
        };
        let curve: Vec<f64> = (0..=count).map(log_p).collect();
        let best = (0..=count).max_by(|a, b| curve[*a].total_cmp(&curve[*b]));
        let best = best.unwrap_or(0);
        let log_sigma = log_sigma(best);
        Self {
            memory,
            evidence: curve[best],
            sigma: log_sigma.exp(),
            log_w: mean_intensity(&blocks, log_sigma),
        }
    }
}

/// Blocks that are spread evenly over the pieces.
fn blocks(pieces: &[(Vec<f64>, Vec<f64>)], memory: f64, long: bool) -> Vec<Block> {
    let [length, most] = [BLOCK, BLOCKS].map(|own| own[usize::from(long)]);
    let mut places = Vec::new();
    for (piece, (_, y)) in pieces.iter().enumerate() {
        let count = (y.len() / length).max(1);
        let end = |b: usize| if b == count { y.len() } else { b * length };
        places.extend((0..count).map(|b| (piece, b * length..end(b + 1))));
    }
    let stride = places.len().div_ceil(most).max(1);
    let block = |(piece, range): &(usize, std::ops::Range<usize>)| {
        let (steps, y) = &pieces[*piece];
        Block::new(
            &steps[range.start..range.end - 1],
            &y[range.clone()],
            memory,
        )
    };
    places.iter().step_by(stride).map(block).collect()
}

/// ln of the intensity, averaged over what is known of each block and over the blocks.
fn mean_intensity(blocks: &[Block], log_sigma: f64) -> f64 {
    let of_block = |block: &Block| {
        let terms = block.terms(log_sigma);
        let total = log_sum(terms.iter().map(|t| t.0));
        log_sum(terms.iter().map(|(log_p, log_w)| log_p - total + log_w))
    };
    let of_blocks: Vec<f64> = blocks.iter().map(of_block).collect();
    log_sum(of_blocks.iter().copied()) - (blocks.len() as f64).ln()
}

/// The least deviation of a column's noise: of its rounding, or of its quantum where values repeat.
fn floor(pieces: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let mut values: Vec<f64> = pieces.iter().flat_map(|(_, y)| y.iter().copied()).collect();
    let count = values.len();
    let largest = values.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let rounding = (largest * f64::EPSILON).max(1e-18);
    sort_numbers(&mut values);
    values.dedup();
    if values.len() * 20 > count * 19 {
        return rounding;
    }
    let steps = values.windows(2).map(|w| w[1] - w[0]);
    let quantum = steps.filter(|d| *d > 4.0 * rounding).reduce(f64::min);
    quantum.map_or(rounding, |quantum| quantum / 12.0_f64.sqrt())
}
