//! Choice of the window of a local polynomial from the data.
//!
//! A window is chosen by its risk, the mean squared error of the derivative: variance σ² ‖a‖² (see
//! `local_polynomial`), with σ from the residuals of short windows, plus squared bias. The bias of a window of
//! length h is of order hᵖ, so that it follows from the difference to the next longer window r h, corrected for its
//! noise: bias² = (⟨(D' − D)²⟩ − σ² ‖a' − a‖²) / (rᵖ − 1)², where the prime denotes the longer one. (The idea of comparing windows is
//! Lepski's, Theory Probab. Appl. 35, 1990.)

use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;

use super::EstimateOptions;
use super::local_polynomial::{Filter, Series, around};
use lagrangian_motion::statistics::{mean, upper_median};

/// Number of samples of a recording at which the risk of a window is estimated.
const PLACES: usize = 1500;
/// Ratio of successive window lengths.
const RUNG: f64 = 1.4;

/// A window with its noise and risk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Choice {
    pub(crate) filter: Filter,
    pub(crate) window: usize,
    /// Standard deviation of the noise of the source.
    pub(crate) noise: f64,
    /// Estimated mean squared error of the derivative.
    pub(super) risk: Risk,
}

impl Choice {
    /// Estimated standard error of the derivative.
    pub(crate) fn standard_error(self) -> f64 {
        self.risk.inside.sqrt()
    }

    /// The same, and that at the ends of the data.
    pub(crate) fn errors(self) -> [f64; 2] {
        [self.standard_error(), self.risk.ends.sqrt()]
    }
}

/// One window at one sample.
struct Local {
    start: usize,
    weights: Vec<f64>,
    value: f64,
    /// Whether the end of the data shifts it off centre.
    shifted: bool,
}

impl Local {
    fn new(series: Series<'_>, filter: Filter, k: usize, window: Range<usize>) -> Self {
        let mut weights = Vec::with_capacity(window.len());
        filter.weights(&series.t[window.clone()], series.t[k], &mut weights);
        let value = series.dot(window.start, &weights);
        let shifted = k.abs_diff(window.start + window.len() / 2) > 1;
        Self {
            start: window.start,
            weights,
            value,
            shifted,
        }
    }

    fn variance(&self) -> f64 {
        self.weights.iter().map(|a| a * a).sum()
    }

    /// ‖a − b‖², for `shorter` inside of this window.
    fn distance(&self, shorter: &Self) -> f64 {
        let offset = shorter.start - self.start;
        let pairs = self.weights[offset..].iter().zip(&shorter.weights);
        let inside = pairs.map(|(a, b)| a * b).sum::<f64>();
        self.variance() + shorter.variance() - 2.0 * inside
    }
}

/// At most [`PLACES`] samples, evenly spread, each with its segment.
fn places(segments: &[Range<usize>]) -> Vec<(usize, &Range<usize>)> {
    let total: usize = segments.iter().map(Range::len).sum();
    let stride = total.div_ceil(PLACES).max(1);
    let all = segments.iter().flat_map(|s| s.clone().map(move |k| (k, s)));
    all.skip(stride / 2).step_by(stride).collect()
}

/// Variance of the noise: residuals of short windows, over what white noise of variance 1 would leave there.
pub(crate) fn noise_variance(
    series: Series<'_>,
    segments: &[Range<usize>],
    degree: usize,
    window: usize,
) -> f64 {
    let residuals = places(segments).into_iter();
    let residuals = residuals.map(|(k, s)| series.residual(around(k, window, s), degree));
    let sum = residuals.fold((0.0, 0.0), |sum, r| (sum.0 + r.0, sum.1 + r.1));
    if sum.1 > 1e-9 { sum.0 / sum.1 } else { 0.0 }
}

/// The same of most windows of eight values by cubics, whatever a few jumps leave, such as those of dry friction.
pub(crate) fn usual_noise_variance(series: Series<'_>, segments: &[Range<usize>]) -> f64 {
    /// The median of a chi-squared variable of four degrees of freedom, which are left, over its mean.
    const MEDIAN: f64 = 0.839;
    let residuals = places(segments).into_iter();
    let residuals = residuals.map(|(k, s)| series.residual(around(k, 8, s), 3));
    let mut variances: Vec<f64> = residuals
        .filter(|r| r.1 > 1e-9)
        .map(|r| r.0 / r.1)
        .collect();
    upper_median(&mut variances) / MEDIAN
}

