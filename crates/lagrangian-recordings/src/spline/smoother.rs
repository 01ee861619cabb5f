//! Motions that were recorded with noise, white or with a memory, as integrated Wiener processes whose intensity follows the motion.
//!
//! The noise is found by the evidence of blocks, the order by that of a few pieces. Errors of samples as those before them predict them are then
//! white, if noise and motion are as assumed (Mehra, IEEE Trans. Automatic Control 15, 1970): what encoders, vibration
//! or wrong time stamps did to a recording is refused by the test of Ljung and Box (Biometrika 65, 1978).

use super::noise::{FOUND, Noise};
use super::{Fitted, Motion, ORDERS, Piece, Scaled, few, parts};
use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;

/// The order of the process in which noise is found.
pub(super) const ORDER_OF_NOISE: usize = 3;
/// Autocorrelations of the innovations that are tested, and the value that their statistic exceeds once in a thousand recordings
/// with white noise: the quantile of χ² with as many degrees of freedom.
const LAGS: usize = 6;
const WHITE: f64 = 22.458;
/// Innovations of a piece until the state is known.
const UNKNOWN: usize = 8;
/// Rates contradict the values where the residuals of either have more than this factor over their variance.
const CONTRADICTING: f64 = 2.0;

/// Smooths with an intensity that follows the motion, which averages over `length` samples at first.
fn adaptive(order: usize, piece: &Piece, noise: Noise, length: f64) -> Fitted {
    let log_w = 2.0 * noise.slow().ln() - (2 * order + 2) as f64 * length.ln();
    match order {
        2 => Fitted::adaptive::<3>(piece, log_w, length),
        3 => Fitted::adaptive::<4>(piece, log_w, length),
        4 => Fitted::adaptive::<5>(piece, log_w, length),
        _ => Fitted::adaptive::<6>(piece, log_w, length),
    }
}

/// Samples over which a process of this order averages: (σ²/w)^(1/(2p + 2)).
fn length(order: usize, noise: Noise, log_w: f64) -> f64 {
    ((2.0 * noise.slow().ln() - log_w) / (2 * order + 2) as f64).exp()
}

/// Whether the innovations of all pieces are white.
fn are_white(pieces: &[Fitted]) -> bool {
    let pieces = || pieces.iter().map(|piece| &piece.innovations[UNKNOWN..]);
    let power: f64 = pieces().flatten().map(|e| e * e).sum();
    let count: usize = pieces().map(<[f64]>::len).sum();
    let correlation = |lag: usize| {
        let products = pieces().flat_map(|e| e.windows(lag + 1).map(|w| w[0] * w[lag]));
        products.sum::<f64>() / power
    };
    let sum: f64 = (1..=LAGS).map(|lag| correlation(lag).powi(2)).sum();
    count as f64 * sum < WHITE
}

