//! A low-pass without phase: a fourth-order Butterworth filter, once forward and once back in time, so that signals keep
//! their times and motion and forces keep the same band of frequencies.
//!
//! |H(f)|² of both passes is 1 / (1 + (tan πfh / tan πf꜀h)⁸)², with the cut-off f꜀ and the step h. Uneven time stamps are
//! interpolated to an even grid and back.

use std::f64::consts::{PI, TAU};

use super::Recording;
use super::derivatives::GAP;
use super::local_polynomial::{median_step, segments};

/// The highest cut-off, as a fraction of the sampling rate: above it the derivatives of the filtered signal are inaccurate.
pub const HIGHEST: f64 = 0.35;
/// Weights of central differences of eighth order for the first derivative, from the centre outwards.
const FIRST: [f64; 5] = [0.0, 4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
/// Weights of central differences for the second derivative.
const SECOND: [f64; 5] = [
    -205.0 / 72.0,
    8.0 / 5.0,
    -1.0 / 5.0,
    8.0 / 315.0,
    -1.0 / 560.0,
];
/// What a low-pass leaves of a change of sign at time 0 is about tanh(t / T), where T is this part of the period of its cut-off: in
/// forces of simulated arms with weak to strong dry friction, values of 0.13 … 0.18 tell friction about as well as filtered signs do.
const SPREADING: f64 = 0.155;
/// Candidates within a decade, Hz.
const DECADE: [f64; 6] = [8.0, 5.0, 3.0, 2.0, 1.5, 1.0];
/// The number of candidates.
const CANDIDATES: usize = 10;
/// Highest candidate, Hz, and as a fraction of the sampling rate.
const HIGHEST_CANDIDATE: f64 = 50.0;
const OF_RATE: f64 = 0.3;
/// Number of periods of the lowest candidate in the longest piece of a recording.
const PERIODS: f64 = 10.0;
/// Time stamps within this part of a step are on the grid.
const EVEN: f64 = 1e-3;
/// Stamps nearer to each other than this part of a step are interpolated linearly, because a cubic would amplify noise.
const CLOSE: f64 = 0.3;

/// A low-pass for the samples of one piece of a recording.
#[derive(Debug, Clone)]
pub struct LowPass {
    cutoff: f64,
    /// Time stamps of the samples, s.
    t: Vec<f64>,
    /// Points and step of the even grid.
    points: usize,
    step: f64,
    even: bool,
}

/// A filtered signal at the samples.
#[derive(Debug, Clone)]
pub struct Filtered {
    /// The signal.
    pub value: Vec<f64>,
    /// Its first derivative.
    pub first: Vec<f64>,
    /// Its second derivative.
    pub second: Vec<f64>,
}

/// One section of second order, in the transposed direct form.
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Section {
    /// The two sections of a fourth-order Butterworth filter, by the bilinear transform.
    fn both(cutoff: f64, step: f64) -> [Self; 2] {
        [PI / 8.0, 3.0 * PI / 8.0].map(|angle: f64| {
            let frequency = TAU * cutoff * step;
            let (sine, cosine) = frequency.sin_cos();
            let alpha = sine * angle.cos();
            let scale = 1.0 / (1.0 + alpha);
            let gain = 0.5 * (1.0 - cosine) * scale;
            Self {
                b: [gain, 2.0 * gain, gain],
                a: [-2.0 * cosine * scale, (1.0 - alpha) * scale],
            }
        })
    }

    fn apply(&self, y: &mut [f64]) {
        let (mut s1, mut s2) = (0.0, 0.0);
        for y in y {
            let x = *y;
            *y = self.b[0] * x + s1;
            s1 = self.b[1] * x - self.a[0] * *y + s2;
            s2 = self.b[2] * x - self.a[1] * *y;
        }
    }
}

impl LowPass {
    /// A filter with this cut-off, Hz, for samples at two or more increasing times `t`, s.
    pub fn new(cutoff: f64, t: &[f64]) -> Self {
        let (begin, end) = (t[0], t[t.len() - 1]);
        let steps = ((end - begin) / median_step(t)).round().max(1.0);
        // The factor bounds the number of points: a piece has no gaps.
        let points = (steps as usize + 1).min(8 * t.len());
        let step = (end - begin) / (points - 1).max(1) as f64;
        let on_grid = |(k, t): (usize, &f64)| (t - begin - k as f64 * step).abs() < EVEN * step;
        Self {
            cutoff,
            even: points == t.len() && t.iter().enumerate().all(on_grid),
            t: t.to_vec(),
            points,
            step,
        }
    }

    /// The cut-off, Hz.
    pub(crate) fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// Number of samples at either end that must not be used: there the filter depends on the extrapolated signal.
    pub(crate) fn margin(cutoff: f64, step: f64) -> usize {
        ((0.5 / (cutoff * step)).ceil() as usize).max(FIRST.len())
    }

    /// The standard deviations of the filtered signal and of its derivatives, where the samples have white noise of
    /// deviation 1.
    pub(crate) fn noise(cutoff: f64, step: f64) -> [f64; 3] {
        let power = |order: i32| {
            2.0 * step * TAU.powi(2 * order) * cutoff.powi(2 * order + 1) / f64::from(2 * order + 1)
        };
        [power(0), power(1), power(2)].map(f64::sqrt)
    }

    /// Filters the signal `y` of the samples.
    pub fn apply(&self, y: &[f64]) -> Filtered {
        let value = self.smooth(match self.even {
            true => y.to_vec(),
            false => (0..self.points).map(|k| self.at_point(y, k)).collect(),
        });
        let h = self.step;
        let first = difference(&value, &FIRST, -1.0, h);
        let second = difference(&value, &SECOND, 1.0, h * h);
        let back = |y: Vec<f64>| match self.even {
            true => y,
            false => self.t.iter().map(|&t| self.at_time(&y, t)).collect(),
        };
        Filtered {
            value: back(value),
            first: back(first),
            second: back(second),
        }
    }

    /// Filters forward and back; the signal is continued at both ends by its point reflection.
    fn smooth(&self, y: Vec<f64>) -> Vec<f64> {
        let pad = ((3.0 / (self.cutoff * self.step)).ceil() as usize).min(y.len() - 1);
        let (first, last) = (y[0], y[y.len() - 1]);
        let head = (1..=pad).rev().map(|k| 2.0 * first - y[k]);
        let tail = (1..=pad).map(|k| 2.0 * last - y[y.len() - 1 - k]);
        let mut all: Vec<f64> = head.chain(y.iter().copied()).chain(tail).collect();
        let sections = Section::both(self.cutoff, self.step);
        for _ in 0..2 {
            // A filter at rest passes a signal that starts at 0 without a transient.
            let base = all[0];
            all.iter_mut().for_each(|x| *x -= base);
            sections.iter().for_each(|s| s.apply(&mut all));
            all.iter_mut().for_each(|x| *x += base);
            all.reverse();
        }
        all[pad..pad + y.len()].to_vec()
    }

    /// The signal, interpolated at point `k` of the grid.
    fn at_point(&self, y: &[f64], k: usize) -> f64 {
        let at = self.t[0] + k as f64 * self.step;
        let after = self.t.partition_point(|t| *t < at);
        let after = after.clamp(1, self.t.len() - 1);
        let four = after.saturating_sub(2)..(after + 2).min(self.t.len());
        let near = &self.t[four.clone()];
        let spread = near.windows(2).all(|w| w[1] - w[0] > CLOSE * self.step);
        match spread && near.len() == 4 {
            true => lagrange(near, &y[four], at),
            false => lagrange(&self.t[after - 1..=after], &y[after - 1..=after], at),
        }
    }

    /// The grid, interpolated at time `t`.
    fn at_time(&self, y: &[f64], t: f64) -> f64 {
        let place = (t - self.t[0]) / self.step;
        let first = (place as usize)
            .saturating_sub(1)
            .min(y.len().saturating_sub(4));
        let own = &y[first..(first + 4).min(y.len())];
        let times: Vec<f64> = (0..own.len()).map(|k| (first + k) as f64).collect();
        lagrange(&times, own, place)
    }
}

/// Cut-offs to choose from for these recordings, Hz, increasing.
pub fn candidates<'a>(
    recordings: impl IntoIterator<Item = &'a Recording, IntoIter: Clone>,
) -> Vec<f64> {
    let recordings = recordings.into_iter();
    let steps = recordings.clone().map(|r| median_step(&r.t));
    let step = steps.fold(0.0, f64::max);
    let pieces = recordings.flat_map(|r| {
        let pieces = segments(&r.t, GAP).into_iter();
        pieces.map(|s| r.t[s.end - 1] - r.t[s.start])
    });
    let longest = pieces.fold(0.0, f64::max);
    let allowed = PERIODS / longest..=HIGHEST_CANDIDATE.min(OF_RATE / step);
    let decades = (-3..=1).rev().map(|power| 10.0_f64.powi(power));
    let all = decades.flat_map(|decade| DECADE.map(|x| x * decade));
    let all = all.filter(|hertz| allowed.contains(hertz));
    let mut chosen: Vec<f64> = all.take(CANDIDATES).collect();
    chosen.reverse();
    chosen
}

