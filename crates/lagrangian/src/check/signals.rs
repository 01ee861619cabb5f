//! Each signal by itself: finite, moving, jumps, noise, quantisation, saturation, repeats.

use std::f64::consts::TAU;

use super::{Item, time};
use crate::trajectory::Recording;
use crate::trajectory::local_polynomial::{Series, median, median_step, segments};
use crate::trajectory::window::noise_variance;

/// A coordinate declared as an angle that turns more often than this may be in degrees.
const MANY_TURNS: f64 = 15.0;
/// A jump is so many times the usual deviation from the neighbours …
const JUMP: f64 = 30.0;
/// … and at least this part of the range.
const SMALLEST_JUMP: f64 = 0.05;
/// Noise above this part of a signal's standard deviation is much.
const MUCH_NOISE: f64 = 0.3;
/// Fewer steps than this across the range are coarse.
const COARSE_LEVELS: f64 = 50.0;
/// More samples than this at the extreme value are a saturated signal.
const MUCH_SATURATION: f64 = 0.05;
/// More moving samples than this that repeat the row before are a stuck sensor.
const MANY_REPEATS: f64 = 0.02;

/// A force that deviates from its mean by less than this part of it is practically constant.
const HARDLY_CHANGES: f64 = 0.05;
/// A force below this part of the largest is that of a passive joint, or nearly.
const WEAK: f64 = 0.25;

/// One column of a recording.
struct Column<'a> {
    signal: &'static str,
    name: &'a str,
    coordinate: usize,
    n: usize,
    values: &'a [f64],
}

impl Column<'_> {
    fn iter(&self) -> impl Iterator<Item = f64> {
        self.values
            .iter()
            .skip(self.coordinate)
            .step_by(self.n)
            .copied()
    }

    fn range(&self) -> (f64, f64) {
        self.iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            })
    }

    fn deviation(&self) -> f64 {
        let len = self.iter().count().max(1) as f64;
        let mean = self.iter().sum::<f64>() / len;
        (self.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / len).sqrt()
    }
}

fn columns(recording: &Recording) -> Vec<Column<'_>> {
    let n = recording.dof();
    let signals = recording.known();
    signals
        .flat_map(|(signal, values)| {
            let names = recording.columns.signals.get(signal);
            (0..n).map(move |coordinate| {
                let name = names.get(coordinate).map_or(signal.name(), String::as_str);
                Column {
                    signal: signal.name(),
                    name,
                    coordinate,
                    n,
                    values,
                }
            })
        })
        // A force without a column is 0 by declaration.
        .filter(|column| !column.name.is_empty())
        .collect()
}

/// Whether each coordinate moves in any of the recordings: about all of them together.
pub(super) fn excitation(recordings: &[Recording]) -> Option<Item> {
    let first = recordings.first()?;
    let still = |i: &usize| {
        let moves = |r: &Recording| {
            let column = Column {
                signal: "q",
                name: "",
                coordinate: *i,
                n: r.dof(),
                values: &r.q,
            };
            let (low, high) = column.range();
            // A parameter is constant along a motion: what counts is that motions differ.
            high > low || (first.coordinates.is_parameter(*i) && r.q.get(*i) != first.q.get(*i))
        };
        !recordings
            .iter()
            .filter(|r| *i < r.dof() && !r.is_empty())
            .any(moves)
    };
    let still: Vec<&str> = (0..first.dof())
        .filter(still)
        .map(|i| first.coordinates.0[i].name.as_str())
        .collect();
    let forces = recordings.iter().filter(|r| !r.tau.is_empty()).count();
    let moving = first.dof() - first.coordinates.parameters().count();
    let moves = |name: &&str| {
        let same = |i: usize| first.coordinates.0[i].name == *name;
        !first.coordinates.parameters().any(same)
    };
    Some(
        if still.iter().filter(|name| moves(name)).count() == moving {
            Item::fail(
                "excitation",
                "no coordinate moves",
                "record a motion, or name the right columns with `q`",
            )
        } else if !still.is_empty() {
            let finding = format!("{} never moves", still.join(", "));
            Item::warn(
                "excitation",
                finding,
                "leave it out with `q`, or excite it: nothing about it can be learned",
            )
        } else {
            let finding = format!(
                "every coordinate moves; {forces} of {} recordings have forces",
                recordings.len()
            );
            Item::pass("excitation", finding)
        },
    )
}

