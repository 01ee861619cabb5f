//! Velocities and accelerations estimated from the measured signals: by splines where they are smooth, else with windows chosen from
//! the data.

use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;
use serde::Serialize;

use super::Recording;
use super::local_polynomial::{Filter, Series, around, median_step, segments};
use super::low_pass::{self, LowPass};
use super::spline::{self, Motion};
use super::window::{Choice, choose, noise_variance};
use lagrangian_motion::{Error, Result};
use lagrangian_motion::{Signal, Signals, Trajectory};

/// Fewer consecutive samples than this cannot be differentiated twice.
pub(crate) const SHORTEST: usize = 6;

/// A step longer than this many median steps is a gap, across which nothing is estimated or interpolated.
pub(crate) const GAP: f64 = 5.0;

/// Options of the estimates of missing velocities and accelerations.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// Estimate accelerations where they were not measured.
    pub accelerations: bool,
    /// Also estimate the rates of momenta, where momenta are known; only Hamiltonian networks use them.
    pub momenta: bool,
    /// Also replace measured q and q̇ by their local polynomials.
    pub smooth: bool,
    /// Keep measured q and q̇ where their noise is white too; otherwise the smoothed ones take their place beside estimated q̈.
    pub raw: bool,
    /// Cut-off of a low-pass without phase for all signals, τ too, Hz: motion and forces keep the same band of frequencies.
    /// q̇ and q̈ are derivatives of q, or of a measured q̇ that is less noisy. Half a period of the cut-off is omitted at each end.
    ///
    /// If a small torque is the difference of a large inertial and a large gravity term, the noise of q̈ makes a
    /// fit shrink both; play and vibrations that move the encoders but not the drive have the same effect.
    pub low_pass: Option<f64>,
    /// The recordings are among others that are smooth ([`are_smooth`]): fast motions are not taken for noise.
    pub clean: bool,
    /// Use this window, in samples, instead of what suits the data.
    pub window: Option<usize>,
    /// The longest window that may be chosen, in samples.
    pub longest_window: usize,
    /// No window crosses a step in time longer than this many median steps.
    pub gap: f64,
}

impl Default for EstimateOptions {
    fn default() -> Self {
        Self {
            accelerations: true,
            momenta: true,
            smooth: false,
            raw: false,
            low_pass: None,
            clean: false,
            window: None,
            longest_window: 401,
            gap: GAP,
        }
    }
}

impl EstimateOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let window = self.window.unwrap_or(usize::MAX).min(self.longest_window);
        let cutoff = self.low_pass.unwrap_or(1.0);
        if window < SHORTEST {
            return Err(Error::argument("window", window, "at least 6 samples"));
        }
        if !(cutoff.is_finite() && cutoff > 0.0) {
            let must = "a finite number of Hz above 0";
            return Err(Error::argument("low_pass", cutoff, must));
        }
        match self.gap > 1.0 {
            true => Ok(()),
            false => Err(Error::argument(
                "gap",
                self.gap,
                "above 1 (in median steps)",
            )),
        }
    }
}

/// Source of an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The coordinates.
    Q,
    /// The measured velocities.
    Qd,
    /// The momenta.
    P,
    /// The forces.
    Tau,
}

/// Report of the estimate of one signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// The trajectory.
    pub trajectory: String,
    /// `qd`, `qdd` or `pd`, or a measured signal that was smoothed.
    pub signal: &'static str,
    /// Name of the coordinate.
    pub coordinate: String,
    /// The signal that it was made from.
    pub source: Source,
    /// Length of the window, samples.
    pub window: usize,
    /// Length of the window, s.
    pub seconds: f64,
    /// Standard deviation of the noise found in the source, in the source's unit.
    pub noise: f64,
    /// Estimated standard error of the signal (noise and bias) in its unit, root mean square over all samples except
    /// the half windows at the ends and beside gaps.
    pub standard_error: f64,
    /// Standard error in those half windows, where it is larger, and itself less certain.
    pub standard_error_ends: f64,
    /// Number of samples that were omitted because too few are between two gaps.
    pub left_out: usize,
    /// Whether the whole recording tells it, by a spline or a smoother with an error for each sample, instead of windows or a low-pass.
    pub whole: bool,
}

/// The sources of signals through a low-pass, each with itself and its derivatives.
const WAYS: [(Source, &[Signal]); 4] = [
    (Source::Q, &[Signal::Q, Signal::Qd, Signal::Qdd]),
    (Source::Qd, &[Signal::Qd, Signal::Qdd]),
    (Source::Tau, &[Signal::Tau]),
    (Source::P, &[Signal::P, Signal::Pd]),
];

