//! Motions that were recorded without noise to speak of: splines through their values and rates.
//!
//! A recording is taken to be smooth where a sample is predicted far better by its neighbours than by those twice as far away; noise, rounding and
//! jitter of the stamps make both predictions equally bad. The order of the spline is the one that predicts best, and its error is
//! the difference to the next best.

mod process;

use std::ops::Range;

use rayon::prelude::*;

use super::local_polynomial::median_step;
use process::{Knot, spline};

/// Orders p of splines of degree 2p + 1.
const ORDERS: [usize; 4] = [2, 3, 4, 5];
/// The fewest samples of a segment.
const SHORTEST: usize = 16;
/// Samples of a piece that is interpolated at once, and samples beside it that it is interpolated with.
const PIECE: usize = 4096;
const BESIDE: usize = 64;
/// Number and length of the pieces on which the order is chosen.
const CHOOSING: usize = 6;
const CHOOSING_LENGTH: usize = 400;
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
    /// Standard deviation of the rounding of the values.
    pub(super) rounding: f64,
    /// Whether measured rates served.
    pub(super) with_rates: bool,
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
        [0, 1].map(|part| (sums[part] / f64::from(counts[part].max(1))).sqrt())
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

/// Interpolates a coordinate in each of `segments`, from `values` and perhaps `rates` `[len]` at times `t`, s; `None` where they
/// are not smooth. `clean` recordings are among others that are smooth.
pub(super) fn interpolate(
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
    let alone = scaled.motion(segments)?;
    let Some(rates) = rates else {
        return Some(alone);
    };
    if !Scaled::new(t, rates.clone(), segments, clean).is_smooth(segments)
        || !alone.agrees(&rates, segments)
    {
        return Some(alone);
    }
    let unit = scaled.step / scaled.scale;
    scaled.rates = Some(rates.iter().map(|rate| rate * unit).collect());
    scaled.motion(segments)
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

    /// The spline of this order through every `stride`-th of the samples.
    fn spline(&self, order: usize, samples: &Range<usize>, stride: usize) -> Vec<Knot> {
        let picked = |column: &[f64]| -> Vec<f64> {
            column[samples.clone()]
                .iter()
                .step_by(stride)
                .copied()
                .collect()
        };
        let unit = self.step * stride as f64;
        let length = |w: &[f64]| {
            let length = (w[1] - w[0]) / unit;
            // Stamps with rounding errors are even.
            if (length - 1.0).abs() < 1e-6 {
                1.0
            } else {
                length.max(1e-3)
            }
        };
        let steps: Vec<f64> = picked(self.t).windows(2).map(length).collect();
        let first = self.values[samples.start];
        let values: Vec<f64> = picked(&self.values).iter().map(|y| y - first).collect();
        let rates = (self.rates.as_ref()).map(|rates| {
            picked(rates)
                .iter()
                .map(|rate| rate * stride as f64)
                .collect::<Vec<f64>>()
        });
        let rates = rates.as_deref();
        match order {
            2 => spline::<3>(&steps, &values, rates),
            3 => spline::<4>(&steps, &values, rates),
            4 => spline::<5>(&steps, &values, rates),
            _ => spline::<6>(&steps, &values, rates),
        }
    }

    /// Root mean square of the errors of samples as their neighbours predict them.
    fn left_out(&self, order: usize, few: &[Range<usize>], stride: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0_u32);
        for samples in few {
            let first = self.values[samples.start];
            let knots = self.spline(order, samples, stride);
            for (k, knot) in knots.iter().enumerate().take(knots.len() - 2).skip(2) {
                let value = self.values[samples.start + k * stride] - first;
                sum += ((value - knot.state[0]) / (1.0 - knot.leverage).max(1e-12)).powi(2);
                count += 1;
            }
        }
        (sum / f64::from(count.max(1))).sqrt()
    }

    /// The errors of all orders, the best first.
    fn orders(&self, few: &[Range<usize>]) -> Vec<(f64, usize)> {
        let error = |order| (self.left_out(order, few, 1), order);
        let mut errors: Vec<(f64, usize)> = ORDERS.into_par_iter().map(error).collect();
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
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

    fn motion(&self, segments: &[Range<usize>]) -> Option<Motion> {
        let few = few(segments);
        let orders = self.orders(&few);
        if !self.is_smooth_at(orders[0], &few) {
            return None;
        }
        let parts: Vec<(Range<usize>, Range<usize>)> = segments.iter().flat_map(parts).collect();
        let both = |(_, around): &(Range<usize>, Range<usize>)| {
            [orders[0].1, orders[1].1].map(|order| self.spline(order, around, 1))
        };
        let splines: Vec<[Vec<Knot>; 2]> = parts.par_iter().map(both).collect();
        let inside = segments.iter().flat_map(|s| &self.values[s.clone()]);
        let rounding = inside.fold(0.0_f64, |largest, y| largest.max(y.abs())) * f64::EPSILON;
        let len = self.values.len();
        let mut motion = Motion {
            states: vec![[0.0; 3]; len],
            errors: vec![[0.0; 3]; len],
            window: 2 * orders[0].1 + 1,
            rounding: rounding * self.scale,
            with_rates: self.rates.is_some(),
        };
        for ((own, around), [best, next]) in parts.iter().zip(&splines) {
            let mut unit = self.scale;
            for (order, amplified) in AMPLIFIED.into_iter().enumerate() {
                let first = f64::from(order == 0) * self.values[around.start];
                let difference = |k: usize| (best[k].state[order] - next[k].state[order]).powi(2);
                for k in own.clone() {
                    let at = k - around.start;
                    let near = at.saturating_sub(2)..(at + 3).min(best.len());
                    let variance =
                        near.map(difference).fold(0.0, f64::max) + (amplified * rounding).powi(2);
                    motion.states[k][order] = (best[at].state[order] + first) * unit;
                    motion.errors[k][order] = variance.sqrt() * unit;
                }
                unit /= self.step;
            }
        }
        Some(motion)
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
