//! Consistency of measured rates: q̇ against the derivative of q, and q̈ against that of q̇.

use std::f64::consts::TAU;
use std::ops::Range;

use super::pairs::Sums;
use super::{Item, Verdict};
use crate::Recording;
use crate::derivatives::GAP;
use crate::derivatives::velocity;
use crate::local_polynomial::{Series, median_step, segments};
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::{jackknife, root_mean_square, sort_by_number};

/// A lag is searched up to this many samples in both directions.
const LONGEST_LAG: usize = 30;
/// A lag that leaves at most this multiple of what the best one leaves unexplained is as good.
const PERIODIC: f64 = 4.0;
/// Correlation below which a rate is not the derivative.
const POOR: f64 = 0.5;
/// Correlation below which a rate is a poor measurement.
const FAIR: f64 = 0.9;
/// Correlation above which a rate is the derivative of another column.
const CLOSE: f64 = 0.98;
/// A slope matches a unit within this relative difference …
const UNIT: f64 = 0.1;
/// … and differs from 1 beyond this many standard errors and this part.
const ERRORS: f64 = 4.0;
const SLOPE: f64 = 0.02;
/// A lag that changes the rate by this part is worth a warning, if it is more than a sample.
const LAG_ERROR: f64 = 0.1;
/// Fraction of the samples, those with the least certain derivatives, that are not compared: at its peaks a motion may be
/// faster than its samples resolve.
const UNCERTAIN: f64 = 0.5;
/// A derivative can be compared if it is this many times its own error …
const KNOWN: f64 = 3.0;
/// … and shows a poor measurement if it is this many times its error.
const CERTAIN: f64 = 10.0;
/// Number of blocks of time that are omitted in turn for the standard error of a slope.
const BLOCKS: usize = 10;

/// A measured signal and the signal that it is the derivative of.
#[derive(Clone, Copy)]
struct Pair {
    item: &'static str,
    rate: Signal,
    of: Signal,
    units: &'static [Unit],
}

/// A slope that reveals a unit, its meaning, and the remedy.
type Unit = (f64, &'static str, &'static str);

#[rustfmt::skip]
const PAIRS: [Pair; 2] = [
    Pair { item: "velocity", rate: Signal::Qd, of: Signal::Q, units: &VELOCITIES },
    Pair { item: "derivative", rate: Signal::Qdd, of: Signal::Qd, units: &ACCELERATIONS },
];

const SECONDS: &str = "convert the column of time to seconds";

#[rustfmt::skip]
const VELOCITIES: [Unit; 7] = [
    (360.0 / TAU, "it is in degrees per second while q is in radians", "convert it to rad/s"),
    (TAU / 360.0, "q is in degrees while it is in radians per second", "convert q to radians"),
    (60.0 / TAU, "it is in revolutions per minute while q is in radians", "convert it to rad/s"),
    (1e3, "time looks like milliseconds", SECONDS),
    (1e6, "time looks like microseconds", SECONDS),
    (1e9, "time looks like nanoseconds", SECONDS),
    (-1.0, "its sign is opposite to that of q", "reverse one of the two signs"),
];

#[rustfmt::skip]
const ACCELERATIONS: [Unit; 5] = [
    (360.0 / TAU, "it is in degrees per second squared while q̇ is in radians per second", "convert it to rad/s²"),
    (TAU / 360.0, "q̇ is in degrees per second while it is in radians per second squared", "convert q̇ to rad/s"),
    (9.80665_f64.recip(), "it is in multiples of standard gravity", "convert it to m/s²"),
    (1e3, "time looks like milliseconds", SECONDS),
    (-1.0, "its sign is opposite to that of q̇", "reverse one of the two signs"),
];

/// Relation of a measured rate `v` to a derivative `d`.
struct Relation {
    correlation: f64,
    /// v ≈ slope · d, and the standard error of the slope.
    slope: f64,
    slope_error: f64,
    /// Lag of v behind d, samples.
    lag: f64,
    /// Relative change of v that the lag causes.
    lag_error: f64,
}

/// The derivatives of one signal.
struct Derivatives {
    /// For each coordinate: in the window that suits its noise, and over two steps, which suits an exact motion that is fast for its
    /// rate. First with NaN where they are least certain, then all: in a motion that mostly rests only the rest may be certain.
    values: Vec<[Vec<f64>; 4]>,
    /// Root mean square of each over its own error, from noise and from motion that is too fast for the samples.
    certainty: Vec<f64>,
}