/// A coordinate that is smooth, and the measured signal that tells most of it.
struct Spline {
    source: Source,
    motion: Motion,
}

/// Signals that were estimated for one recording.
pub(super) struct Fitted {
    segments: Vec<Range<usize>>,
    /// Empty where a signal was not estimated.
    signals: Signals,
    /// Standard errors of the states, `[len, n]`; empty where they are not known.
    errors: Signals,
    estimates: Vec<Estimate>,
}

/// The motions of more coordinates are estimated by local polynomials, which take a fraction of the time.
const MOST_SPLINES: usize = 24;

/// Of many coordinates, the windows are chosen for some, each of this many, and hold for those that follow.
fn every_of(coordinates: usize) -> usize {
    coordinates.div_ceil(MOST_SPLINES).max(1)
}

impl Fitted {
    pub(super) fn of(recording: &Recording, options: &EstimateOptions) -> Result<Self> {
        let mut all = segments(&recording.t, options.gap);
        let longest = all.iter().map(Range::len).max().unwrap_or(0);
        if longest < SHORTEST {
            let name = &recording.name;
            let what = format!("trajectory '{name}' (its longest piece without a gap)");
            return Err(Error::too_short(what, longest, SHORTEST));
        }
        all.retain(|s| s.len() >= SHORTEST);
        let mut fitted = Self {
            segments: all,
            signals: Signals::default(),
            errors: Signals::default(),
            estimates: Vec::new(),
        };
        if let Some(cutoff) = options.low_pass {
            return fitted.low_pass(recording, cutoff, options);
        }
        let q = (Source::Q, &recording.q);
        let qd = (Source::Qd, &recording.qd);
        let measured = !recording.qd.is_empty();
        let accelerations = recording.qdd.is_empty() && options.accelerations;
        let splines = match options.smooth || !measured || accelerations {
            true => fitted.splines(recording, q, measured.then_some(qd.1), options),
            false => Vec::new(),
        };
        let sources = |orders: [usize; 2]| {
            let all = [(q, orders[0]), (qd, orders[1])];
            all[..if measured { 2 } else { 1 }].to_vec()
        };
        if options.smooth || accelerations && !options.raw {
            fitted.signal(recording, Signal::Q, &[(q, 0)], &splines, options);
            fitted.signal(recording, Signal::Qd, &sources([1, 0]), &splines, options);
        } else if !measured {
            fitted.signal(recording, Signal::Qd, &[(q, 1)], &splines, options);
        }
        if accelerations {
            fitted.signal(recording, Signal::Qdd, &sources([2, 1]), &splines, options);
        }
        fitted.momenta(recording, options.smooth, options);
        fitted.finite(recording)
    }

    /// Refuses values whose derivatives are beyond the range of numbers.
    fn finite(self, recording: &Recording) -> Result<Self> {
        let not_finite = |values: &[f64]| values.iter().position(|x| !x.is_finite());
        let first = |(signal, values): (Signal, &Vec<f64>)| Some((signal, not_finite(values)?));
        let Some((signal, at)) = self.signals.iter().find_map(first) else {
            return Ok(self);
        };
        let n = recording.dof();
        let finding = format!("the estimate of {} there is not finite", signal.name());
        let column = &recording.columns.signals.q[at % n];
        Err(recording.sample(at / n, column, finding, Recording::REPAIR))
    }

    /// Estimates the rates of the momenta, and the momenta too where they are smoothed.
    fn momenta(&mut self, recording: &Recording, smooth: bool, options: &EstimateOptions) {
        if recording.p.is_empty() || !options.momenta {
            return;
        }
        let p = (Source::P, &recording.p);
        let splines = self.splines(recording, p, None, options);
        if smooth {
            self.signal(recording, Signal::P, &[(p, 0)], &splines, options);
        }
        if options.accelerations {
            self.signal(recording, Signal::Pd, &[(p, 1)], &splines, options);
        }
    }

