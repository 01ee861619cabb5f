//! Motions that were recorded without noise to speak of, as splines through their values and rates, or with white noise, smoothed
//! ([`smoother`]).
//!
//! A recording is taken to be smooth where a sample is predicted far better by its neighbours than by those twice as far away; noise, rounding and
//! jitter of the stamps make both predictions equally bad. The order of the spline is the one that predicts best, and its error is
//! the difference to the next best.

mod intensity;
mod noise;
mod process;
mod smoother;

use std::f64::consts::LN_10;
use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::sort_by_number;

use super::local_polynomial::median_step;
use intensity::Fitted;
use process::{Observation, Problem};

/// Orders p of splines of degree 2p + 1.
const ORDERS: [usize; 4] = [2, 3, 4, 5];
/// The fewest samples of a segment.
const SHORTEST: usize = 16;
/// Samples of a piece that is interpolated at once, and samples beside it that it is interpolated with.
const PIECE: usize = 4096;
const BESIDE: usize = 512;
/// Number and length of the pieces on which the order is chosen.
const CHOOSING: usize = 6;
const CHOOSING_LENGTH: usize = 400;
/// ln w at which the process interpolates observations of variance 1.
const INTERPOLATING: f64 = 7.0 * LN_10;
/// Neighbours predict a smooth sample this many times better than those twice as far away; the second number is for recordings
/// among others that are smooth, where a prediction that is hardly better is that of a fast motion.
const SMOOTHER: [f64; 2] = [8.0, 2.0];
/// Predictions with errors below this part of the largest excursion are as good as the numbers.
const ROUNDING: f64 = 1e-11;
/// Rates are of the same motion if they differ from those of the values' spline by less than this many of its errors, or by this
/// part of their size.
const DIFFERING: f64 = 5.0;
const NEGLIGIBLE: f64 = 1e-6;
/// Deviations of derivatives per deviation of the values, for even steps of length 1.
const AMPLIFIED: [f64; 3] = [1.0, 1.2, 3.5];

/// Values and their first two derivatives, `[len]`, with standard errors.
pub(super) struct Motion {
    pub(super) states: Vec<[f64; 3]>,
    pub(super) errors: Vec<[f64; 3]>,
    /// Samples that decide most of a state.
    pub(super) window: usize,
    /// Standard deviation of the noise of the values, or of their rounding.
    pub(super) noise: f64,
    /// Whether measured rates tell most of it.
    pub(super) with_rates: bool,
    /// Whether it goes through all values.
    exact: bool,
}

impl Motion {
    /// Whether its derivative of this order is better than a measured one.
    pub(super) fn is_better(&self, order: usize) -> bool {
        !self.exact || order > 0 && !self.with_rates
    }

    /// Writes the derivative of this order and its errors as a column of `[len, n]`.
    pub(super) fn write(
        &self,
        order: usize,
        (column, n): (usize, usize),
        [values, errors]: [&mut Vec<f64>; 2],
    ) {
        for (k, (state, error)) in self.states.iter().zip(&self.errors).enumerate() {
            let at = k * n + column;
            (values[at], errors[at]) = (state[order], error[order]);
        }
    }

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
        [if counts[0] > 0 { inside } else { ends }, ends]
    }

    /// Whether measured rates are those of the motion.
    fn agrees(&self, rates: &[f64], segments: &[Range<usize>]) -> bool {
        let mut sums = [0.0; 3];
        for k in segments.iter().flat_map(Clone::clone) {
            sums[0] += (rates[k] - self.states[k][1]).powi(2);
            sums[1] += self.errors[k][1].powi(2);
            sums[2] += rates[k].powi(2);
        }
        let [difference, error, size] = sums.map(f64::sqrt);
        difference <= DIFFERING * error + NEGLIGIBLE * size
    }
}

/// A coordinate in units of its largest excursion and of the median step.
struct Scaled<'a> {
    t: &'a [f64],
    values: Vec<f64>,
    rates: Option<Vec<f64>>,
    scale: f64,
    step: f64,
    /// As in [`SMOOTHER`].
    smoother: f64,
}

/// Whether `values` `[len]` at times `t`, s, are smooth in `segments`.
pub(super) fn is_smooth(t: &[f64], values: Vec<f64>, segments: &[Range<usize>]) -> bool {
    let long = segments.iter().all(|s| s.len() >= SHORTEST);
    long && Scaled::new(t, values, segments, false).is_smooth(segments)
}