/// One item for each rate that was measured.
pub(super) fn items(recording: &Recording, errors: f64) -> Vec<Item> {
    if recording.values(Signal::Qd).is_none() {
        let finding = "not measured: it will be estimated from q";
        return vec![Item::pass("velocity", finding)];
    }
    let of_pair = |pair| of_pair(recording, pair, errors);
    PAIRS.iter().flat_map(of_pair).collect()
}

fn of_pair(recording: &Recording, pair: &Pair, errors: f64) -> Vec<Item> {
    let (Some(rates), Some(values)) = (recording.values(pair.rate), recording.values(pair.of))
    else {
        return Vec::new();
    };
    if values.iter().chain(rates).any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let n = recording.dof();
    let Some(derivatives) = Derivatives::new(recording, values) else {
        return Vec::new();
    };
    let item = |i: usize| {
        let measured: Vec<f64> = rates.iter().skip(i).step_by(n).copied().collect();
        if derivatives.certainty[i] <= KNOWN {
            let (name, of) = (name(recording, pair.rate, i), name(recording, pair.of, i));
            let finding = format!("{name}: {of} hardly changes, so that they cannot be compared");
            return Item::pass(pair.item, finding);
        }
        finding(recording, pair, i, &measured, &derivatives, errors)
    };
    let compared = |i: &usize| !recording.coordinates.is_parameter(*i);
    (0..n).filter(compared).map(item).collect()
}

fn name(recording: &Recording, signal: Signal, i: usize) -> String {
    let names = recording.columns.signals.get(signal).get(i);
    names.map_or_else(|| format!("{}{}", signal.name(), i + 1), Clone::clone)
}

impl Derivatives {
    /// `None` where no piece of the time is long enough.
    fn new(recording: &Recording, values: &[f64]) -> Option<Self> {
        let mut segments = segments(&recording.t, GAP);
        segments.retain(|s| s.len() >= 8);
        segments.first()?;
        let mut all = Self {
            values: Vec::new(),
            certainty: Vec::new(),
        };
        for coordinate in 0..recording.dof() {
            let series = Series::of(recording, values, coordinate);
            let (derivative, choice) = velocity(series, &segments);
            let certainty = rms(&derivative) / choice.standard_error().max(f64::MIN_POSITIVE);
            all.certainty.push(certainty);
            let [smooth, sharp] = [derivative, slopes(series, &segments)];
            let mut certain = [smooth.clone(), sharp.clone()];
            omit_uncertain(series, &mut certain);
            let [certain_smooth, certain_sharp] = certain;
            all.values
                .push([certain_smooth, certain_sharp, smooth, sharp]);
        }
        Some(all)
    }

    /// Relation of `v` to that derivative of coordinate `i` which it is closer to.
    fn relation(&self, i: usize, v: &[f64]) -> Relation {
        let [first, others @ ..] = self.values[i].each_ref().map(|d| relate(v, d));
        let closer = |a: Relation, b: Relation| match b.correlation.abs() > a.correlation.abs() {
            true => b,
            false => a,
        };
        others.into_iter().fold(first, closer)
    }

    /// The coordinate, other than `i`, whose derivative `v` is.
    fn other(&self, i: usize, v: &[f64]) -> Option<usize> {
        let is = |j: &usize| {
            let relation = self.relation(*j, v);
            relation.correlation > CLOSE && (relation.slope - 1.0).abs() < UNIT
        };
        (0..self.values.len())
            .filter(|j| *j != i && self.certainty[*j] > KNOWN)
            .find(is)
    }
}

/// The slope at sample `k` over `steps` samples on both sides.
fn slope(series: Series<'_>, k: usize, steps: usize) -> f64 {
    let (a, b) = (k - steps, k + steps);
    (series.value(b) - series.value(a)) / (series.t[b] - series.t[a])
}

/// Slopes over two steps; NaN at the ends of segments.
fn slopes(series: Series<'_>, segments: &[Range<usize>]) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; series.t.len()];
    for segment in segments {
        let inner = segment.start + 1..segment.end - 1;
        let places = slopes[inner.clone()].iter_mut().zip(inner);
        places.for_each(|(x, k)| *x = slope(series, k, 1));
    }
    slopes
}

