//! Recordings for the regression: cut into stretches, filtered onto one even grid.

use std::ops::Range;

use super::super::{CheckOptions, time};
use super::Certainty;
use crate::trajectory::derivatives::acceleration_window;
use crate::trajectory::local_polynomial::{Filter, Series, around, median_step, segments};
use crate::trajectory::{Recording, Signal};

/// Stretches that are omitted one after another.
const STRETCHES: usize = 24;
/// Longest stretch, steps of the grid.
const LONGEST: usize = 2500;
/// Samples of a stretch that are used.
const SAMPLES: usize = 600;

/// A recording that the regression uses.
pub(super) struct Source<'a> {
    pub(super) recording: &'a Recording,
    tau: &'a [f64],
    segments: Vec<Range<usize>>,
    /// Window of the polynomials, samples.
    window: usize,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        recording: &'a Recording,
        options: &CheckOptions,
    ) -> Option<(Self, Vec<Certainty>)> {
        let tau = recording.values(Signal::Tau)?;
        let n = recording.dof();
        let all = segments(&recording.t, time::GAP);
        let column = |i| Series {
            t: &recording.t,
            y: &recording.q,
            n,
            coordinate: i,
        };
        let chosen: Vec<_> = (0..n)
            .map(|i| acceleration_window(column(i), &all))
            .collect();
        let step = median_step(&recording.t);
        let window = match options.filter {
            Some(seconds) => (seconds / step).round() as usize | 1,
            None => chosen.iter().map(|c| c.window).max()?,
        };
        let source = Self {
            recording,
            tau,
            segments: all,
            window: window.max(7),
        };
        let certainty = (0..n).map(|i| {
            let choice = chosen[i];
            source.certainty(column(i), choice.window, choice.standard_error())
        });
        let certainty = certainty.collect();
        Some((source, certainty))
    }

    /// `best` is the window in which q̈ is known best, with the standard error `error`.
    fn certainty(&self, series: Series<'_>, best: usize, error: f64) -> Certainty {
        let mean = |order| {
            let mut weights = Vec::new();
            let stride = (self.recording.len() / 500).max(1);
            let places = self
                .segments
                .iter()
                .flat_map(|s| s.clone().step_by(stride).map(move |k| (k, s)));
            let squares = places.map(|(k, s)| {
                let window = around(k, self.window, s);
                let t = &series.t[window.clone()];
                Filter::of_order(order).weights(t, series.t[k], &mut weights);
                series.dot(window.start, &weights).powi(2)
            });
            let (sum, count) = squares.fold((0.0, 0.0), |(s, c), x| (s + x, c + 1.0));
            f64::sqrt(sum / count)
        };
        let (speed, acceleration) = (mean(1), mean(2));
        let quarter = 0.5 * std::f64::consts::PI * speed / acceleration;
        let settled = 1.5 * best as f64 * median_step(&self.recording.t);
        Certainty {
            error: error / acceleration,
            filter: quarter.min(settled),
        }
    }
}

/// A stretch on the grid: times, and the segment of the recording that it lies in.
pub(super) struct Stretch<'a> {
    source: &'a Source<'a>,
    segment: &'a Range<usize>,
    begin: f64,
    steps: usize,
}

/// Cuts all segments, less what filter and delays need at their ends, into stretches.
pub(super) fn stretches<'a>(
    sources: &'a [Source<'a>],
    step: f64,
    window: f64,
    shifts: usize,
) -> Vec<Stretch<'a>> {
    let usable = |source: &'a Source<'a>| {
        let t = &source.recording.t;
        let own = median_step(t);
        let margin = 0.5 * window * source.window as f64 * own + shifts as f64 * step;
        source.segments.iter().filter_map(move |segment| {
            let (begin, end) = (t[segment.start] + margin, t[segment.end - 1] - margin);
            let steps = ((end - begin) / step).floor();
            (steps >= 20.0).then_some((source, segment, begin, steps as usize))
        })
    };
    let pieces: Vec<_> = sources.iter().flat_map(usable).collect();
    let total: usize = pieces.iter().map(|p| p.3).sum();
    let length = total.div_ceil(STRETCHES).max(20);
    let cut = |(source, segment, begin, steps): (&'a Source<'a>, &'a Range<usize>, f64, usize)| {
        let count = (steps / length).max(1);
        let own = steps / count;
        (0..count).map(move |k| Stretch {
            source,
            segment,
            begin: begin + (k * own) as f64 * step,
            steps: own.min(LONGEST),
        })
    };
    pieces.into_iter().flat_map(cut).collect()
}

/// Motion and forces of a stretch: q, q̇, q̈ `[m, n]` at its samples, τ `[steps + 2 shifts, n]` on the grid.
pub(super) struct Signals {
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) qdd: Vec<f64>,
    pub(super) tau: Vec<f64>,
    pub(super) stride: usize,
}

impl Stretch<'_> {
    pub(super) fn signals(&self, n: usize, step: f64, window: f64, shifts: usize) -> Signals {
        let r = self.source.recording;
        let window = (self.source.window as f64 * window) as usize | 1;
        let stride = self.steps.div_ceil(SAMPLES).max(1);
        let mut weights = Vec::new();
        let mut at = |time: f64, y: &[f64], order: usize, out: &mut Vec<f64>| {
            let k = r.t.partition_point(|t| *t < time).min(r.len() - 1);
            let window = around(
                k.clamp(self.segment.start, self.segment.end - 1),
                window,
                self.segment,
            );
            let filter = Filter { order, degree: 4 };
            filter.weights(&r.t[window.clone()], time, &mut weights);
            for coordinate in 0..n {
                let series = Series {
                    t: &r.t,
                    y,
                    n,
                    coordinate,
                };
                out.push(series.dot(window.start, &weights));
            }
        };
        let (mut q, mut qd, mut qdd, mut tau) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for k in (0..self.steps).step_by(stride) {
            let time = self.begin + k as f64 * step;
            at(time, &r.q, 0, &mut q);
            at(time, &r.q, 1, &mut qd);
            at(time, &r.q, 2, &mut qdd);
        }
        for k in 0..self.steps + 2 * shifts {
            let time = self.begin + (k as f64 - shifts as f64) * step;
            at(time, self.source.tau, 0, &mut tau);
        }
        Signals {
            q,
            qd,
            qdd,
            tau,
            stride,
        }
    }
}
