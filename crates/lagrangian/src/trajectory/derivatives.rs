//! Velocities and accelerations estimated from what was measured, with the window chosen from the data.
//!
//! A window is chosen by its risk, the mean squared error of the derivative: variance σ² ‖a‖² (see
//! `local_polynomial`), with σ from the residuals of short windows, plus squared bias. The bias of a window of
//! length h is of order hᵖ, so that it follows from the difference to the next longer window r h, freed of its
//! noise: bias² = (⟨(D' − D)²⟩ − σ² ‖a' − a‖²) / (rᵖ − 1)², where the prime means the longer one. (The idea of comparing windows is
//! Lepski's, Theory Probab. Appl. 35, 1990.)

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;

use super::local_polynomial::{Filter, Series, around, median_step, segments};
use super::{Recording, Trajectory};
use crate::{Error, Result};

/// Fewer consecutive samples than this cannot be differentiated twice.
const SHORTEST: usize = 6;
/// The risk of a window is estimated at so many places of a recording.
const PLACES: usize = 1500;
/// From one window to the next.
const RUNG: f64 = 1.4;

/// How missing velocities and accelerations are estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// Estimate accelerations where they were not measured.
    pub accelerations: bool,
    /// Also replace measured q and q̇ by their local polynomial.
    pub smooth: bool,
    /// Use this window, in samples, instead of choosing one from the data.
    pub window: Option<usize>,
    /// The longest window that may be chosen, in samples.
    pub longest_window: usize,
    /// No window crosses a step in time that is so many times the median step.
    pub gap: f64,
}

impl Default for EstimateOptions {
    fn default() -> Self {
        Self {
            accelerations: true,
            smooth: false,
            window: None,
            longest_window: 401,
            gap: 5.0,
        }
    }
}

impl EstimateOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let window = self
            .window
            .unwrap_or(self.longest_window)
            .min(self.longest_window);
        if window < SHORTEST {
            return Err(Error::Argument {
                name: "window",
                value: window.to_string(),
                must: "at least 6 samples",
            });
        }
        if self.gap.is_nan() || self.gap <= 1.0 {
            return Err(Error::Argument {
                name: "gap",
                value: self.gap.to_string(),
                must: "above 1 (in median steps)",
            });
        }
        Ok(())
    }
}

/// What an estimate was made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The coordinates.
    Q,
    /// The measured velocities.
    Qd,
}

/// How one signal was estimated, so that the user can be told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// The trajectory.
    pub trajectory: String,
    /// `qd` or `qdd`, or a measured signal that was smoothed.
    pub signal: &'static str,
    /// Name of the coordinate.
    pub coordinate: String,
    /// What it was made from.
    pub source: Source,
    /// Degree of the local polynomial.
    pub degree: usize,
    /// Length of the window, samples.
    pub window: usize,
    /// Length of the window, s.
    pub seconds: f64,
    /// Standard deviation of the noise found in the source, in the source's unit.
    pub noise: f64,
    /// Estimated standard error of the signal (noise and bias) in its unit, root mean square over all samples but
    /// the half windows at the ends and beside gaps.
    pub standard_error: f64,
    /// The same in those half windows, where it is larger, and itself less certain.
    pub standard_error_ends: f64,
    /// Samples that were left out because they stand alone between gaps.
    pub left_out: usize,
}

/// A window with what it costs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Choice {
    pub(crate) filter: Filter,
    pub(crate) window: usize,
    /// Standard deviation of the noise of the source.
    pub(crate) noise: f64,
    /// Estimated mean squared error of the derivative.
    risk: Risk,
}

impl Choice {
    /// Estimated standard error of the derivative.
    pub(crate) fn standard_error(self) -> f64 {
        self.risk.inside.sqrt()
    }
}

/// One window at one place.
struct Local {
    start: usize,
    weights: Vec<f64>,
    value: f64,
    /// The end of the data has shifted it off centre.
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

    /// ‖a − b‖², where `shorter` lies inside.
    fn distance(&self, shorter: &Self) -> f64 {
        let offset = shorter.start - self.start;
        let inside = shorter
            .weights
            .iter()
            .enumerate()
            .map(|(j, b)| self.weights[offset + j] * b)
            .sum::<f64>();
        self.variance() + shorter.variance() - 2.0 * inside
    }
}

