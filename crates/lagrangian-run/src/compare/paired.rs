//! Paired differences: the difference of the errors of two models on the same blocks of motion, and its confidence
//! interval.

use std::ops::Range;

use serde::Serialize;

/// Number of blocks that motions are cut into, if there are fewer motions …
const BLOCKS: usize = 10;
/// … and the shortest block, in samples: neighbouring samples have similar errors.
const SHORTEST: usize = 20;

/// The 97.5 % quantiles of Student's distribution for 1 to 30 degrees of freedom.
const STUDENT: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
];

/// A figure in blocks of the motions: its mean in each, and the weight of each.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Blocked {
    pub(super) means: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

impl Blocked {
    /// A figure of each motion, where all motions count equally.
    pub(super) fn of_motions(means: Vec<f64>) -> Self {
        let weights = vec![1.0; means.len()];
        Self { means, weights }
    }

    /// The mean over all blocks.
    pub(super) fn mean(&self) -> f64 {
        weighted(&self.means, &self.weights)
    }
}

/// The conclusion from a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Finding {
    /// The later model is better.
    Better,
    /// The later model is worse.
    Worse,
    /// The difference is within its spread: the data do not distinguish the models.
    Within,
    /// There are too few blocks for a spread.
    Unknown,
}

/// The difference of a figure of one model from that of the first, on the same blocks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The mean of the difference.
    pub mean: f64,
    /// The ends of the interval that holds the true difference with 95 %; not finite for a single block.
    pub range: (f64, f64),
    /// The number of blocks.
    pub blocks: usize,
    /// The conclusion from the difference.
    pub finding: Finding,
}

/// The direction that is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Best {
    Least,
    Most,
}

impl Difference {
    /// The mean of the differences d of the blocks, with weights w, and its interval by Student's distribution:
    ///
    ///   d̄ = Σ w d / Σ w,   s² = B / (B − 1) Σ (w / Σ w)² (d − d̄)²
    ///
    /// (Cochran, Sampling Techniques, 1977, equation 6.13, for B blocks of unequal size).
    pub(super) fn of(first: &Blocked, other: &Blocked, best: Best) -> Self {
        let pairs = first.means.iter().zip(&other.means);
        let each: Vec<f64> = pairs.map(|(a, b)| b - a).collect();
        let mean = weighted(&each, &first.weights);
        let (all, blocks) = (first.weights.iter().sum::<f64>(), each.len());
        let square = |(d, w): (&f64, &f64)| (w / all * (d - mean)).powi(2);
        let squares: f64 = each.iter().zip(&first.weights).map(square).sum();
        let half = match blocks {
            0 | 1 => f64::NAN,
            _ => student(blocks - 1) * (squares * blocks as f64 / (blocks - 1) as f64).sqrt(),
        };
        let range = (mean - half, mean + half);
        Self {
            finding: finding(mean, range, best),
            mean,
            range,
            blocks,
        }
    }
}

fn finding(mean: f64, (low, high): (f64, f64), best: Best) -> Finding {
    let least = best == Best::Least;
    match (low, high) {
        _ if mean == 0.0 => Finding::Within,
        (low, high) if low.is_nan() || high.is_nan() => Finding::Unknown,
        (low, high) if low <= 0.0 && high >= 0.0 => Finding::Within,
        (_, high) if (high < 0.0) == least => Finding::Better,
        _ => Finding::Worse,
    }
}

/// The quantile for a number of degrees of freedom; beyond the table by its expansion to first order.
fn student(freedom: usize) -> f64 {
    let tabled = freedom.checked_sub(1).and_then(|k| STUDENT.get(k));
    tabled.copied().unwrap_or(1.96 + 2.37 / freedom as f64)
}

fn weighted(values: &[f64], weights: &[f64]) -> f64 {
    let sum: f64 = values.iter().zip(weights).map(|(x, w)| w * x).sum();
    sum / weights.iter().sum::<f64>()
}

/// The blocks of a motion of `len` samples among `motions` of them.
pub(super) fn blocks(len: usize, motions: usize) -> Vec<Range<usize>> {
    let count = BLOCKS.div_ceil(motions.max(1)).min(len / SHORTEST).max(1);
    let end = |k: usize| k * len / count;
    (0..count).map(|k| end(k)..end(k + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocked(means: &[f64]) -> Blocked {
        Blocked::of_motions(means.to_vec())
    }

    #[test]
    fn a_difference_of_equal_blocks_has_the_interval_of_students_test() {
        // Student's own data (Biometrika 6, 1908): additional hours of sleep by two drugs.
        let a = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
        let b = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        let found = Difference::of(&blocked(&a), &blocked(&b), Best::Most);
        assert!((found.mean - 1.58).abs() < 1e-12);
        let (low, high) = found.range;
        assert!(
            (low - 0.700).abs() < 1e-3 && (high - 2.460).abs() < 1e-3,
            "{found:?}"
        );
        assert_eq!(found.finding, Finding::Better);
        let less = Difference::of(&blocked(&a), &blocked(&b), Best::Least);
        assert_eq!(less.finding, Finding::Worse);
    }

    #[test]
    fn a_difference_that_changes_its_sign_is_within_its_spread() {
        let (a, b) = (blocked(&[1.0, 2.0, 3.0]), blocked(&[2.0, 1.0, 3.5]));
        assert_eq!(Difference::of(&a, &b, Best::Least).finding, Finding::Within);
        assert_eq!(Difference::of(&a, &a, Best::Least).finding, Finding::Within);
    }

    #[test]
    fn one_block_tells_no_spread_and_no_finding() {
        let found = Difference::of(&blocked(&[1.0]), &blocked(&[2.0]), Best::Least);
        assert_eq!(found.finding, Finding::Unknown);
    }

    #[test]
    fn blocks_hold_every_sample_once_and_are_not_too_short() {
        for (len, motions, count) in [
            (1000, 1, 10),
            (1000, 4, 3),
            (1000, 40, 1),
            (50, 1, 2),
            (5, 1, 1),
        ] {
            let all = blocks(len, motions);
            assert_eq!(all.len(), count, "{len} {motions}");
            assert_eq!(all.iter().map(Range::len).sum::<usize>(), len);
            assert!(all.windows(2).all(|pair| pair[0].end == pair[1].start));
        }
    }
}