/// Items that need no usable time stamps.
pub(super) fn items(recording: &Recording) -> Vec<Item> {
    let columns = columns(recording);
    let mut items = vec![finite(&columns), ranges(recording, &columns)];
    items.extend(saturation(&columns));
    items
}

/// Items that need usable time stamps.
pub(super) fn sampled_items(recording: &Recording) -> Vec<Item> {
    let columns = columns(recording);
    if columns.iter().any(|c| c.iter().any(|x| !x.is_finite())) {
        return Vec::new();
    }
    let steps: Vec<f64> = columns.iter().map(quantisation_step).collect();
    let mut items = vec![wraps(recording)];
    items.extend(
        columns
            .iter()
            .filter(|c| c.signal == "q")
            .filter_map(|c| jumps(recording, c)),
    );
    items.push(repeats(recording, &steps));
    items.push(noise(recording, &columns));
    items.push(quantisation(&columns, &steps));
    items
}

/// No signal of a machine is larger; its square is still a number.
const LARGEST: f64 = 1e100;

fn finite(columns: &[Column<'_>]) -> Item {
    let usable = |x: &f64| x.abs() <= LARGEST;
    let bad = |c: &&Column<'_>| c.iter().any(|x| !usable(&x));
    let total: usize = columns
        .iter()
        .map(|c| c.iter().filter(|x| !usable(x)).count())
        .sum();
    let item = match columns.iter().find(bad) {
        None => Item::pass("finite", "all values are finite"),
        Some(c) => {
            let row = c.iter().position(|x| !usable(&x)).unwrap_or(0) + 1;
            let finding = format!(
                "{total} values are NaN, infinite, above 1e100 or empty, first in column '{}' at sample {row}",
                c.name
            );
            Item::fail("finite", finding, "remove or repair those rows")
        }
    };
    item.value("not_finite", total as f64)
}

/// A figure that stays readable whatever its size.
fn short(x: f64) -> String {
    if x.abs() < 1e6 {
        format!("{x:.4}")
    } else {
        format!("{x:.4e}")
    }
}

fn ranges(recording: &Recording, columns: &[Column<'_>]) -> Item {
    let mut texts = Vec::new();
    let mut item = Item::pass("range", "");
    for c in columns {
        let (low, high) = c.range();
        texts.push(format!("{} {} … {}", c.name, short(low), short(high)));
        item = item
            .value(format!("{}_min", c.name), low)
            .value(format!("{}_max", c.name), high);
        let turns = (high - low) / TAU;
        if c.signal == "q" && recording.coordinates.is_circle(c.coordinate) && turns > MANY_TURNS {
            item.verdict = super::Verdict::Warn;
            item.remedy = Some(format!(
                "{} spans {turns:.1} turns: if it is in degrees, declare `degrees`; if it is no angle, leave it out of `angles`",
                c.name
            ));
        }
    }
    item.finding = texts.join(", ");
    item
}

fn wraps(recording: &Recording) -> Item {
    let total: usize = recording.unwrapped.iter().sum();
    let finding = if total == 0 {
        "none to unwrap".into()
    } else {
        format!("{total} jumps of wrapped angles were unwrapped")
    };
    Item::pass("wraps", finding).value("unwrapped", total as f64)
}

/// Jumps of a coordinate: samples whose step differs from what its neighbours' steps foretell.
fn jumps(recording: &Recording, c: &Column<'_>) -> Option<Item> {
    let (t, q): (_, Vec<f64>) = (&recording.t, c.iter().collect());
    let slope = |k: usize| (q[k + 1] - q[k]) / (t[k + 1] - t[k]);
    let surprise = |k: usize| {
        let expected = 0.5 * (slope(k - 1) + slope(k + 1));
        (q[k + 1] - q[k] - expected * (t[k + 1] - t[k])).abs()
    };
    // Beside a gap nothing is foretold.
    let longest = time::GAP * median_step(t);
    let near = |k: usize| t[k - 1..k + 3].windows(2).all(|w| w[1] - w[0] <= longest);
    let surprises: Vec<f64> = (1..q.len() - 2)
        .map(|k| if near(k) { surprise(k) } else { 0.0 })
        .collect();
    let (low, high) = c.range();
    let usual = median(&mut surprises.clone());
    let threshold = (JUMP * usual).max(SMALLEST_JUMP * (high - low));
    let mut found: Vec<usize> = (0..surprises.len())
        .filter(|k| surprises[*k] > threshold)
        .map(|k| k + 1)
        .collect();
    // The neighbours of a jump are surprised by half of it.
    found.retain(|&k| {
        let own = surprises[k - 1];
        surprises.get(k.wrapping_sub(2)).is_none_or(|s| *s < own)
            && surprises.get(k).is_none_or(|s| *s <= own)
    });
    let &k = found.first()?;
    let step = q[k + 1] - q[k];
    let whole_turn =
        |turn: f64| ((step.abs() - turn).abs() < 0.1 * turn) && high - low < 1.05 * turn;
    let finding = format!(
        "{} jumps {} times, first by {step:.4} at t = {:.4} s",
        c.name,
        found.len(),
        t[k + 1]
    );
    let item = if !recording.coordinates.is_circle(c.coordinate)
        && (whole_turn(TAU) || whole_turn(360.0))
    {
        let degrees = if whole_turn(TAU) { "" } else { " `degrees`" };
        Item::fail(
            "jumps",
            finding,
            format!(
                "it looks like a wrapped angle: declare it, `angles` {}{degrees}",
                c.name
            ),
        )
    } else {
        Item::warn(
            "jumps",
            finding,
            "cut the recording there, or remove the outliers: a derivative across a jump is meaningless",
        )
    };
    Some(
        item.value("jumps", found.len() as f64)
            .value("first_s", t[k + 1]),
    )
}

/// Rows that repeat the one before although the system moves faster than a quantisation step a sample.
fn repeats(recording: &Recording, steps: &[f64]) -> Item {
    let n = recording.dof();
    let same = |k: usize| {
        recording.known().all(|(_, s)| {
            s[k * n..(k + 1) * n]
                .iter()
                .zip(&s[(k - 1) * n..k * n])
                .all(|(a, b)| a.total_cmp(b).is_eq())
        })
    };
    let moving = |k: usize| {
        let (from, to) = (k.saturating_sub(5), (k + 5).min(recording.len() - 1));
        (0..n).any(|i| {
            (recording.q[to * n + i] - recording.q[from * n + i]).abs()
                > 2.0 * steps[i] * (to - from) as f64
        })
    };
    let repeated: Vec<usize> = (1..recording.len()).filter(|k| same(*k)).collect();
    let stuck = repeated.iter().filter(|k| moving(**k)).count();
    let finding = format!(
        "{} rows repeat the one before, {stuck} of them while it moves",
        repeated.len()
    );
    let item = if stuck as f64 > MANY_REPEATS * recording.len() as f64 {
        Item::warn(
            "repeats",
            finding,
            "the signals are slower than the log: thin it to their true rate with `every`",
        )
    } else {
        Item::pass("repeats", finding)
    };
    item.value("repeated", repeated.len() as f64)
        .value("stuck", stuck as f64)
}

fn noise(recording: &Recording, columns: &[Column<'_>]) -> Item {
    let segments: Vec<_> = segments(&recording.t, time::GAP)
        .into_iter()
        .filter(|s| s.len() >= 8)
        .collect();
    let mut item = Item::pass("noise", "");
    let (mut texts, mut loud) = (Vec::new(), Vec::new());
    for c in columns {
        let series = Series {
            t: &recording.t,
            y: c.values,
            n: c.n,
            coordinate: c.coordinate,
        };
        let sigma = noise_variance(series, &segments, 3, 8).sqrt();
        let deviation = c.deviation();
        texts.push(format!(
            "{} {sigma:.2e} ({:.2} %)",
            c.name,
            100.0 * sigma / deviation.max(f64::MIN_POSITIVE)
        ));
        item = item.value(c.name, sigma);
        if sigma > MUCH_NOISE * deviation && deviation > 0.0 {
            loud.push(c.name);
        }
    }
    item.finding = format!(
        "standard deviation (part of the signal's): {}",
        texts.join(", ")
    );
    if !loud.is_empty() {
        item.verdict = super::Verdict::Warn;
        item.remedy = Some(format!(
            "{} is mostly noise: filter it at the source, or leave it out and let it be estimated",
            loud.join(", ")
        ));
    }
    item
}

/// Smallest step between the values of a column; 0 where they are all alike.
fn quantisation_step(c: &Column<'_>) -> f64 {
    let mut values: Vec<f64> = c.iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    let (low, high) = (
        values.first().copied().unwrap_or(0.0),
        values.last().copied().unwrap_or(0.0),
    );
    let least = 1e-9 * (high - low);
    values
        .windows(2)
        .map(|w| w[1] - w[0])
        .filter(|d| *d > least)
        .fold(f64::INFINITY, f64::min)
        .min(high - low)
}

fn quantisation(columns: &[Column<'_>], steps: &[f64]) -> Item {
    let mut item = Item::pass("quantisation", "");
    let (mut texts, mut coarse) = (Vec::new(), Vec::new());
    for (c, &step) in columns.iter().zip(steps) {
        let (low, high) = c.range();
        texts.push(format!("{} {step:.2e}", c.name));
        item = item.value(c.name, step);
        if high > low && step * COARSE_LEVELS > high - low {
            coarse.push(c.name);
        }
    }
    item.finding = format!("smallest step: {}", texts.join(", "));
    if !coarse.is_empty() {
        item.verdict = super::Verdict::Warn;
        item.remedy = Some(format!(
            "{} has fewer than {COARSE_LEVELS} levels: use a finer sensor or larger motions",
            coarse.join(", ")
        ));
    }
    item
}

/// Joints whose forces are 0, or small beside those of another joint.
pub(super) fn passive(recording: &Recording) -> Vec<Item> {
    let forces: Vec<Column<'_>> = columns(recording)
        .into_iter()
        .filter(|c| c.signal == "tau")
        .collect();
    let size = |c: &Column<'_>| {
        let (sum, count) = c.iter().fold((0.0, 0.0), |(s, k), x| (s + x * x, k + 1.0));
        f64::sqrt(sum / count)
    };
    let largest = forces.iter().map(size).fold(0.0, f64::max);
    let item = |c: &Column<'_>| {
        let (own, name) = (size(c), &recording.coordinates.0[c.coordinate].name);
        let finding = if own <= 0.0 {
            format!("{name} is passive: {} is 0 throughout", c.name)
        } else if own < WEAK * largest {
            format!(
                "{} is weak, {own:.3e} (root mean square), {:.1} % of the largest: if {name} is passive this is noise and friction, and an error in parts of its variance says little",
                c.name,
                100.0 * own / largest
            )
        } else {
            return None;
        };
        Some(Item::pass("passive", finding).value("rms", own))
    };
    forces
        .iter()
        .filter(|_| largest > 0.0)
        .filter_map(item)
        .collect()
}

/// Signals that stay at one of their extremes.
fn saturation(columns: &[Column<'_>]) -> Vec<Item> {
    columns
        .iter()
        .filter(|c| matches!(c.signal, "q" | "tau"))
        .filter_map(saturated)
        .collect()
}

fn saturated(c: &Column<'_>) -> Option<Item> {
    let (low, high) = c.range();
    let len = c.iter().count() as f64;
    if !(low.is_finite() && high.is_finite()) {
        return None; // nothing but NaN, or infinite: `finite` says so
    }
    if high <= low {
        let forced = c.signal == "tau" && low.abs() > 0.0;
        let finding = format!("{} is constant at {low:.4e}", c.name);
        return forced.then(|| {
            Item::warn(
                "saturation",
                finding,
                "check that it was recorded: a constant force excites nothing",
            )
        });
    }
    let mean = c.iter().sum::<f64>() / len;
    if c.signal == "tau" && c.deviation() < HARDLY_CHANGES * mean.abs() {
        let finding = format!(
            "{} hardly changes: {mean:.4} ± {:.1e}",
            c.name,
            c.deviation()
        );
        let remedy =
            "check that it was recorded and not merely commanded; a constant force excites nothing";
        return Some(Item::warn("saturation", finding, remedy));
    }
    let near = 1e-6 * (high - low);
    let at = |extreme: f64| c.iter().filter(|x| (x - extreme).abs() <= near).count() as f64 / len;
    let (part, extreme) = if at(low) > at(high) {
        (at(low), low)
    } else {
        (at(high), high)
    };
    let limit_is_rest = extreme.abs() <= near;
    let item = || {
        let finding = format!(
            "{} stands at {extreme:.4} for {:.1} % of the samples",
            c.name,
            100.0 * part
        );
        Item::warn("saturation", finding, "what the limit hides cannot be learned: check that the true value is recorded, or stay below the limit")
            .value("fraction", part)
    };
    (part > MUCH_SATURATION && !limit_is_rest).then(item)
}