/// Estimates a coordinate in each of `segments`, from `values` and perhaps `rates` `[len]` at times `t`, s; `None` where they are
/// neither smooth nor have white noise. `clean` recordings are among others that are smooth.
pub(super) fn estimate(
    t: &[f64],
    values: Vec<f64>,
    rates: Option<Vec<f64>>,
    segments: &[Range<usize>],
    clean: bool,
) -> Option<Motion> {
    if segments.iter().any(|s| s.len() < SHORTEST) {
        return None;
    }
    let mut scaled = Scaled::new(t, values, segments, clean);
    let unit = scaled.step / scaled.scale;
    let in_units = |rates: &Vec<f64>| rates.iter().map(|rate| rate * unit).collect();
    if let Some(alone) = scaled.interpolated(segments) {
        let serves = |rates: &Vec<f64>| {
            Scaled::new(t, rates.clone(), segments, clean).is_smooth(segments)
                && alone.agrees(rates, segments)
        };
        let Some(rates) = rates.filter(serves) else {
            return Some(alone);
        };
        scaled.rates = Some(in_units(&rates));
        return scaled.interpolated(segments);
    }
    scaled.rates = rates.as_ref().map(in_units);
    scaled.smoothed(segments)
}

/// Successive samples in units of the process.
struct Piece {
    steps: Vec<f64>,
    observations: Vec<Observation>,
    /// As in [`Problem`].
    memory: f64,
}

impl Piece {
    fn problem(&self) -> Problem<'_> {
        Problem {
            steps: &self.steps,
            observations: &self.observations,
            memory: self.memory,
        }
    }
}

/// Smooths with intensity `log_w` at all steps.
fn constant(order: usize, piece: &Piece, log_w: f64) -> Fitted {
    match order {
        2 => Fitted::constant::<3>(piece, log_w),
        3 => Fitted::constant::<4>(piece, log_w),
        4 => Fitted::constant::<5>(piece, log_w),
        _ => Fitted::constant::<6>(piece, log_w),
    }
}

impl<'a> Scaled<'a> {
    fn new(t: &'a [f64], values: Vec<f64>, segments: &[Range<usize>], clean: bool) -> Self {
        let first = segments.first().map_or(0.0, |s| values[s.start]);
        let inside = segments.iter().flat_map(|s| &values[s.clone()]);
        let scale = inside.fold(0.0_f64, |scale, y| scale.max((y - first).abs()));
        let scale = if scale > 0.0 { scale } else { 1.0 };
        Self {
            t,
            values: values.iter().map(|y| y / scale).collect(),
            rates: None,
            scale,
            step: median_step(t),
            smoother: SMOOTHER[usize::from(clean)],
        }
    }

    /// Lengths of the steps between every `stride`-th of the samples, in as many median steps.
    fn steps(&self, samples: &Range<usize>, stride: usize) -> Vec<f64> {
        let times: Vec<f64> = (self.t[samples.clone()].iter().step_by(stride))
            .map(|t| t / (self.step * stride as f64))
            .collect();
        let length = |w: &[f64]| {
            let length = w[1] - w[0];
            // Stamps with rounding errors are even.
            let even = (length - 1.0).abs() < 1e-6;
            if even { 1.0 } else { length.max(1e-3) }
        };
        times.windows(2).map(length).collect()
    }

    /// Every `stride`-th of the samples, over the deviations of values and rates.
    fn piece(&self, samples: &Range<usize>, stride: usize, [value, rate]: [f64; 2]) -> Piece {
        let first = self.values[samples.start];
        let observation = |k: usize| Observation {
            value: Some(((self.values[k] - first) / value, 1.0 / value)),
            rate: (self.rates.as_ref()).map(|r| (r[k] * stride as f64 / rate, 1.0 / rate)),
        };
        Piece {
            steps: self.steps(samples, stride),
            observations: samples.clone().step_by(stride).map(observation).collect(),
            memory: 0.0,
        }
    }

    /// The spline of this order through every `stride`-th of the samples.
    fn spline(&self, order: usize, samples: &Range<usize>, stride: usize) -> Fitted {
        constant(order, &self.piece(samples, stride, [1.0; 2]), INTERPOLATING)
    }