/// Sets derivatives to NaN at the samples where slopes over two and four steps differ most.
fn omit_uncertain(series: Series<'_>, derivatives: &mut [Vec<f64>; 2]) {
    let inner = 2..series.t.len().saturating_sub(2);
    let difference = |k: usize| (slope(series, k, 1) - slope(series, k, 2)).abs();
    let mut worst: Vec<(f64, usize)> = inner.map(|k| (difference(k), k)).collect();
    sort_by_number(&mut worst, |own| -own.0);
    let count = (UNCERTAIN * worst.len() as f64) as usize;
    for derivative in derivatives {
        let omitted = worst[..count].iter();
        omitted.for_each(|(_, k)| derivative[*k] = f64::NAN);
    }
}

fn rms(values: &[f64]) -> f64 {
    root_mean_square(&mut values.iter().copied().filter(|x| x.is_finite()))
}

/// Sums over the pairs (d, v) where both are known, with v shifted by `lag` samples.
fn moments(v: &[f64], d: &[f64], lag: isize) -> Sums {
    let (skip_v, skip_d) = (lag.max(0).unsigned_abs(), (-lag).max(0).unsigned_abs());
    let pairs = v.iter().skip(skip_v).zip(d.iter().skip(skip_d));
    let mut sums = Sums::default();
    let known = pairs.filter(|(_, d)| d.is_finite());
    known.for_each(|(v, d)| sums.add(*d, *v));
    sums
}