/// Chooses the window of `filter` with the smallest risk.
pub(crate) fn choose(
    series: Series<'_>,
    segments: &[Range<usize>],
    filter: Filter,
    options: &EstimateOptions,
) -> Choice {
    let variance = noise_variance(series, segments, filter.degree, filter.degree + 5);
    let places = places(segments);
    let longest = segments.iter().map(Range::len).max().unwrap_or(0);
    let rungs = match options.window {
        Some(window) => vec![window, longer(window)],
        None => ladder(filter.degree + 3, longest.min(options.longest_window)),
    };
    let mut risks: Vec<(usize, Risk)> = Vec::new();
    let mut values: Vec<Vec<f64>> = Vec::new();
    let mut shorter: Option<(usize, Vec<Local>)> = None;
    for &window in &rungs {
        let local =
            |(k, s): &(usize, &Range<usize>)| Local::new(series, filter, *k, around(*k, window, s));
        let here: Vec<Local> = places.par_iter().map(local).collect();
        let mut risk = Risk::of_noise(&here, variance);
        if let Some((previous, shorter)) = &shorter {
            let ratio = window as f64 / *previous as f64;
            // The difference estimates the bias of the shorter window best; the longest window has no other estimate.
            if let Some(last) = risks.last_mut() {
                last.1
                    .add_bias(&here, shorter, variance, |order| ratio.powi(order) - 1.0);
            }
            if Some(&window) == rungs.last() {
                risk.add_bias(&here, shorter, variance, |order| 1.0 - ratio.powi(-order));
            }
        }
        let totals = risks.iter().map(|r| r.1.total());
        let best = totals.fold(f64::INFINITY, f64::min);
        if risks.last().is_some_and(|r| r.1.total() > 30.0 * best) {
            break;
        }
        values.push(here.iter().map(|local| local.value).collect());
        risks.push((window, risk));
        shorter = Some((window, here));
    }
    if options.window.is_some() {
        risks.truncate(1);
    }
    let (window, risk) = match least(&risks, &values) {
        Some(best) => risks[best],
        None => (filter.degree + 1, Risk::default()),
    };
    Choice {
        filter,
        window,
        noise: variance.sqrt(),
        risk,
    }
}

/// Index of the least risk, from short to long. Windows over whole swings agree with each other; the risk of a window is no less than that of its
/// difference to the best shorter one allows: |e| ≥ |e − e'| − |e'|.
fn least(risks: &[(usize, Risk)], values: &[Vec<f64>]) -> Option<usize> {
    let total = |k: usize| risks[k].1.total();
    (0..risks.len()).reduce(|best, k| {
        let pairs = values[k].iter().zip(&values[best]);
        let mut squares = pairs.map(|(a, b)| (a - b).powi(2));
        let excess = mean(&mut squares).sqrt() - total(best).sqrt();
        match total(k).max(excess.max(0.0).powi(2)) < total(best) {
            true => k,
            false => best,
        }
    })
}

/// Mean squared error of a derivative.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Risk {
    /// Samples where the window is centred.
    pub(super) inside: f64,
    /// Samples where the end of the data has shifted it.
    pub(super) ends: f64,
    /// The fraction of the samples at the ends.
    part: f64,
}

impl Risk {
    fn of_noise(here: &[Local], variance: f64) -> Self {
        let risk = |shifted| {
            let own = here.iter().filter(|l| l.shifted == shifted);
            variance * mean(&mut own.map(Local::variance))
        };
        let shifted = here.iter().filter(|l| l.shifted).count();
        Self {
            inside: risk(false),
            ends: risk(true),
            part: shifted as f64 / here.len().max(1) as f64,
        }
    }

    pub(super) fn total(self) -> f64 {
        self.inside * (1.0 - self.part) + self.ends * self.part
    }

    /// Adds the squared bias from the differences between two windows; `growth` is the ratio of their biases
    /// minus 1, for a bias of some order in the length.
    fn add_bias(
        &mut self,
        longer: &[Local],
        shorter: &[Local],
        variance: f64,
        growth: impl Fn(i32) -> f64,
    ) {
        // The error of a shifted window is one order lower. Both orders are one lower than for a smooth motion, since a window
        // longer than the time scale of a jerk hides part of its bias.
        for (shifted, order, risk) in [(false, 3, &mut self.inside), (true, 2, &mut self.ends)] {
            let all = || longer.iter().zip(shorter);
            let pairs = || all().filter(|(l, _)| l.shifted == shifted);
            let squared = mean(&mut pairs().map(|(l, s)| (l.value - s.value).powi(2)));
            let excess =
                (squared - variance * mean(&mut pairs().map(|(l, s)| l.distance(s)))).max(0.0);
            *risk += excess / growth(order).powi(2);
        }
    }
}

/// The next longer window, an odd number of samples.
fn longer(window: usize) -> usize {
    ((window as f64 * RUNG).ceil() as usize) | 1
}

fn ladder(shortest: usize, longest: usize) -> Vec<usize> {
    let next = |w: &usize| Some(longer(*w));
    let rungs = std::iter::successors(Some(shortest | 1), next);
    let rungs: Vec<usize> = rungs.take_while(|w| *w <= longest).collect();
    match rungs.is_empty() {
        true => vec![longest.max(1)],
        false => rungs,
    }
}
