//! Motion from measured values: each coordinate and its derivatives with their standard errors.
//!
//! The coordinate is an integrated Wiener process ([`process`]) whose intensity follows the motion ([`intensity`]): smooth where it is slow, free where it
//! accelerates. The noise ([`noise`]), the order of the process and the change of its intensity are chosen by the evidence of
//! the data. Where the noise is far below what a sample tells beyond its neighbours, the values are interpolated instead.

mod intensity;
mod noise;
mod process;

use std::f64::consts::LN_10;
use std::ops::Range;

use rayon::prelude::*;

use super::local_polynomial::median_step;
use intensity::Fitted;
use noise::Noise;
use process::{Observation, Problem};

/// The order of the process in which noise is found.
const ORDER_OF_NOISE: usize = 3;
/// Orders of the process that are compared; all need one sample more than components of the state.
const ORDERS: [usize; 4] = [2, 3, 4, 5];
/// Deviations of ln w from knot to knot that are compared.
const WALKS: [f64; 3] = [0.5, 1.0, 2.0];
/// Samples of a piece that is smoothed at once, and samples beside it that it is smoothed with.
const PIECE: usize = 2048;
const BESIDE: usize = 512;
/// Number and length of the pieces on which the order is chosen.
const CHOOSING: usize = 6;
const CHOOSING_LENGTH: usize = 400;
/// Squared noise below this part of the squared error of a sample as its neighbours predict it is interpolated.
const NEGLIGIBLE: f64 = 0.05;
/// ln(w/σ²) at which the smoother interpolates.
const INTERPOLATING: f64 = 7.0 * LN_10;
/// Deviations of interpolated derivatives per deviation of the values, for even steps of length 1.
const AMPLIFIED: [f64; 3] = [1.0, 1.2, 3.5];
/// Rates whose residuals have more than this factor over their variance, or make the values' so, contradict the values.
const CONTRADICTING: f64 = 2.0;

/// A coordinate as it was measured.
pub(super) struct Measured<'a> {
    /// Time stamps, s, `[len]`.
    pub(super) t: &'a [f64],
    pub(super) value: Vec<f64>,
    /// Its rate, where that was measured too.
    pub(super) rate: Option<Vec<f64>>,
}

/// Values and their first two derivatives, `[len]`, with standard errors.
pub(super) struct Motion {
    pub(super) states: Vec<[f64; 3]>,
    pub(super) errors: Vec<[f64; 3]>,
    /// Standard deviation of the noise of the values.
    pub(super) noise: f64,
    /// Samples over which the smoother averages.
    pub(super) window: usize,
    /// Whether the measured rates tell more than the values.
    pub(super) with_rate: bool,
}

impl Motion {
    /// Standard errors of the derivative of this order, root mean square: all samples but half a window at the ends of
    /// the segments, and those.
    pub(super) fn errors(&self, order: usize, segments: &[Range<usize>]) -> [f64; 2] {
        let half = self.window / 2;
        let (mut sums, mut counts) = ([0.0; 2], [0_u32; 2]);
        for segment in segments {
            for k in segment.clone() {
                let part = usize::from(k - segment.start < half || segment.end - 1 - k < half);
                sums[part] += self.errors[k][order].powi(2);
                counts[part] += 1;
            }
        }
        let [inside, ends] =
            [0, 1].map(|part| (sums[part] / f64::from(counts[part].max(1))).sqrt());
        match counts[0] {
            0 => [ends, ends],
            _ => [inside, ends],
        }
    }
}

/// Successive samples in units of the process.
struct Piece {
    steps: Vec<f64>,
    observations: Vec<Observation>,
    /// Standard deviation of the values.
    sigma: f64,
}

impl Piece {
    fn problem(&self) -> Problem<'_> {
        Problem {
            steps: &self.steps,
            observations: &self.observations,
        }
    }

    /// Samples over which a process of this order smooths: (σ²/w)^(1/(2p + 2)).
    fn length(&self, order: usize, log_w: f64) -> f64 {
        ((2.0 * self.sigma.ln() - log_w) / (2 * order + 2) as f64).exp()
    }
}

fn adaptive(order: usize, piece: &Piece, log_w: f64, walk: f64) -> Fitted {
    match order {
        2 => Fitted::adaptive::<3>(piece, log_w, walk),
        3 => Fitted::adaptive::<4>(piece, log_w, walk),
        4 => Fitted::adaptive::<5>(piece, log_w, walk),
        _ => Fitted::adaptive::<6>(piece, log_w, walk),
    }
}