/// The time T over which a low-pass with this cut-off, Hz, spreads a change of sign, s; 0 without one.
#[must_use]
pub fn spreading(cutoff: Option<f64>) -> f64 {
    cutoff.map_or(0.0, |cutoff| SPREADING / cutoff)
}

/// The value at `at` of the polynomial through the points `y` at distinct `t`.
#[must_use]
pub fn lagrange(t: &[f64], y: &[f64], at: f64) -> f64 {
    let weight = |k: usize| {
        let others = t.iter().enumerate().filter(|(j, _)| *j != k);
        others.fold(1.0, |w, (_, other)| w * (at - other) / (t[k] - other))
    };
    y.iter().enumerate().map(|(k, y)| weight(k) * y).sum()
}

/// Central differences over `scale`; `mirror` is −1 for an odd derivative. Points too near to the ends take the value
/// of the nearest other point.
fn difference(y: &[f64], weights: &[f64; 5], mirror: f64, scale: f64) -> Vec<f64> {
    let reach = weights.len() - 1;
    if y.len() <= 2 * reach {
        return vec![0.0; y.len()];
    }
    let at = |k: usize| {
        let k = k.clamp(reach, y.len() - 1 - reach);
        let sides = (1..=reach).map(|j| weights[j] * (y[k + j] + mirror * y[k - j]));
        (weights[0] * y[k] + sides.sum::<f64>()) / scale
    };
    (0..y.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(frequency: f64, t: &[f64]) -> Vec<f64> {
        t.iter().map(|t| (TAU * frequency * t).sin()).collect()
    }

    #[test]
    fn slow_signals_pass_with_their_derivatives_and_fast_ones_do_not() {
        let t: Vec<f64> = (0..2000).map(|k| 0.005 * f64::from(k)).collect();
        let filter = LowPass::new(8.0, &t);
        let (slow, fast) = (filter.apply(&sine(1.0, &t)), filter.apply(&sine(30.0, &t)));
        let half = filter.apply(&sine(8.0, &t));
        for (k, t) in t.iter().enumerate().take(1600).skip(400) {
            let (sine, cosine) = (TAU * t).sin_cos();
            assert!((slow.value[k] - sine).abs() < 1e-5);
            assert!((slow.first[k] - TAU * cosine).abs() < 1e-4);
            assert!((slow.second[k] + TAU * TAU * sine).abs() < 1e-3);
            assert!(fast.value[k].abs() < 1e-4);
            // Twice −3 dB at the cut-off, without delay.
            assert!((half.value[k] - 0.5 * (TAU * 8.0 * t).sin()).abs() < 1e-6);
        }
    }

    #[test]
    fn a_sign_becomes_as_wide_as_is_said() {
        let t: Vec<f64> = (0..2001).map(|k| 0.002 * f64::from(k)).collect();
        // The sign changes between two samples.
        let after = |t: f64| t - 2.001;
        let sign: Vec<f64> = t.iter().map(|t| after(*t).signum()).collect();
        for cutoff in [2.0, 8.0, 20.0] {
            let width = spreading(Some(cutoff));
            let left = LowPass::new(cutoff, &t).apply(&sign).value;
            let near = left
                .iter()
                .zip(&t)
                .filter(|(_, t)| after(**t).abs() < width);
            let error = |(left, t): (&f64, &f64)| (left - (after(*t) / width).tanh()).abs();
            assert!(near.map(error).fold(0.0, f64::max) < 0.2);
        }
        assert!(spreading(None) == 0.0);
    }

    #[test]
    fn uneven_time_stamps_are_taken_as_they_are() {
        let jitter = |k: i32| 0.01 * f64::from(k) + 0.003 * f64::from(k * 7919 % 101) / 101.0;
        let t: Vec<f64> = (0..1000).map(jitter).collect();
        let own = LowPass::new(10.0, &t).apply(&sine(1.0, &t));
        for (k, t) in t.iter().enumerate().take(900).skip(100) {
            let (sine, cosine) = (TAU * t).sin_cos();
            assert!((own.value[k] - sine).abs() < 1e-4);
            assert!((own.first[k] - TAU * cosine).abs() < 1e-2);
            assert!((own.second[k] + TAU * TAU * sine).abs() < 0.3);
        }
    }

    #[test]
    fn white_noise_is_damped_as_predicted() {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let t: Vec<f64> = (0..20_000).map(|k| 0.002 * f64::from(k)).collect();
        let noise: Vec<f64> = t.iter().map(|_| rng.random::<f64>() - 0.5).collect();
        let own = LowPass::new(10.0, &t).apply(&noise);
        let deviation = |y: &[f64]| (y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64).sqrt();
        let expected = LowPass::noise(10.0, 0.002).map(|x| x / 12.0_f64.sqrt());
        let found = [own.value, own.first, own.second].map(|y| deviation(&y));
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 0.25, "{found} {expected}");
        }
    }
}