fn relate(v: &[f64], d: &[f64]) -> Relation {
    let longest = LONGEST_LAG.min(v.len() / 4) as isize;
    let at = |lag: isize| moments(v, d, lag).correlation().abs();
    let all: Vec<f64> = (-longest - 1..=longest + 1).map(at).collect();
    let at = |lag: isize| all[(lag + longest + 1).unsigned_abs()];
    let most = (-longest..=longest).map(at).fold(0.0, f64::max);
    // A periodic motion agrees with itself half a period later too: the least of the lags that are hardly worse is meant.
    let is_peak = |lag: &isize| at(*lag) >= at(lag - 1).max(at(lag + 1));
    let is_as_good = |lag: &isize| {
        let own = at(*lag);
        own > CLOSE && 1.0 - own.powi(2) <= PERIODIC * (1.0 - most.powi(2)) + 1e-12
    };
    let peaks = (-longest..=longest).filter(|lag| is_peak(lag) && is_as_good(lag));
    let first = peaks.min_by_key(|lag| lag.abs());
    let at_end = || (-longest..=longest).find(|lag| at(*lag) >= most);
    let best = first.or_else(at_end).unwrap_or(0);
    let (before, peak, after) = (at(best - 1), at(best), at(best + 1));
    let curvature = before - 2.0 * peak + after;
    // The vertex of the parabola through the three correlations.
    let fraction = if curvature < 0.0 {
        (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    let m = moments(v, d, best);
    let change: Vec<f64> = d.windows(2).map(|w| w[1] - w[0]).collect();
    let lag = best as f64 + fraction;
    let lag_error = lag.abs() * rms(&change) / rms(d);
    Relation {
        correlation: m.correlation(),
        slope: m.xy / m.xx,
        slope_error: slope_error(v, d, &m),
        lag,
        lag_error,
    }
}

/// Standard error of the slope, from omitting one block of time after another.
fn slope_error(v: &[f64], d: &[f64], all: &Sums) -> f64 {
    let block = v.len().div_ceil(BLOCKS).max(1);
    let without = |(v, d): (&[f64], &[f64])| {
        let part = moments(v, d, 0);
        (all.xy - part.xy) / (all.xx - part.xx)
    };
    let slopes: Vec<f64> = v.chunks(block).zip(d.chunks(block)).map(without).collect();
    jackknife(slopes.iter().copied())
}

/// Finding for a log of differences.
const DIFFERENCES: &str = "it is the difference of successive positions, half a sample late: an estimate from q is less noisy";

/// Whether most velocities are Δq / Δt from the previous sample to 2 %, and far nearer to it than to the slope through
/// both neighbours, which is near a true velocity.
fn successive_differences(recording: &Recording, i: usize) -> bool {
    let n = recording.dof();
    let Some(qd) = recording.values(Signal::Qd) else {
        return false;
    };
    let slope = |a: usize, b: usize| {
        (recording.q[b * n + i] - recording.q[a * n + i]) / (recording.t[b] - recording.t[a])
    };
    let (mut moving, mut equal) = (0, 0);
    for k in 1..recording.len().saturating_sub(1) {
        let (before, both) = (slope(k - 1, k), slope(k - 1, k + 1));
        if before.abs() > 0.0 {
            moving += 1;
            let off = (qd[k * n + i] - before).abs();
            let near = off < 0.02 * before.abs() && off < 0.2 * (qd[k * n + i] - both).abs();
            equal += usize::from(near);
        }
    }
    2 * equal > moving
}

/// The item for a coordinate that moves.
fn finding(
    recording: &Recording,
    pair: &Pair,
    i: usize,
    measured: &[f64],
    derivatives: &Derivatives,
    errors: f64,
) -> Item {
    let r = derivatives.relation(i, measured);
    let seconds = r.lag * median_step(&recording.t);
    let (rate, of) = (name(recording, pair.rate, i), name(recording, pair.of, i));
    let finding = format!(
        "{rate} = {:.4} · d{of}/dt, correlation {:.4}, lag {:.2} samples ({seconds:.4} s)",
        r.slope, r.correlation, r.lag
    );
    let units = pair.units.iter();
    let unit = units
        .filter(|_| r.correlation.abs() > POOR)
        .find(|(slope, ..)| (r.slope / slope - 1.0).abs() < UNIT);
    let off = (r.slope - 1.0).abs();
    let estimate = format!("omit {rate} and let it be estimated");
    let pass = |meaning: &str| Item::pass(pair.item, format!("{finding}: {meaning}"));
    let accuse = |verdict, meaning: &str, remedy: &str, size| {
        pass(meaning).with(verdict, remedy).claims(Some(i), size)
    };
    let item = if let Some((_, meaning, remedy)) = unit {
        accuse(Verdict::Fail, meaning, remedy, r.slope)
    } else if r.correlation < POOR || !(0.5..2.0).contains(&r.slope) {
        let other = derivatives.other(i, measured);
        let other = other.map(|j| name(recording, pair.of, j));
        let (meaning, remedy) = not_the_derivative(pair, other);
        accuse(Verdict::Fail, &meaning, &remedy, 1.0)
    } else if r.correlation < FAIR && derivatives.certainty[i] > CERTAIN {
        let meaning = format!("it is a poor measurement of the derivative of {of}");
        accuse(Verdict::Warn, &meaning, &estimate, 1.0)
    } else if r.correlation > FAIR && off > slope_bound(&r, derivatives.certainty[i], errors) {
        let percent = 100.0 * (r.slope - 1.0);
        let meaning = format!("it differs by {percent:.1} % from the derivative of {of}");
        let remedy = format!("check the scales of {rate} and {of}, or {estimate}");
        accuse(Verdict::Warn, &meaning, &remedy, r.slope - 1.0).in_doubt()
    } else if r.lag.abs() > 1.0 && r.lag_error > LAG_ERROR {
        let remedy = format!("it was probably filtered: {estimate}, or shift it");
        accuse(Verdict::Warn, "it is late or early", &remedy, r.lag)
    } else if pair.rate == Signal::Qd && successive_differences(recording, i) {
        pass(DIFFERENCES)
    } else {
        pass(&format!("it is the derivative of {of}"))
    };
    item.value("slope", r.slope)
        .value("slope_error", r.slope_error)
        .value("correlation", r.correlation)
        .value("lag_samples", r.lag)
        .value("lag_s", seconds)
}

/// Difference from 1 beyond which a slope is wrong: neither chance nor the error of the derivative itself explains it.
fn slope_bound(r: &Relation, certainty: f64, errors: f64) -> f64 {
    SLOPE
        .max(errors * ERRORS * r.slope_error)
        .max(errors * ERRORS / certainty)
}

/// The meaning and the remedy for a rate that is not the derivative, but perhaps that of another column.
fn not_the_derivative(pair: &Pair, other: Option<String>) -> (String, String) {
    let (flag, of) = (pair.rate.name(), pair.of.name());
    match other {
        None => (
            format!("it is not the derivative of {of}"),
            format!(
                "name the right columns with `{of}` and `{flag}`, or omit {flag} and let it be estimated"
            ),
        ),
        Some(other) => (
            format!("it is the derivative of {other}"),
            format!(
                "the columns are swapped: name them in the same order with `{of}` and `{flag}`"
            ),
        ),
    }
}