    /// The spline of each coordinate that is smooth enough for one, from values and perhaps rates `[len, n]`.
    fn splines(
        &self,
        recording: &Recording,
        (source, values): (Source, &Vec<f64>),
        rates: Option<&Vec<f64>>,
        options: &EstimateOptions,
    ) -> Vec<Option<Spline>> {
        let n = recording.dof();
        let spline = |c: usize| {
            let rates = rates.map(|rates| column(rates, n, c));
            let (t, values) = (&recording.t, column(values, n, c));
            let motion = spline::estimate(t, values, rates, &self.segments, options.clean)?;
            let source = match motion.with_rates {
                true => Source::Qd,
                false => source,
            };
            Some(Spline { source, motion })
        };
        if options.window.is_some() || n > MOST_SPLINES {
            return (0..n).map(|_| None).collect();
        }
        (0..n).into_par_iter().map(spline).collect()
    }

    /// Estimates all signals by the same low-pass; samples near the ends are omitted.
    fn low_pass(
        mut self,
        recording: &Recording,
        cutoff: f64,
        options: &EstimateOptions,
    ) -> Result<Self> {
        let step = median_step(&recording.t);
        let (name, rate) = (&recording.name, 1.0 / step);
        if cutoff * step > low_pass::HIGHEST {
            let value = format!("{cutoff} Hz for trajectory '{name}', sampled at {rate:.4} Hz");
            let must = "at most 0.35 of the sampling rate";
            return Err(Error::argument("low_pass", value, must));
        }
        let margin = LowPass::margin(cutoff, step);
        let shortest = margin.saturating_mul(2).saturating_add(SHORTEST);
        let longest = self.segments.iter().map(Range::len).max().unwrap_or(0);
        if longest < shortest {
            let what = format!("trajectory '{name}', after a low-pass of {cutoff} Hz,");
            return Err(Error::too_short(what, longest, shortest));
        }
        self.segments.retain(|s| s.len() >= shortest);
        let filter = |s: &Range<usize>| LowPass::new(cutoff, &recording.t[s.clone()]);
        let filters: Vec<LowPass> = self.segments.iter().map(filter).collect();
        let is_used = |way: &&(Source, _)| way.0 != Source::P || options.momenta;
        for (source, signals) in WAYS.iter().filter(is_used) {
            self.pass(recording, &filters, *source, signals);
        }
        if !options.accelerations {
            self.signals.qdd.clear();
            self.signals.pd.clear();
            self.estimates
                .retain(|e| !["qdd", "pd"].contains(&e.signal));
        }
        for segment in &mut self.segments {
            *segment = segment.start + margin..segment.end - margin;
        }
        let left_out = self.left_out(recording);
        for estimate in &mut self.estimates {
            estimate.left_out = left_out;
        }
        self.finite(recording)
    }

    /// Filters one measured signal, and uses its derivatives for signals without a better estimate, coordinate by
    /// coordinate.
    fn pass(
        &mut self,
        recording: &Recording,
        filters: &[LowPass],
        source: Source,
        signals: &[Signal],
    ) {
        let Some(measured) = recording.values(signals[0]) else {
            return;
        };
        let (n, step) = (recording.dof(), median_step(&recording.t));
        let cutoff = filters.first().map_or(1.0, LowPass::cutoff);
        let damped = LowPass::noise(cutoff, step);
        for coordinate in 0..n {
            let series = Series::of(recording, measured, coordinate);
            let noise = self.noise(series);
            let name = &recording.coordinates.0[coordinate].name;
            let mut better = Vec::new();
            for (order, signal) in signals.iter().enumerate() {
                let standard_error = noise * damped[order];
                let same = |e: &Estimate| e.signal == signal.name() && e.coordinate == *name;
                let known = self.estimates.iter().position(same);
                if known.is_some_and(|k| self.estimates[k].standard_error <= standard_error) {
                    continue;
                }
                known.map(|k| self.estimates.remove(k));
                better.push((order, *signal));
                self.estimates.push(Estimate {
                    trajectory: recording.name.clone(),
                    signal: signal.name(),
                    coordinate: name.clone(),
                    source,
                    window: 2 * LowPass::margin(cutoff, step) + 1,
                    seconds: 1.0 / cutoff,
                    noise,
                    standard_error,
                    standard_error_ends: standard_error,
                    left_out: 0,
                    whole: false,
                });
            }
            for (segment, filter) in self.segments.iter().zip(filters) {
                let y: Vec<f64> = segment.clone().map(|k| series.value(k)).collect();
                let own = filter.apply(&y);
                let own = [own.value, own.first, own.second];
                for (order, signal) in &better {
                    let values = self.signals.get_mut(*signal);
                    values.resize(measured.len(), 0.0);
                    for (k, x) in segment.clone().zip(&own[*order]) {
                        values[k * n + coordinate] = *x;
                    }
                }
            }
        }
    }

