//! Recordings for the regression: after a low-pass, cut into stretches.

use std::ops::Range;

use crate::delay::interpolated;
use crate::derivatives::GAP;
use crate::derivatives::acceleration_window;
use crate::local_polynomial::{Filter, Series, around, median_step, segments};
use crate::window::usual_noise_variance;
use crate::{EstimateOptions, Recording};
use lagrangian_motion::Trajectory;
use lagrangian_motion::statistics::{root_mean_square, variances};

/// Number of stretches that are omitted one after another.
pub(super) const STRETCHES: usize = 24;
/// Shortest stretch, samples.
const SHORTEST: usize = 20;
/// Largest number of samples that are used in all.
const SAMPLES: usize = 12_000;

/// A recording after a low-pass.
pub(super) struct Source {
    /// Index of the recording.
    index: usize,
    motion: Trajectory,
    segments: Vec<Range<usize>>,
}

impl Source {
    /// A recording whose stamps were repaired; `None` where it has no forces, or is too short for the filter.
    pub(super) fn new(index: usize, recording: &Recording, cutoff: Option<f64>) -> Option<Self> {
        let options = EstimateOptions {
            low_pass: cutoff,
            momenta: false,
            ..EstimateOptions::default()
        };
        recording.validate().ok()?;
        let (motion, _) = recording.clone().estimated(&options).ok()?;
        if motion.tau.is_empty() {
            return None;
        }
        let segments = segments(&motion.t, GAP);
        Some(Self {
            index,
            motion,
            segments,
        })
    }

    /// The length of its longest segment, s.
    pub(super) fn seconds(&self) -> f64 {
        let t = &self.motion.t;
        let lengths = self.segments.iter().map(|s| t[s.end - 1] - t[s.start]);
        lengths.fold(0.0, f64::max)
    }
}

/// Standard error of q̈ over its root mean square, for each coordinate of a recording, in the windows of smallest error.
pub(super) fn uncertainty(recording: &Recording) -> Vec<f64> {
    of_coordinates(recording, &recording.q, |series, pieces| {
        let best = acceleration_window(series, pieces);
        best.standard_error() / acceleration(series, pieces, best.window.max(7))
    })
}

/// Noise of the forces over their deviation, for each coordinate of a recording.
pub(super) fn force_noise(recording: &Recording) -> Vec<f64> {
    let noise = of_coordinates(recording, &recording.tau, |series, pieces| {
        usual_noise_variance(series, pieces)
    });
    let noise = noise
        .into_iter()
        .zip(variances(&recording.tau, recording.dof()));
    noise.map(|(noise, all)| (noise / all).sqrt()).collect()
}

/// A figure of each coordinate of a signal.
fn of_coordinates(
    recording: &Recording,
    signal: &[f64],
    figure: impl Fn(Series<'_>, &[Range<usize>]) -> f64,
) -> Vec<f64> {
    let pieces = segments(&recording.t, GAP);
    let own = |i| figure(Series::of(recording, signal, i), &pieces);
    (0..recording.dof()).map(own).collect()
}

/// Root mean square of q̈ in windows of this length.
fn acceleration(series: Series<'_>, pieces: &[Range<usize>], window: usize) -> f64 {
    let stride = (series.t.len() / 500).max(1);
    let places = pieces
        .iter()
        .flat_map(|s| s.clone().step_by(stride).map(move |k| (k, s)));
    let mut weights = Vec::new();
    root_mean_square(&mut places.map(|(k, s)| {
        let window = around(k, window, s);
        Filter::of_order(2).weights(&series.t[window.clone()], series.t[k], &mut weights);
        series.dot(window.start, &weights)
    }))
}

/// A stretch of a recording.
pub(super) struct Stretch<'a> {
    source: &'a Source,
    rows: Range<usize>,
    stride: usize,
}

/// Cuts all segments, without margins at their beginnings and ends, s, into stretches of consecutive samples.
pub(super) fn stretches<'a>(sources: &'a [Source], margins: [f64; 2]) -> Vec<Stretch<'a>> {
    let usable = |source: &'a Source| {
        let Source {
            motion, segments, ..
        } = source;
        let step = median_step(&motion.t);
        let [first, last] = margins.map(|margin| (margin / step).ceil() as usize);
        let inside = move |s: &Range<usize>| s.start + first..s.end.saturating_sub(last);
        segments.iter().map(inside).map(move |rows| (source, rows))
    };
    let mut pieces: Vec<(&'a Source, Range<usize>)> = sources.iter().flat_map(usable).collect();
    pieces.retain(|(_, rows)| rows.len() >= SHORTEST);
    let total: usize = pieces.iter().map(|(_, rows)| rows.len()).sum();
    let length = total.div_ceil(STRETCHES).max(SHORTEST);
    let stride = total.div_ceil(SAMPLES).max(1);
    let cut = |(source, rows): (_, Range<usize>)| {
        let count = (rows.len() / length).max(1);
        let own = rows.len() / count;
        (0..count).map(move |k| Stretch {
            source,
            rows: rows.start + k * own..rows.start + (k + 1) * own,
            stride,
        })
    };
    pieces.into_iter().flat_map(cut).collect()
}

/// Motion and forces of a stretch: q, q̇, q̈ `[m, n]`, and τ `[m, delays, n]` at each delay.
pub(super) struct Signals {
    /// Index of the recording.
    pub(super) source: usize,
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) qdd: Vec<f64>,
    pub(super) tau: Vec<f64>,
}

impl Signals {
    /// The number of delays.
    pub(super) fn delays(&self) -> usize {
        self.tau.len() / self.q.len()
    }
}

impl Stretch<'_> {
    /// The signals, with the forces at each of `delays`, s.
    pub(super) fn signals(&self, delays: &[f64]) -> Signals {
        let motion = &self.source.motion;
        let mut out = Signals {
            source: self.source.index,
            q: Vec::new(),
            qd: Vec::new(),
            qdd: Vec::new(),
            tau: Vec::new(),
        };
        for k in self.rows.clone().step_by(self.stride) {
            let row = motion.row(k);
            out.q.extend(row.q);
            out.qd.extend(row.qd);
            out.qdd.extend(row.qdd);
            for delay in delays {
                let at = motion.t[k] - delay;
                let force = |i| interpolated(&motion.t, &motion.tau, motion.dof(), i, at);
                out.tau.extend((0..motion.dof()).map(force));
            }
        }
        out
    }
}
