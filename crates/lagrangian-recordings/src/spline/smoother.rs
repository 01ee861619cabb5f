//! Motions that were recorded with white noise, as integrated Wiener processes whose intensity follows the motion.
//!
//! The noise is found by the evidence of short blocks, the order by that of a few pieces. Errors of samples as those before them predict them are then
//! white, if noise and motion are as assumed (Mehra, IEEE Trans. Automatic Control 15, 1970): what encoders, filters, vibration
//! or wrong time stamps did to a recording is refused by the test of Ljung and Box (Biometrika 65, 1978).

use super::noise::Noise;
use super::{Fitted, Motion, ORDERS, Piece, Scaled, few, parts};
use std::ops::Range;

use rayon::prelude::*;

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
fn adaptive(order: usize, piece: &Piece, sigma: f64, length: f64) -> Fitted {
    let log_w = 2.0 * sigma.ln() - (2 * order + 2) as f64 * length.ln();
    match order {
        2 => Fitted::adaptive::<3>(piece, log_w, length),
        3 => Fitted::adaptive::<4>(piece, log_w, length),
        4 => Fitted::adaptive::<5>(piece, log_w, length),
        _ => Fitted::adaptive::<6>(piece, log_w, length),
    }
}

/// Samples over which a process of this order averages: (σ²/w)^(1/(2p + 2)).
fn length(order: usize, sigma: f64, log_w: f64) -> f64 {
    ((2.0 * sigma.ln() - log_w) / (2 * order + 2) as f64).exp()
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
    /// The noise of values or rates.
    pub(super) fn noise(&self, column: &[f64], segments: &[Range<usize>]) -> Noise {
        let piece = |s: &Range<usize>| (self.steps(s, 1), column[s.clone()].to_vec());
        Noise::of(&segments.iter().map(piece).collect::<Vec<_>>())
    }

    /// The smoothed motion from values with this noise, unless the noise is not white or the rates contradict the values.
    pub(super) fn smoothed(&self, segments: &[Range<usize>], noise: Noise) -> Option<Motion> {
        let rates = self.rates.as_deref();
        let noise_of_rates = rates.map_or(1.0, |rates| self.noise(rates, segments).sigma);
        let sigma = noise.sigma;
        let piece = |s: &Range<usize>| self.piece(s, 1, [sigma, noise_of_rates]);
        let first = length(ORDER_OF_NOISE, sigma, noise.log_w);
        let pieces: Vec<Piece> = few(segments).iter().step_by(2).map(piece).collect();
        let of_order = |order: usize| -> (usize, Vec<Fitted>) {
            let fitted = pieces.par_iter().map(|p| adaptive(order, p, sigma, first));
            (order, fitted.collect())
        };
        let tried: Vec<(usize, Vec<Fitted>)> = ORDERS.into_par_iter().map(of_order).collect();
        let evidence = |fitted: &[Fitted]| fitted.iter().map(|f| f.evidence).sum::<f64>();
        let best = tried.into_iter();
        let best = best.max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)));
        let (order, _) = best.filter(|(_, fitted)| are_white(fitted))?;
        let parts: Vec<(Range<usize>, Range<usize>)> = segments.iter().flat_map(parts).collect();
        let smooth =
            |(_, around): &(Range<usize>, _)| adaptive(order, &piece(around), sigma, first);
        let fitted: Vec<Fitted> = parts.par_iter().map(smooth).collect();
        if !are_white(&fitted) {
            return None;
        }
        let log_w = fitted.iter().map(|f| f.log_w).sum::<f64>() / fitted.len() as f64;
        let length = length(order, sigma, log_w);
        let mut motion = self.motion(2 * (length.min(1e9) as usize).max(2) + 1, sigma);
        motion.exact = false;
        motion.with_rates = self.rates.is_some() && noise_of_rates * length < sigma;
        for ((own, around), fitted) in parts.iter().zip(&fitted) {
            let variance = |k: usize, order: usize| fitted.variances[k][order];
            self.write(&mut motion, own, around, &fitted.states, variance);
        }
        self.explains(&motion, segments, [sigma, noise_of_rates])
            .then_some(motion)
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
        let scaled = Scaled::new(&t, values, all, false);
        scaled.smoothed(all, scaled.noise(&scaled.values, all))
    }

    #[test]
    fn white_noise_is_smoothed_and_coloured_noise_refused() {
        let motion = smoothed(0.0, 1e-9).unwrap();
        assert!((0.009..0.011).contains(&motion.noise), "{}", motion.noise);
        assert!(smoothed(0.0, 0.01).is_some());
        for kept in [0.5, 0.9] {
            assert!(smoothed(kept, 1e-9).is_none(), "{kept}");
        }
        // Steps as of an encoder: what is left follows the motion.
        assert!(smoothed(0.0, 0.2).is_none());
    }
}