/// At most [`PLACES`] samples, evenly spread, each with the segment that it belongs to.
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
    let sum = places(segments)
        .into_iter()
        .map(|(k, segment)| series.residual(around(k, window, segment), degree))
        .fold((0.0, 0.0), |sum, r| (sum.0 + r.0, sum.1 + r.1));
    if sum.1 > 1e-9 { sum.0 / sum.1 } else { 0.0 }
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
    let mut shorter: Option<(usize, Vec<Local>)> = None;
    for &window in &rungs {
        let local =
            |(k, s): &(usize, &Range<usize>)| Local::new(series, filter, *k, around(*k, window, s));
        let here: Vec<Local> = places.par_iter().map(local).collect();
        let mut risk = Risk::of_noise(&here, variance);
        if let Some((previous, shorter)) = &shorter {
            let ratio = window as f64 / *previous as f64;
            // The difference says the bias of the shorter window best; the longest one has no other witness.
            if let Some(last) = risks.last_mut() {
                last.1
                    .add_bias(&here, shorter, variance, |order| ratio.powi(order) - 1.0);
            }
            if Some(&window) == rungs.last() {
                risk.add_bias(&here, shorter, variance, |order| 1.0 - ratio.powi(-order));
            }
        }
        let best = risks
            .iter()
            .map(|r| r.1.total())
            .fold(f64::INFINITY, f64::min);
        if risks.last().is_some_and(|r| r.1.total() > 30.0 * best) {
            break;
        }
        risks.push((window, risk));
        shorter = Some((window, here));
    }
    if options.window.is_some() {
        risks.truncate(1);
    }
    let best = risks
        .into_iter()
        .min_by(|a, b| a.1.total().total_cmp(&b.1.total()));
    let (window, risk) = best.unwrap_or((filter.degree + 1, Risk::default()));
    Choice {
        filter,
        window,
        noise: variance.sqrt(),
        risk,
    }
}

/// Mean squared error of a derivative.
#[derive(Debug, Clone, Copy, Default)]
struct Risk {
    /// Where the window is centred.
    inside: f64,
    /// Where the end of the data has shifted it.
    ends: f64,
    /// The part of the samples that stand at the ends.
    part: f64,
}

impl Risk {
    fn of_noise(here: &[Local], variance: f64) -> Self {
        let risk = |shifted| {
            variance
                * mean(
                    here.iter()
                        .filter(|l| l.shifted == shifted)
                        .map(Local::variance),
                )
        };
        let shifted = here.iter().filter(|l| l.shifted).count();
        Self {
            inside: risk(false),
            ends: risk(true),
            part: shifted as f64 / here.len().max(1) as f64,
        }
    }

    fn total(self) -> f64 {
        self.inside * (1.0 - self.part) + self.ends * self.part
    }