    fn left_out(&self, recording: &Recording) -> usize {
        recording.len() - self.segments.iter().map(Range::len).sum::<usize>()
    }

    /// Estimates one signal, each coordinate from the source with the smallest risk. A measured one stays where nothing is better.
    fn signal(
        &mut self,
        recording: &Recording,
        signal: Signal,
        ways: &[((Source, &Vec<f64>), usize)],
        splines: &[Option<Spline>],
        options: &EstimateOptions,
    ) {
        let n = recording.dof();
        let measured = recording.values(signal).filter(|_| !options.smooth);
        let order = ways[0].1;
        let better =
            |own: &Option<Spline>| own.as_ref().is_some_and(|own| own.motion.is_better(order));
        if measured.is_some() && !splines.iter().any(better) {
            return;
        }
        let [mut values, mut standard_errors] = [0.0, 0.0].map(|x| vec![x; recording.len() * n]);
        let step = median_step(&recording.t);
        let mut chosen: Option<(Source, Choice)> = None;
        for (coordinate, spline) in splines.iter().enumerate() {
            let estimate = |source, window: usize, noise, [inside, ends]: [f64; 2]| Estimate {
                trajectory: recording.name.clone(),
                signal: signal.name(),
                coordinate: recording.coordinates.0[coordinate].name.clone(),
                source,
                window,
                seconds: (window - 1) as f64 * step,
                noise,
                standard_error: inside,
                standard_error_ends: ends,
                left_out: self.left_out(recording),
                whole: spline.is_some(),
            };
            if let Some(measured) = measured.filter(|_| !better(spline)) {
                let noise = self.noise(Series::of(recording, measured, coordinate));
                let rows = (coordinate..measured.len()).step_by(n);
                rows.for_each(|at| (values[at], standard_errors[at]) = (measured[at], noise));
                continue;
            }
            if let Some(Spline { source, motion }) = spline {
                motion.write(order, (coordinate, n), [&mut values, &mut standard_errors]);
                let errors = motion.errors(order, &self.segments);
                (self.estimates).push(estimate(*source, motion.window, motion.noise, errors));
                continue;
            }
            let ways = ways.iter().map(|((source, y), order)| {
                let series = Series::of(recording, y, coordinate);
                ((*source, series), *order)
            });
            let known = chosen.filter(|_| coordinate % every_of(n) > 0);
            let out = (&mut values[..], &mut standard_errors[..]);
            chosen = self.by_window(ways, known, options, out);
            let own = chosen.map(|(source, choice)| {
                estimate(source, choice.window, choice.noise, choice.errors())
            });
            self.estimates.extend(own);
        }
        *self.signals.get_mut(signal) = values;
        *self.errors.get_mut(signal) = standard_errors;
    }

    /// The deviation of the noise of a measured coordinate.
    fn noise(&self, series: Series<'_>) -> f64 {
        noise_variance(series, &self.segments, 3, 8).sqrt()
    }