fn constant(order: usize, piece: &Piece, log_w: f64) -> Fitted {
    match order {
        2 => Fitted::constant::<3>(piece, log_w),
        3 => Fitted::constant::<4>(piece, log_w),
        4 => Fitted::constant::<5>(piece, log_w),
        _ => Fitted::constant::<6>(piece, log_w),
    }
}

/// How a coordinate is smoothed.
#[derive(Debug, Clone, Copy)]
enum Way {
    /// Order, ln w at first, and the change of the intensity.
    Adaptive(usize, f64, f64),
    /// The best order and the next best.
    Interpolated(usize, usize),
}

/// A coordinate in units of its largest excursion and of the median step.
struct Scaled<'a> {
    t: &'a [f64],
    value: Vec<f64>,
    rate: Option<Vec<f64>>,
    scale: f64,
    step: f64,
    noise: Noise,
    noise_of_rate: f64,
}

/// Estimates a coordinate in each of `segments`, which have at least six samples; elsewhere it is 0.
pub(super) fn estimate(measured: &Measured<'_>, segments: &[Range<usize>]) -> Motion {
    let with = Scaled::new(measured, segments);
    let motion = with.motion(segments);
    if with.agrees(&motion, segments) {
        return motion;
    }
    let alone = Measured {
        t: measured.t,
        value: measured.value.clone(),
        rate: None,
    };
    Scaled::new(&alone, segments).motion(segments)
}

impl<'a> Scaled<'a> {
    fn new(measured: &Measured<'a>, segments: &[Range<usize>]) -> Self {
        let first = segments.first().map_or(0.0, |s| measured.value[s.start]);
        let inside = || {
            segments
                .iter()
                .flat_map(|s| measured.value[s.clone()].iter())
        };
        let scale = inside().fold(0.0_f64, |scale, y| scale.max((y - first).abs()));
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let step = median_step(measured.t);
        let mut scaled = Self {
            t: measured.t,
            value: measured.value.iter().map(|y| y / scale).collect(),
            rate: (measured.rate.as_ref()).map(|r| r.iter().map(|y| y * step / scale).collect()),
            scale,
            step,
            noise: Noise {
                sigma: 1.0,
                least: 1.0,
                log_w: 0.0,
            },
            noise_of_rate: 1.0,
        };
        scaled.noise = scaled.noise_of(&scaled.value, segments);
        if let Some(rate) = &scaled.rate {
            scaled.noise_of_rate = scaled.noise_of(rate, segments).sigma;
        }
        scaled
    }

    fn noise_of(&self, column: &[f64], segments: &[Range<usize>]) -> Noise {
        let piece = |s: &Range<usize>| (self.steps(s), column[s.clone()].to_vec());
        let pieces: Vec<_> = segments.iter().map(piece).collect();
        Noise::of(&pieces, floor(&pieces))
    }

    /// Lengths of the steps, in median steps.
    fn steps(&self, samples: &Range<usize>) -> Vec<f64> {
        let steps = self.t[samples.clone()].windows(2);
        let length = |w: &[f64]| (w[1] - w[0]) / self.step;
        steps
            .map(length)
            .map(|d| {
                if (d - 1.0).abs() < 1e-6 {
                    1.0
                } else {
                    d.max(1e-3)
                }
            })
            .collect()
    }

    /// The samples in units of the noise; `sigma` in place of it where nothing is known of it.
    fn piece(&self, samples: &Range<usize>, sigma: f64) -> Piece {
        let first = self.value[samples.start];
        let observation = |k: usize| Observation {
            value: Some(((self.value[k] - first) / sigma, 1.0 / sigma)),
            rate: (self.rate.as_ref())
                .map(|r| (r[k] / self.noise_of_rate, 1.0 / self.noise_of_rate)),
        };
        Piece {
            steps: self.steps(samples),
            observations: samples.clone().map(observation).collect(),
            sigma,
        }
    }