    /// Adds the squared bias that the differences between two windows tell; `growth` is that of the bias from one
    /// to the other, minus 1, for a bias of some order in the length.
    fn add_bias(
        &mut self,
        longer: &[Local],
        shorter: &[Local],
        variance: f64,
        growth: impl Fn(i32) -> f64,
    ) {
        // A shifted window errs at one order less. Both are taken one lower than for a smooth motion, since a window
        // that is longer than a jerk hides part of its bias.
        for (shifted, order, risk) in [(false, 3, &mut self.inside), (true, 2, &mut self.ends)] {
            let pairs = || {
                longer
                    .iter()
                    .zip(shorter)
                    .filter(|(l, _)| l.shifted == shifted)
            };
            let squared = mean(pairs().map(|(l, s)| (l.value - s.value).powi(2)));
            let excess = (squared - variance * mean(pairs().map(|(l, s)| l.distance(s)))).max(0.0);
            *risk += excess / growth(order).powi(2);
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The next window of the ladder, an odd number of samples.
fn longer(window: usize) -> usize {
    ((window as f64 * RUNG).ceil() as usize) | 1
}

fn ladder(shortest: usize, longest: usize) -> Vec<usize> {
    let next = |w: &usize| Some(longer(*w));
    let rungs: Vec<usize> = std::iter::successors(Some(shortest | 1), next)
        .take_while(|w| *w <= longest)
        .collect();
    if rungs.is_empty() {
        vec![longest.max(1)]
    } else {
        rungs
    }
}

/// Signals that were estimated for one recording.
pub(super) struct Fitted {
    segments: Vec<Range<usize>>,
    q: Option<Vec<f64>>,
    qd: Option<Vec<f64>>,
    qdd: Option<Vec<f64>>,
    estimates: Vec<Estimate>,
}

impl Fitted {
    pub(super) fn of(recording: &Recording, options: &EstimateOptions) -> Result<Self> {
        let mut all = segments(&recording.t, options.gap);
        let longest = all.iter().map(Range::len).max().unwrap_or(0);
        if longest < SHORTEST {
            let what = format!(
                "trajectory '{}' (its longest piece without a gap)",
                recording.name
            );
            return Err(Error::TooShort {
                what,
                found: longest,
                needed: SHORTEST,
            });
        }
        all.retain(|s| s.len() >= SHORTEST);
        let mut fitted = Self {
            segments: all,
            q: None,
            qd: None,
            qdd: None,
            estimates: Vec::new(),
        };
        let (q, qd) = (
            (Source::Q, &recording.q),
            recording.qd.as_ref().map(|qd| (Source::Qd, qd)),
        );
        if options.smooth {
            fitted.q = Some(fitted.signal(recording, "q", &[(q, 0)], options));
        }
        match qd {
            None => fitted.qd = Some(fitted.signal(recording, "qd", &[(q, 1)], options)),
            Some(qd) if options.smooth => {
                fitted.qd = Some(fitted.signal(recording, "qd", &[(q, 1), (qd, 0)], options));
            }
            Some(_) => {}
        }
        if recording.qdd.is_none() && options.accelerations {
            let ways: Vec<_> = std::iter::once((q, 2))
                .chain(qd.map(|qd| (qd, 1)))
                .collect();
            fitted.qdd = Some(fitted.signal(recording, "qdd", &ways, options));
        }
        Ok(fitted)
    }

    /// Estimates one signal, each coordinate in the way that has the smallest risk.
    fn signal(
        &mut self,
        recording: &Recording,
        signal: &'static str,
        ways: &[((Source, &Vec<f64>), usize)],
        options: &EstimateOptions,
    ) -> Vec<f64> {
        let (len, n) = (recording.len(), recording.dof());
        let mut values = vec![0.0; len * n];
        for coordinate in 0..n {
            let choices = ways.iter().map(|((source, y), order)| {
                let series = Series {
                    t: &recording.t,
                    y,
                    n,
                    coordinate,
                };
                (
                    *source,
                    series,
                    choose(series, &self.segments, Filter::of_order(*order), options),
                )
            });
            let Some((source, series, choice)) =
                choices.min_by(|a, b| a.2.risk.total().total_cmp(&b.2.risk.total()))
            else {
                continue;
            };
            for segment in &self.segments {
                apply(series, choice, segment, &mut values);
            }
            self.estimates.push(Estimate {
                trajectory: recording.name.clone(),
                signal,
                coordinate: recording.coordinates.0[coordinate].name.clone(),
                source,
                degree: choice.filter.degree,
                window: choice.window,
                seconds: (choice.window - 1) as f64 * median_step(&recording.t),
                noise: choice.noise,
                standard_error: choice.standard_error(),
                standard_error_ends: choice.risk.ends.sqrt(),
                left_out: len - self.segments.iter().map(Range::len).sum::<usize>(),
            });
        }
        values
    }

    pub(super) fn into_trajectory(
        self,
        recording: Recording,
        options: &EstimateOptions,
    ) -> (Trajectory, Vec<Estimate>) {
        let n = recording.dof();
        let rows = |values: Vec<f64>, width: usize| -> Vec<f64> {
            if self.segments.len() == 1 && self.segments[0].len() * width == values.len() {
                return values;
            }
            self.segments
                .iter()
                .flat_map(|s| values[s.start * width..s.end * width].iter().copied())
                .collect()
        };
        let qdd = recording
            .qdd
            .or(self.qdd)
            .filter(|_| options.accelerations || self.estimates.is_empty());
        let trajectory = Trajectory {
            name: recording.name,
            t: rows(recording.t, 1),
            q: rows(self.q.unwrap_or(recording.q), n),
            qd: rows(self.qd.or(recording.qd).unwrap_or_default(), n),
            qdd: qdd.map(|s| rows(s, n)),
            tau: recording.tau.map(|s| rows(s, n)),
        };
        (trajectory, self.estimates)
    }
}

/// Writes the derivative at every sample of `segment` to its place in `values` `[len, n]`.
fn apply(series: Series<'_>, choice: Choice, segment: &Range<usize>, values: &mut [f64]) {
    let Series { n, coordinate, .. } = series;
    let rows = &mut values[segment.start * n..segment.end * n];
    rows.par_chunks_mut(n)
        .enumerate()
        .with_min_len(256)
        .for_each_init(Vec::new, |weights, (k, row)| {
            let k = segment.start + k;
            let window = around(k, choice.window, segment);
            choice
                .filter
                .weights(&series.t[window.clone()], series.t[k], weights);
            row[coordinate] = series.dot(window.start, weights);
        });
}

/// The derivative of one coordinate of q, with its window chosen, for a `check` of measured velocities.
pub(crate) fn velocity(series: Series<'_>, segments: &[Range<usize>]) -> (Vec<f64>, Choice) {
    let options = EstimateOptions::default();
    let choice = choose(series, segments, Filter::of_order(1), &options);
    let mut values = vec![f64::NAN; series.t.len()];
    let alone = Series {
        n: 1,
        coordinate: 0,
        ..series
    };
    let column: Vec<f64> = (0..series.t.len()).map(|k| series.value(k)).collect();
    for segment in segments {
        apply(
            Series {
                y: &column,
                ..alone
            },
            choice,
            segment,
            &mut values,
        );
    }
    (values, choice)
}