    /// Root mean square of the errors of samples as their neighbours predict them.
    fn left_out(&self, order: usize, few: &[Range<usize>], stride: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0_u32);
        for samples in few {
            let first = self.values[samples.start];
            let spline = self.spline(order, samples, stride);
            for k in 2..spline.states.len() - 2 {
                let value = self.values[samples.start + k * stride] - first;
                let rest = (1.0 - spline.variances[k][0]).max(1e-12);
                sum += ((value - spline.states[k][0]) / rest).powi(2);
                count += 1;
            }
        }
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// The errors of all orders, the best first.
    fn orders(&self, few: &[Range<usize>]) -> Vec<(f64, usize)> {
        let error = |order| (self.left_out(order, few, 1), order);
        let mut errors: Vec<(f64, usize)> = ORDERS.into_par_iter().map(error).collect();
        sort_by_number(&mut errors, |own| own.0);
        errors
    }

    /// Whether the best order predicts far better than from every other sample.
    fn is_smooth_at(&self, (error, order): (f64, usize), few: &[Range<usize>]) -> bool {
        error < ROUNDING || self.smoother * error < self.left_out(order, few, 2)
    }

    fn is_smooth(&self, segments: &[Range<usize>]) -> bool {
        let few = few(segments);
        self.is_smooth_at(self.orders(&few)[0], &few)
    }

    fn interpolated(&self, segments: &[Range<usize>]) -> Option<Motion> {
        let few = few(segments);
        let orders = self.orders(&few);
        if !self.is_smooth_at(orders[0], &few) {
            return None;
        }
        let parts: Vec<(Range<usize>, Range<usize>)> = segments.iter().flat_map(parts).collect();
        let both = |(_, around): &(Range<usize>, Range<usize>)| {
            [orders[0].1, orders[1].1].map(|order| self.spline(order, around, 1))
        };
        let splines: Vec<[Fitted; 2]> = parts.par_iter().map(both).collect();
        let inside = segments.iter().flat_map(|s| &self.values[s.clone()]);
        let rounding = inside.fold(0.0_f64, |largest, y| largest.max(y.abs())) * f64::EPSILON;
        let mut motion = self.motion(2 * orders[0].1 + 1, rounding);
        motion.with_rates = self.rates.is_some();
        for ((own, around), [best, next]) in parts.iter().zip(&splines) {
            let len = best.states.len();
            self.write(&mut motion, own, around, &best.states, |k, order| {
                let near = k.saturating_sub(2)..(k + 3).min(len);
                let difference = |k: usize| (best.states[k][order] - next.states[k][order]).powi(2);
                let largest = near.map(difference).fold(0.0, f64::max);
                largest + (AMPLIFIED[order] * rounding).powi(2)
            });
        }
        Some(motion)
    }

    /// A motion without states; `noise` in units of the largest excursion.
    fn motion(&self, window: usize, noise: f64) -> Motion {
        Motion {
            states: vec![[0.0; 3]; self.values.len()],
            errors: vec![[0.0; 3]; self.values.len()],
            window,
            noise: noise * self.scale,
            with_rates: false,
            exact: true,
        }
    }

    /// Writes the `own` samples of a piece; `variance` is that of its k-th state's derivative of an order.
    fn write(
        &self,
        motion: &mut Motion,
        own: &Range<usize>,
        around: &Range<usize>,
        states: &[[f64; 3]],
        variance: impl Fn(usize, usize) -> f64,
    ) {
        let mut unit = self.scale;
        for order in [0, 1, 2] {
            let first = f64::from(order == 0) * self.values[around.start];
            for k in own.clone() {
                let at = k - around.start;
                motion.states[k][order] = (states[at][order] + first) * unit;
                motion.errors[k][order] = variance(at, order).max(0.0).sqrt() * unit;
            }
            unit /= self.step;
        }
    }
}

/// Pieces of a segment, each with the samples that it is interpolated with.
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
    let pieces = segments.iter().flat_map(|s| {
        let count = (s.len() / CHOOSING_LENGTH).max(1);
        let at = move |k: usize| s.start + s.len() * k / count;
        (0..count).map(move |k| at(k)..at(k + 1).min(at(k) + CHOOSING_LENGTH))
    });
    let pieces: Vec<Range<usize>> = pieces.collect();
    let stride = pieces.len().div_ceil(CHOOSING).max(1);
    pieces.into_iter().step_by(stride).collect()
}
