//! Velocities and accelerations estimated from what was measured, with the window chosen from the data.

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;

use super::local_polynomial::{Filter, Series, around, median_step, segments};
use super::window::{Choice, choose};
use super::{Recording, Signals, Trajectory};
use crate::{Error, Result};

/// Fewer consecutive samples than this cannot be differentiated twice.
pub(crate) const SHORTEST: usize = 6;

/// How missing velocities and accelerations are estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateOptions {
    /// Estimate accelerations where they were not measured.
    pub accelerations: bool,
    /// Estimate the rates of momenta with them, where momenta are known; Hamiltonian networks alone read them.
    pub momenta: bool,
    /// Also replace measured q and q̇ by their local polynomial.
    pub smooth: bool,
    /// Replace all signals, τ too, by polynomials over windows of this length, s: the same band of frequencies of
    /// motion and forces, from q and τ alone. Half a window is omitted at each end.
    ///
    /// Where a small torque is the difference of a large inertial and a large gravity term, the noise of q̈ makes a
    /// fit shrink both; so it does where play and vibrations shake the encoders but not the drive.
    pub filter: Option<f64>,
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
            momenta: true,
            smooth: false,
            filter: None,
            window: None,
            longest_window: 401,
            gap: 5.0,
        }
    }
}

impl EstimateOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let window = self.window.unwrap_or(usize::MAX).min(self.longest_window);
        if window < SHORTEST {
            return Err(Error::argument("window", window, "at least 6 samples"));
        }
        if let Some(seconds) = self.filter
            && !(seconds.is_finite() && seconds > 0.0)
        {
            return Err(Error::argument(
                "filter",
                seconds,
                "a finite number of seconds above 0",
            ));
        }
        if self.gap.is_nan() || self.gap <= 1.0 {
            return Err(Error::argument(
                "gap",
                self.gap,
                "above 1 (in median steps)",
            ));
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
    /// The momenta.
    P,
    /// The forces.
    Tau,
}

/// How one signal was estimated, for the user to read.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// The trajectory.
    pub trajectory: String,
    /// `qd`, `qdd` or `pd`, or a measured signal that was smoothed.
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
    /// Samples that were omitted because too few are between two gaps.
    pub left_out: usize,
}

