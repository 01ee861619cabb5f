//! Whether q̇ is the derivative of q.

use std::f64::consts::TAU;

use super::{Item, Verdict, time};
use crate::trajectory::derivatives::velocity;
use crate::trajectory::local_polynomial::{Series, median_step, segments};
use crate::trajectory::{Recording, Signal};

/// A lag is searched over this many samples in both directions.
const LONGEST_LAG: usize = 30;
/// Correlation below which q̇ is something else than the derivative of q.
const POOR: f64 = 0.5;
/// Correlation below which it is a poor measurement.
const FAIR: f64 = 0.9;
/// A slope may differ from 1 by this much.
const SLOPE: f64 = 0.1;
/// A lag that spoils this part of the velocity is worth a warning, if it is more than a sample.
const LAG_ERROR: f64 = 0.1;

/// How measured velocities `v` relate to the derivative `d` of the positions.
struct Relation {
    correlation: f64,
    /// v ≈ slope · d.
    slope: f64,
    /// v comes later by so many samples.
    lag: f64,
    /// What that lag does to v, as a part of v.
    lag_error: f64,
}

/// One item for each coordinate whose velocity was measured.
pub(super) fn items(recording: &Recording) -> Vec<Item> {
    let Some(qd) = recording.values(Signal::Qd) else {
        let finding = "not measured: it will be estimated from q";
        return vec![Item::pass("velocity", finding)];
    };
    let n = recording.dof();
    if recording.q.iter().chain(qd).any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let mut segments = segments(&recording.t, time::GAP);
    segments.retain(|s| s.len() >= 8);
    let item = |i: usize| {
        let series = Series {
            t: &recording.t,
            y: &recording.q,
            n,
            coordinate: i,
        };
        let (derivative, choice) = velocity(series, &segments);
        let measured: Vec<f64> = qd.iter().skip(i).step_by(n).copied().collect();
        let name = recording.columns.signals.qd.get(i);
        let name = name.map_or("qd", String::as_str);
        if rms(&derivative) <= (3.0 * choice.standard_error()).max(0.0) {
            let finding = format!("{name}: q hardly moves, so that they cannot be compared");
            return Item::pass("velocity", finding);
        }
        finding(recording, i, name, &relate(&measured, &derivative))
    };
    let compared = |i: &usize| !recording.coordinates.is_parameter(*i) && !segments.is_empty();
    (0..n).filter(compared).map(item).collect()
}

fn rms(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|x| x.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(s, c), x| (s + x * x, c + 1.0));
    match count > 0.0 {
        true => f64::sqrt(sum / count),
        false => 0.0,
    }
}

/// Σ over samples where both are known, of v shifted by `lag` samples against d: (⟨v d⟩, ⟨d d⟩, ⟨v v⟩).
fn moments(v: &[f64], d: &[f64], lag: isize) -> (f64, f64, f64) {
    let (skip_v, skip_d) = (lag.max(0).unsigned_abs(), (-lag).max(0).unsigned_abs());
    let pairs = v.iter().skip(skip_v).zip(d.iter().skip(skip_d));
    let known = pairs.filter(|(_, d)| d.is_finite());
    known.fold((0.0, 0.0, 0.0), |(vd, dd, vv), (v, d)| {
        (vd + v * d, dd + d * d, vv + v * v)
    })
}

fn correlation((vd, dd, vv): (f64, f64, f64)) -> f64 {
    match dd * vv > 0.0 {
        true => vd / (dd * vv).sqrt(),
        false => 0.0,
    }
}

fn relate(v: &[f64], d: &[f64]) -> Relation {
    let longest = LONGEST_LAG.min(v.len() / 4) as isize;
    let at = |lag: isize| correlation(moments(v, d, lag)).abs();
    let best = (-longest..=longest)
        .max_by(|a, b| at(*a).total_cmp(&at(*b)).then(b.abs().cmp(&a.abs())))
        .unwrap_or(0);
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
        correlation: correlation(m),
        slope: m.0 / m.1,
        lag,
        lag_error,
    }
}

/// The finding where the log holds differences.
const DIFFERENCES: &str = "it is the difference of successive positions, half a sample late: an estimate from q is less noisy";

/// Whether most velocities are Δq / Δt from the sample before to 2 %, and far nearer to it than to the slope through
/// both neighbours, which a true velocity is near.
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

const SECONDS: &str = "convert the column of time to seconds";
const SI: &str = "convert it to rad/s";

/// Slopes that reveal a unit: the slope, its meaning, the remedy.
#[rustfmt::skip]
const UNITS: [(f64, &str, &str); 7] = [
    (360.0 / TAU, "it is in degrees per second while q is in radians", SI),
    (TAU / 360.0, "q is in degrees while it is in radians per second", "convert q to radians"),
    (60.0 / TAU, "it is in revolutions per minute while q is in radians", SI),
    (1e3, "time looks like milliseconds", SECONDS),
    (1e6, "time looks like microseconds", SECONDS),
    (1e9, "time looks like nanoseconds", SECONDS),
    (-1.0, "its sign is opposite to that of q", "reverse one of the two signs"),
];

/// The item of a coordinate that moves.
fn finding(recording: &Recording, i: usize, name: &str, r: &Relation) -> Item {
    let seconds = r.lag * median_step(&recording.t);
    let q = &recording.coordinates.0[i].name;
    let finding = format!(
        "{name} = {:.4} · d{q}/dt, correlation {:.4}, lag {:.2} samples ({seconds:.4} s)",
        r.slope, r.correlation, r.lag
    );
    let unit = UNITS
        .iter()
        .find(|(slope, ..)| (r.slope / slope - 1.0).abs() < SLOPE && r.correlation.abs() > POOR);
    let pass = |meaning: &str| Item::pass("velocity", format!("{finding}: {meaning}"));
    let fail = |meaning, remedy| pass(meaning).with(Verdict::Fail, remedy);
    let warn = |meaning, remedy| pass(meaning).with(Verdict::Warn, remedy);
    let item = if let Some((_, meaning, remedy)) = unit {
        fail(meaning, *remedy)
    } else if r.correlation < POOR || !(0.5..2.0).contains(&r.slope) {
        let remedy = "name the right columns with `q` and `qd`, or omit qd and let it be estimated";
        fail("it is not the derivative of q", remedy)
    } else if (r.slope - 1.0).abs() > SLOPE || r.correlation < FAIR {
        let remedy = "omit it and let it be estimated from q";
        warn("it is a poor measurement of the derivative of q", remedy)
    } else if r.lag.abs() > 1.0 && r.lag_error > LAG_ERROR {
        let remedy =
            "it was probably filtered: omit it and let it be estimated from q, or shift it";
        warn("it is late or early", remedy)
    } else if successive_differences(recording, i) {
        pass(DIFFERENCES)
    } else {
        pass("it is the derivative of q")
    };
    item.value("slope", r.slope)
        .value("correlation", r.correlation)
        .value("lag_samples", r.lag)
        .value("lag_s", seconds)
}