    /// Writes the local polynomials of the source with the smallest risk, or of a known one, and their errors, `[len, n]`.
    fn by_window<'a>(
        &self,
        mut ways: impl Iterator<Item = ((Source, Series<'a>), usize)>,
        known: Option<(Source, Choice)>,
        options: &EstimateOptions,
        (values, standard_errors): (&mut [f64], &mut [f64]),
    ) -> Option<(Source, Choice)> {
        let (source, series, choice) = match known {
            Some((source, choice)) => {
                let ((_, series), _) = ways.find(|((own, _), _)| *own == source)?;
                (source, series, choice)
            }
            None => {
                let choices = ways.map(|((source, series), order)| {
                    let choice = choose(series, &self.segments, Filter::of_order(order), options);
                    (source, series, choice)
                });
                choices.min_by(|a, b| a.2.risk.total().total_cmp(&b.2.risk.total()))?
            }
        };
        let errors = choice.errors();
        for segment in &self.segments {
            apply(series, choice, segment, values);
            for k in segment.clone() {
                let beside = (k - segment.start).min(segment.end - 1 - k);
                let at_end = usize::from(beside < choice.window / 2);
                standard_errors[k * series.n + series.coordinate] = errors[at_end];
            }
        }
        Some((source, choice))
    }

    /// Replaces the estimates of parameters by their constant values.
    pub(super) fn hold(&mut self, recording: &Recording) {
        let n = recording.dof();
        for i in recording.coordinates.parameters() {
            let Signals { q, qd, qdd, .. } = &mut self.signals;
            for (signal, value) in [(q, recording.q[i]), (qd, 0.0), (qdd, 0.0)] {
                let column = signal.iter_mut().skip(i).step_by(n);
                column.for_each(|x| *x = value);
            }
            let name = &recording.coordinates.0[i].name;
            self.estimates.retain(|e| e.coordinate != *name);
        }
    }

    pub(super) fn into_trajectory(
        self,
        recording: Recording,
        options: &EstimateOptions,
    ) -> (Trajectory, Vec<Estimate>) {
        let n = recording.dof();
        let rows = |values: Vec<f64>, width: usize| -> Vec<f64> {
            let whole = self.segments.len() == 1 && self.segments[0].len() * width == values.len();
            if whole || values.is_empty() {
                return values;
            }
            let part = |s: &Range<usize>| &values[s.start * width..s.end * width];
            self.segments.iter().flat_map(part).copied().collect()
        };
        let mut measured = recording.signals;
        if options.low_pass.is_some() {
            measured.qdd = Vec::new();
        }
        let smoothed = |signal: Signal| {
            let own = [Signal::Q, Signal::Qd].contains(&signal) && options.low_pass.is_none();
            own && self.signals.values(signal).is_some() && !options.smooth
        };
        let kept = measured.as_ref().map(|signal, own| match smoothed(signal) {
            true => rows(own.clone(), n),
            false => Vec::new(),
        });
        let mut signals = self.signals.or(measured);
        if !options.accelerations && !self.estimates.is_empty() {
            signals.qdd = Vec::new();
        }
        let trajectory = Trajectory {
            name: recording.name,
            t: rows(recording.t, 1),
            signals: signals.map(|_, values| rows(values, n)),
            errors: self.errors.map(|_, values| rows(values, n)),
            measured: kept,
            spreading: low_pass::spreading(options.low_pass),
        };
        (trajectory, self.estimates)
    }
}

/// One coordinate of `[len, n]`.
fn column(y: &[f64], n: usize, coordinate: usize) -> Vec<f64> {
    y.iter().skip(coordinate).step_by(n).copied().collect()
}

/// Whether at least half of the coordinates of all recordings have no noise to speak of: neighbours predict a sample far better
/// than every other sample does.
#[must_use]
pub fn are_smooth(recordings: &[Recording], options: &EstimateOptions) -> bool {
    let smooth = |recording: &Recording| -> Vec<bool> {
        let recording = recording.repaired();
        let segments = segments(&recording.t, options.gap);
        let n = recording.dof();
        let one = |c| spline::is_smooth(&recording.t, column(&recording.q, n, c), &segments);
        (0..n).step_by(every_of(n)).map(one).collect()
    };
    let usable = recordings.par_iter().filter(|r| r.validate().is_ok());
    let all: Vec<bool> = usable.flat_map_iter(smooth).collect();
    2 * all.iter().filter(|smooth| **smooth).count() >= all.len().max(1)
}

/// Writes the derivative at every sample of `segment` to its index in `values` `[len, n]`.
fn apply(series: Series<'_>, choice: Choice, segment: &Range<usize>, values: &mut [f64]) {
    let Series { n, coordinate, .. } = series;
    let rows = &mut values[segment.start * n..segment.end * n];
    rows.par_chunks_mut(n)
        .enumerate()
        .with_min_len(256)
        .for_each_init(Vec::new, |weights, (k, row)| {
            let k = segment.start + k;
            let window = around(k, choice.window, segment);
            let times = &series.t[window.clone()];
            choice.filter.weights(times, series.t[k], weights);
            row[coordinate] = series.dot(window.start, weights);
        });
}

/// The window with the smallest error of the acceleration of one coordinate of q.
pub(crate) fn acceleration_window(series: Series<'_>, segments: &[Range<usize>]) -> Choice {
    let options = EstimateOptions::default();
    choose(series, segments, Filter::of_order(2), &options)
}

/// The derivative of one coordinate of q in the chosen window, for a `check` of measured velocities.
pub(crate) fn velocity(series: Series<'_>, segments: &[Range<usize>]) -> (Vec<f64>, Choice) {
    let options = EstimateOptions::default();
    let choice = choose(series, segments, Filter::of_order(1), &options);
    let mut values = vec![f64::NAN; series.t.len()];
    let alone = Series {
        y: &column(series.y, series.n, series.coordinate),
        n: 1,
        coordinate: 0,
        ..series
    };
    for segment in segments {
        apply(alone, choice, segment, &mut values);
    }
    (values, choice)
}