/// Signals that were estimated for one recording.
pub(super) struct Fitted {
    segments: Vec<Range<usize>>,
    /// Empty where a signal was not estimated.
    signals: Signals,
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
            return Err(Error::too_short(what, longest, SHORTEST));
        }
        all.retain(|s| s.len() >= SHORTEST);
        let mut fitted = Self {
            segments: all,
            signals: Signals::default(),
            estimates: Vec::new(),
        };
        if let Some(seconds) = options.filter {
            return fitted.filter(recording, seconds, options);
        }
        let q = (Source::Q, &recording.q);
        let qd = (Source::Qd, &recording.qd);
        let measured = !recording.qd.is_empty();
        if options.smooth {
            fitted.signals.q = fitted.signal(recording, "q", &[(q, 0)], options);
        }
        if !measured {
            fitted.signals.qd = fitted.signal(recording, "qd", &[(q, 1)], options);
        } else if options.smooth {
            fitted.signals.qd = fitted.signal(recording, "qd", &[(q, 1), (qd, 0)], options);
        }
        if recording.qdd.is_empty() && options.accelerations {
            let sources = [(q, 2), (qd, 1)];
            let sources = &sources[..if measured { 2 } else { 1 }];
            fitted.signals.qdd = fitted.signal(recording, "qdd", sources, options);
        }
        fitted.momenta(recording, options.smooth, options);
        Ok(fitted)
    }

    /// The rates of the momenta, and these too where they are smoothed.
    fn momenta(&mut self, recording: &Recording, smooth: bool, options: &EstimateOptions) {
        if recording.p.is_empty() || !options.momenta {
            return;
        }
        let p = (Source::P, &recording.p);
        if smooth {
            self.signals.p = self.signal(recording, "p", &[(p, 0)], options);
        }
        if options.accelerations {
            self.signals.pd = self.signal(recording, "pd", &[(p, 1)], options);
        }
    }

    /// All signals in the same windows; samples nearer to an end than half a window are omitted.
    fn filter(
        mut self,
        recording: &Recording,
        seconds: f64,
        options: &EstimateOptions,
    ) -> Result<Self> {
        let step = median_step(&recording.t);
        let half = ((0.5 * seconds / step).round() as usize).clamp(SHORTEST / 2, recording.len());
        let window = 2 * half + 1;
        let longest = self.segments.iter().map(Range::len).max().unwrap_or(0);
        if longest <= window {
            return Err(Error::too_short(
                format!(
                    "trajectory '{}', filtered over {seconds} s,",
                    recording.name
                ),
                longest,
                window + 1,
            ));
        }
        self.segments.retain(|s| s.len() > window);
        let options = EstimateOptions {
            window: Some(window),
            ..options.clone()
        };
        let q = (Source::Q, &recording.q);
        self.signals.q = self.signal(recording, "q", &[(q, 0)], &options);
        self.signals.qd = self.signal(recording, "qd", &[(q, 1)], &options);
        if options.accelerations {
            self.signals.qdd = self.signal(recording, "qdd", &[(q, 2)], &options);
        }
        self.momenta(recording, true, &options);
        if !recording.tau.is_empty() {
            let tau = (Source::Tau, &recording.tau);
            self.signals.tau = self.signal(recording, "tau", &[(tau, 0)], &options);
        }
        for segment in &mut self.segments {
            *segment = segment.start + half..segment.end - half;
        }
        let left_out = recording.len() - self.segments.iter().map(Range::len).sum::<usize>();
        for estimate in &mut self.estimates {
            estimate.left_out = left_out;
        }
        Ok(self)
    }

    /// Estimates one signal, each coordinate from the source with the smallest risk.
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
                let choice = choose(series, &self.segments, Filter::of_order(*order), options);
                (*source, series, choice)
            });
            let best = choices.min_by(|a, b| a.2.risk.total().total_cmp(&b.2.risk.total()));
            let Some((source, series, choice)) = best else {
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
            let whole = self.segments.len() == 1 && self.segments[0].len() * width == values.len();
            if whole || values.is_empty() {
                return values;
            }
            let part = |s: &Range<usize>| &values[s.start * width..s.end * width];
            self.segments.iter().flat_map(part).copied().collect()
        };
        let mut measured = recording.signals;
        if options.filter.is_some() {
            measured.qdd = Vec::new();
        }
        let mut signals = self.signals.or(measured);
        if !options.accelerations && !self.estimates.is_empty() {
            signals.qdd = Vec::new();
        }
        let trajectory = Trajectory {
            name: recording.name,
            t: rows(recording.t, 1),
            signals: signals.map(|_, values| rows(values, n)),
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
            let times = &series.t[window.clone()];
            choice.filter.weights(times, series.t[k], weights);
            row[coordinate] = series.dot(window.start, weights);
        });
}

/// The window in which the acceleration of one coordinate of q is known best.
pub(crate) fn acceleration_window(series: Series<'_>, segments: &[Range<usize>]) -> Choice {
    let options = EstimateOptions::default();
    choose(series, segments, Filter::of_order(2), &options)
}

/// The derivative of one coordinate of q, with its window chosen, for a `check` of measured velocities.
pub(crate) fn velocity(series: Series<'_>, segments: &[Range<usize>]) -> (Vec<f64>, Choice) {
    let options = EstimateOptions::default();
    let choice = choose(series, segments, Filter::of_order(1), &options);
    let mut values = vec![f64::NAN; series.t.len()];
    let column: Vec<f64> = (0..series.t.len()).map(|k| series.value(k)).collect();
    let alone = Series {
        t: series.t,
        y: &column,
        n: 1,
        coordinate: 0,
    };
    for segment in segments {
        apply(alone, choice, segment, &mut values);
    }
    (values, choice)
}