    fn motion(&self, segments: &[Range<usize>]) -> Motion {
        let way = self.way(segments);
        let parts: Vec<(Range<usize>, Range<usize>)> = segments.iter().flat_map(parts).collect();
        let fitted: Vec<_> = (parts.par_iter())
            .map(|(_, around)| self.smooth(way, around))
            .collect();
        let (len, mut length, mut samples) = (self.value.len(), 0.0, 0);
        let (mut states, mut errors) = (vec![[0.0; 3]; len], vec![[0.0; 3]; len]);
        for ((own, around), (fitted, own_length)) in parts.iter().zip(&fitted) {
            let first = self.value[around.start];
            for k in own.clone() {
                let mut unit = self.scale;
                for order in 0..3 {
                    let (x, variance) = (
                        fitted.states[k - around.start][order],
                        fitted.variances[k - around.start][order],
                    );
                    let offset = if order == 0 { first } else { 0.0 };
                    states[k][order] = (x + offset) * unit;
                    errors[k][order] = variance.max(0.0).sqrt() * unit;
                    unit /= self.step;
                }
            }
            length += own_length * own.len() as f64;
            samples += own.len();
        }
        let length = length / samples.max(1) as f64;
        Motion {
            states,
            errors,
            noise: self.noise.sigma * self.scale,
            window: 2 * (length.min(1e9) as usize).max(2) + 1,
            with_rate: self.rate.is_some() && self.noise_of_rate * length < self.noise.sigma,
        }
    }

    /// Chooses the way on a few pieces.
    fn way(&self, segments: &[Range<usize>]) -> Way {
        let few = few(segments);
        let sigma = self.noise.sigma;
        let pieces: Vec<Piece> = few.iter().map(|s| self.piece(s, sigma)).collect();
        if self.rate.is_none() {
            let left_out = |piece: &Piece| {
                let fitted = constant(ORDER_OF_NOISE, piece, self.noise.log_w);
                left_out(piece, &fitted, sigma)
            };
            let errors: Vec<(f64, usize)> = pieces.iter().map(left_out).collect();
            let (sum, count) = errors.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            if sigma * sigma * count as f64 <= NEGLIGIBLE * sum {
                return self.interpolated(&few);
            }
        }
        let shortest = few.iter().map(Range::len).min().unwrap_or(0);
        let length = pieces
            .first()
            .map_or(1.0, |p| p.length(ORDER_OF_NOISE, self.noise.log_w));
        let way = |order: usize, walk: f64| {
            let log_w = 2.0 * sigma.ln() - (2 * order + 2) as f64 * length.ln();
            (order, log_w, walk)
        };
        let best = |ways: Vec<(usize, f64, f64)>| {
            let evidence = |&(order, log_w, walk): &(usize, f64, f64)| -> f64 {
                let of_piece = |piece| adaptive(order, piece, log_w, walk).evidence;
                pieces.iter().map(of_piece).sum()
            };
            let scored: Vec<f64> = ways.par_iter().map(evidence).collect();
            let best = scored.iter().zip(&ways).max_by(|a, b| a.0.total_cmp(b.0));
            best.map(|(_, way)| *way)
        };
        let orders = ORDERS.into_iter().filter(|order| order + 2 <= shortest);
        let order =
            best(orders.map(|order| way(order, WALKS[1])).collect()).map_or(ORDERS[0], |w| w.0);
        let (order, log_w, walk) =
            best(WALKS.map(|walk| way(order, walk)).to_vec()).unwrap_or(way(order, WALKS[1]));
        Way::Adaptive(order, log_w, walk)
    }

    /// The two orders that predict samples from their neighbours best.
    fn interpolated(&self, few: &[Range<usize>]) -> Way {
        let shortest = few.iter().map(Range::len).min().unwrap_or(0);
        let mut scored: Vec<(f64, usize)> = (ORDERS.into_iter())
            .filter(|order| order + 2 <= shortest)
            .map(|order| {
                let error = |s: &Range<usize>| {
                    let piece = self.piece(s, 1.0);
                    left_out(&piece, &constant(order, &piece, INTERPOLATING), 1.0).0
                };
                (few.iter().map(error).sum(), order)
            })
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let order = |k: usize| scored.get(k).map_or(ORDERS[k], |s| s.1);
        Way::Interpolated(order(0), order(1))
    }

    /// A piece, smoothed, and the samples over which it was averaged.
    fn smooth(&self, way: Way, samples: &Range<usize>) -> (Fitted, f64) {
        let possible = |order: usize| order.min(samples.len() - 2);
        match way {
            Way::Adaptive(order, log_w, walk) => {
                let piece = self.piece(samples, self.noise.sigma);
                let fitted = adaptive(possible(order), &piece, log_w, walk);
                let length = piece.length(possible(order), fitted.log_w);
                (fitted, length)
            }
            Way::Interpolated(order, next) => {
                let piece = self.piece(samples, 1.0);
                let mut fitted = constant(possible(order), &piece, INTERPOLATING);
                let other = constant(possible(next), &piece, INTERPOLATING);
                self.doubt(&mut fitted, &other);
                (fitted, 0.5 * order as f64)
            }
        }
    }