impl Scaled<'_> {
    /// Lengths of steps and values of each segment of a column.
    fn column(&self, column: &[f64], segments: &[Range<usize>]) -> Vec<(Vec<f64>, Vec<f64>)> {
        let piece = |s: &Range<usize>| (self.steps(s, 1), column[s.clone()].to_vec());
        segments.iter().map(piece).collect()
    }

    /// The smoothed motion from values with white noise, and rates if they do not contradict them; or from values whose noise has
    /// a memory, where that explains them better. `None` where neither explains them.
    pub(super) fn smoothed(&mut self, segments: &[Range<usize>]) -> Option<Motion> {
        let columns = self.column(&self.values, segments);
        let white = Noise::white(&columns);
        let mut first = self.with(segments, white);
        if first.is_none() && self.rates.take().is_some() {
            first = self.with(segments, white);
        }
        let known = self.rates.is_some() && first.is_some();
        let coloured = (!known).then(|| Noise::coloured(&columns, first.is_none()));
        let second = coloured.flatten();
        let second = second.and_then(|noise| self.with(segments, noise));
        let is_better = |(own, _): &(f64, Motion)| {
            let first = first.as_ref();
            first.is_none_or(|(first, _)| *own > first + FOUND)
        };
        let best = second.filter(is_better).or(first);
        best.map(|(_, motion)| motion)
    }

    /// The motion from values with this noise and the logarithm of its evidence, unless the innovations are not white or the rates
    /// contradict the values.
    fn with(&self, segments: &[Range<usize>], noise: Noise) -> Option<(f64, Motion)> {
        let (rates, sigma) = (self.rates.as_deref(), noise.sigma);
        let of_rates = |rates: &[f64]| Noise::white(&self.column(rates, segments)).sigma;
        let noise_of_rates = rates.map_or(1.0, of_rates);
        let piece = |s: &Range<usize>| Piece {
            memory: noise.memory,
            ..self.piece(s, 1, [sigma, noise_of_rates])
        };
        let first = length(ORDER_OF_NOISE, noise, noise.log_w);
        let pieces: Vec<Piece> = few(segments).iter().step_by(2).map(piece).collect();
        let of_order = |order: usize| -> (usize, Vec<Fitted>) {
            let fitted = pieces.par_iter().map(|p| adaptive(order, p, noise, first));
            (order, fitted.collect())
        };
        let tried: Vec<(usize, Vec<Fitted>)> = ORDERS.into_par_iter().map(of_order).collect();
        let evidence = |fitted: &[Fitted]| fitted.iter().map(|f| f.evidence).sum::<f64>();
        let all = tried.into_iter().map(|own| (evidence(&own.1), own));
        let best = all.max_by(|a, b| a.0.total_cmp(&b.0));
        let (evidence, (order, _)) = best.filter(|(_, (_, fitted))| are_white(fitted))?;
        let parts: Vec<(Range<usize>, Range<usize>)> = segments.iter().flat_map(parts).collect();
        let smooth =
            |(_, around): &(Range<usize>, _)| adaptive(order, &piece(around), noise, first);
        let fitted: Vec<Fitted> = parts.par_iter().map(smooth).collect();
        if !are_white(&fitted) {
            return None;
        }
        let log_w = fitted.iter().map(|f| f.log_w).sum::<f64>() / fitted.len() as f64;
        let length = length(order, noise, log_w);
        let mut motion = self.motion(2 * (length.min(1e9) as usize).max(2) + 1, sigma);
        motion.exact = false;
        motion.with_rates = self.rates.is_some() && noise_of_rates * length < sigma;
        for ((own, around), fitted) in parts.iter().zip(&fitted) {
            let variance = |k: usize, order: usize| fitted.variances[k][order];
            self.write(&mut motion, own, around, &fitted.states, variance);
        }
        self.explains(&motion, segments, [sigma, noise_of_rates])
            .then_some((evidence, motion))
    }

    /// Whether values and rates have the residuals that their noise explains.
    fn explains(&self, motion: &Motion, segments: &[Range<usize>], noise: [f64; 2]) -> bool {
        let Some(rates) = &self.rates else {
            return true;
        };
        let (mut sums, mut count) = ([0.0; 2], 0.0);
        for k in segments.iter().flat_map(Clone::clone) {
            let [q, qd, _] = motion.states[k].map(|x| x / self.scale);
            sums[0] += ((self.values[k] - q) / noise[0]).powi(2);
            sums[1] += ((rates[k] - qd * self.step) / noise[1]).powi(2);
            count += 1.0;
        }
        sums.iter().all(|sum| *sum <= CONTRADICTING * count)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// A swing at 100 Hz with noise of 0.01, of which a part `kept` stays from sample to sample, rounded to `quantum`.
    fn smoothed(kept: f64, quantum: f64) -> Option<Motion> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let t: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
        let mut noise = 0.0;
        let mut value = |t: &f64| {
            let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            noise = kept * noise + (1.0 - kept * kept).sqrt() * normal;
            (((3.0 * t).sin() + 0.01 * noise) / quantum).round() * quantum
        };
        let values: Vec<f64> = t.iter().map(&mut value).collect();
        let all = std::slice::from_ref(&(0..1000));
        Scaled::new(&t, values, all, false).smoothed(all)
    }

    /// Root mean squares of the true and the claimed error of the accelerations.
    fn errors(motion: &Motion) -> [f64; 2] {
        let truth = |k: usize| -9.0 * (0.03 * k as f64).sin();
        let states = motion.states.iter().enumerate();
        let squares = states.map(|(k, state)| (state[2] - truth(k)).powi(2));
        let claims = motion.errors.iter().map(|error| error[2] * error[2]);
        let root = |sum: f64| (sum / motion.states.len() as f64).sqrt();
        [root(squares.sum()), root(claims.sum())]
    }

    #[test]
    fn noise_is_smoothed_that_is_white_or_has_a_memory() {
        let motion = smoothed(0.0, 1e-9).unwrap();
        assert!((0.009..0.011).contains(&motion.noise), "{}", motion.noise);
        assert!(smoothed(0.0, 0.01).is_some());
        for kept in [0.5, 0.8, 0.9] {
            let motion = smoothed(kept, 1e-9).unwrap();
            assert!(
                (0.006..0.016).contains(&motion.noise),
                "{kept} {}",
                motion.noise
            );
            let [error, claimed] = errors(&motion);
            assert!(
                error < 1.0 && (0.4..2.5).contains(&(claimed / error)),
                "{kept} {error} {claimed}"
            );
        }
        // Steps as of an encoder: what is left follows the motion.
        assert!(smoothed(0.0, 0.2).is_none());
    }
}