    /// Variances of interpolated states: the difference to another order, the largest near a sample, and noise.
    fn doubt(&self, fitted: &mut Fitted, other: &Fitted) {
        let len = fitted.states.len();
        for k in 0..len {
            for order in 0..3 {
                let difference =
                    |k: usize| (fitted.states[k][order] - other.states[k][order]).powi(2);
                let near = k.saturating_sub(2)..(k + 3).min(len);
                let largest = near.map(difference).fold(0.0, f64::max);
                fitted.variances[k][order] =
                    largest + (AMPLIFIED[order] * self.noise.least).powi(2);
            }
        }
    }

    /// Whether values and rates have the residuals that their noise explains.
    fn agrees(&self, motion: &Motion, segments: &[Range<usize>]) -> bool {
        let Some(rate) = &self.rate else {
            return true;
        };
        let (mut sums, mut count) = ([0.0; 2], 0);
        for k in segments.iter().flat_map(Clone::clone) {
            let [q, qd, _] = motion.states[k];
            sums[0] += ((self.value[k] - q / self.scale) / self.noise.sigma).powi(2);
            sums[1] += ((rate[k] - qd * self.step / self.scale) / self.noise_of_rate).powi(2);
            count += 1;
        }
        sums.iter()
            .all(|sum| *sum <= CONTRADICTING * f64::from(count))
    }
}

/// Pieces of a segment, each with the samples that it is smoothed with.
fn parts(segment: &Range<usize>) -> Vec<(Range<usize>, Range<usize>)> {
    let count = segment.len().div_ceil(PIECE).max(1);
    let at = |k: usize| segment.start + segment.len() * k / count;
    let part = |k: usize| {
        let own = at(k)..at(k + 1);
        let from = own.start.saturating_sub(BESIDE).max(segment.start);
        (own.clone(), from..(own.end + BESIDE).min(segment.end))
    };
    (0..count).map(part).collect()
}

/// A few ranges that are spread evenly over the segments.
fn few(segments: &[Range<usize>]) -> Vec<Range<usize>> {
    let pieces: Vec<Range<usize>> = (segments.iter())
        .flat_map(|s| {
            let count = (s.len() / CHOOSING_LENGTH).max(1);
            let at = move |k: usize| s.start + s.len() * k / count;
            (0..count).map(move |k| at(k)..at(k + 1).min(at(k) + CHOOSING_LENGTH))
        })
        .collect();
    let stride = pieces.len().div_ceil(CHOOSING).max(1);
    pieces.into_iter().step_by(stride).collect()
}

/// Squared errors of samples as their neighbours predict them, and how many there are.
fn left_out(piece: &Piece, fitted: &Fitted, sigma: f64) -> (f64, usize) {
    let inside = 2..piece.observations.len() - 2;
    let count = inside.len();
    let error = |k: usize| {
        let measured = piece.observations[k].value.map_or(0.0, |(y, _)| y * sigma);
        let leverage = fitted.variances[k][0] / (sigma * sigma);
        ((measured - fitted.states[k][0]) / (1.0 - leverage).max(1e-12)).powi(2)
    };
    (inside.map(error).sum(), count)
}

/// The least deviation of a column's noise: of its rounding, or of its quantum where values repeat.
fn floor(pieces: &[(Vec<f64>, Vec<f64>)]) -> f64 {
    let mut values: Vec<f64> = pieces.iter().flat_map(|(_, y)| y.iter().copied()).collect();
    let (count, largest) = (
        values.len(),
        values.iter().fold(0.0_f64, |m, y| m.max(y.abs())),
    );
    let rounding = (largest * f64::EPSILON).max(1e-18);
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() * 20 > count * 19 {
        return rounding;
    }
    let steps = values.windows(2).map(|w| w[1] - w[0]);
    let quantum = steps
        .filter(|d| *d > 4.0 * rounding)
        .fold(f64::INFINITY, f64::min);
    match quantum.is_finite() {
        true => quantum / 12.0_f64.sqrt(),
        false => rounding,
    }
}
