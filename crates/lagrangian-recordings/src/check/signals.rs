//! Checks of single signals: finite values, motion, jumps, noise, quantisation, saturation, repeats.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use super::column::{Column, columns};
use super::{FEWEST_SAMPLES, Item, Verdict, frozen, range, spikes, swings};
use crate::Recording;
use crate::derivatives::GAP;
use crate::local_polynomial::{median_step, segments};
use crate::window::noise_variance;
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::{mean, root_mean_square, upper_median};

/// A coordinate declared as an angle, or driven, with more turns than this may be in degrees …
const MANY_TURNS: f64 = 15.0;
/// … if it moves this far between two turning points, this often, and its speed does not vary within each turn: a tumbling pendulum
/// keeps turning, and gravity acts within each turn.
const TURNS_IN_A_SWING: f64 = 5.0;
const MANY_SWINGS: f64 = 4.0;
/// A jump is this many times the usual deviation from the neighbours …
const JUMP: f64 = 30.0;
/// … and at least this part of the range.
const SMALLEST_JUMP: f64 = 0.05;
/// Noise above this part of a signal's standard deviation is large.
const MUCH_NOISE: f64 = 0.3;
/// Fewer quantisation steps than this across the range are coarse.
const COARSE_LEVELS: f64 = 50.0;
/// A signal with more than this part of its samples at the extreme value is saturated.
const MUCH_SATURATION: f64 = 0.05;
/// A sensor is stuck if more than this part of the moving samples repeat the row before.
const MANY_REPEATS: f64 = 0.02;

/// A force is nearly constant if it deviates from its mean by less than this part of it.
const HARDLY_CHANGES: f64 = 0.05;
/// A force below this part of the largest is that of a nearly passive joint.
const WEAK: f64 = 0.25;

/// Motion of each coordinate in any of the recordings: about all of them together.
pub(super) fn excitation(recordings: &[Recording]) -> Option<Item> {
    let first = recordings.first()?;
    let coordinates = &first.coordinates;
    let moves = |i: usize, r: &Recording| {
        let (low, high) = range(r.q.iter().skip(i).step_by(r.dof()).copied());
        // A parameter is constant along a motion, but must differ between motions.
        high > low || (coordinates.is_parameter(i) && r.q.get(i) != first.q.get(i))
    };
    let is_still = |i: &usize| {
        let mut known = recordings.iter().filter(|r| *i < r.dof() && !r.is_empty());
        !known.any(|r| moves(*i, r))
    };
    let still: Vec<usize> = (0..first.dof()).filter(is_still).collect();
    let mut free = (0..first.dof()).filter(|&i| !coordinates.is_parameter(i));
    if free.all(|i| still.contains(&i)) {
        let remedy = "record a motion, or name the right columns with `q`";
        return Some(Item::fail("excitation", "no coordinate moves", remedy));
    }
    if still.is_empty() {
        let forces = recordings.iter().filter(|r| !r.tau.is_empty()).count();
        let all = recordings.len();
        let finding = format!("every coordinate moves; {forces} of {all} recordings have forces");
        return Some(Item::pass("excitation", finding));
    }
    let names: Vec<&str> = still.iter().map(|i| &*coordinates.0[*i].name).collect();
    let finding = format!("{} never moves", listed(&names));
    let remedy = "omit it with `q`, or excite it: nothing about it can be learned";
    Some(Item::warn("excitation", finding, remedy))
}

/// Items that need no usable time stamps.
pub(super) fn items(recording: &Recording, errors: f64) -> Vec<Item> {
    let columns = columns(recording);
    let mut items = vec![finite(&columns), ranges(recording, &columns, errors)];
    let limited = |c: &&Column<'_>| matches!(c.signal, Signal::Q | Signal::Tau);
    items.extend(columns.iter().filter(limited).filter_map(saturation));
    items
}

/// Items that need usable time stamps.
pub(super) fn sampled_items(recording: &Recording) -> Vec<Item> {
    let columns = columns(recording);
    if !columns.iter().all(Column::is_finite) {
        return Vec::new();
    }
    let mut items = vec![wraps(recording)];
    let positions = columns.iter().filter(|c| c.signal == Signal::Q);
    items.extend(positions.filter_map(|c| jumps(recording, c)));
    let measured = |c: &&Column<'_>| matches!(c.signal, Signal::Qd | Signal::Tau);
    let measured = columns.iter().filter(measured);
    items.extend(measured.filter_map(|c| spikes::item(&recording.t, c)));
    let all_steps: Vec<f64> = columns.iter().map(Column::quantum).collect();
    items.push(repeats(recording, &all_steps));
    // Goals and gains are commanded, not measured.
    let sensors = columns.into_iter().zip(all_steps);
    let sensors = sensors.filter(|(c, _)| !c.signal.is_of_drive());
    let (sensors, steps): (Vec<_>, Vec<f64>) = sensors.unzip();
    items.extend(sensors.iter().filter_map(|c| frozen::item(&recording.t, c)));
    items.push(noise(recording, &sensors));
    items.push(quantisation(&sensors, &steps));
    items
}

/// Largest plausible value of a machine's signal; its square is still finite.
pub const LARGEST: f64 = 1e100;

fn finite(columns: &[Column<'_>]) -> Item {
    let unusable = |x: &f64| x.abs().partial_cmp(&LARGEST).is_none_or(Ordering::is_gt);
    let counts = columns.iter().map(|c| c.iter().filter(unusable).count());
    let total: usize = counts.sum();
    let first =
        |c: &Column<'_>| Some((c.name.to_owned(), c.iter().position(|x| unusable(&x))? + 1));
    let item = match columns.iter().find_map(first) {
        None => Item::pass("finite", "all values are finite"),
        Some((name, row)) => {
            let finding = format!(
                "{total} values are NaN, infinite, above 1e100 or empty, first in column '{name}' at sample {row}"
            );
            Item::fail("finite", finding, "remove or repair those rows")
        }
    };
    item.value("not_finite", total as f64)
}

/// A number in a form that is readable at any size.
fn short(x: f64) -> String {
    match x.abs() < 1e6 {
        true => format!("{x:.4}"),
        false => format!("{x:.4e}"),
    }
}

/// The item of what each signal reaches; in doubt where a joint seems to be in degrees.
pub const RANGE: &str = "range";

fn ranges(recording: &Recording, columns: &[Column<'_>], errors: f64) -> Item {
    let mut texts = Vec::new();
    let mut item = Item::pass(RANGE, "");
    let swings = swings::swings(recording);
    let speeds = swings::of_signal(recording, Signal::Qd);
    for c in columns {
        let (low, high) = c.range();
        texts.push(format!("{} {} … {}", c.name, short(low), short(high)));
        item = item
            .value(format!("{}_min", c.name), low)
            .value(format!("{}_max", c.name), high);
        let turns = (high - low) / TAU;
        // Joints of a machine with limits are not circles, and may be angles.
        let circle = recording.coordinates.is_circle(c.coordinate);
        let is_angle = c.signal == Signal::Q && (circle || !recording.tau.is_empty());
        let otherwise = match circle {
            true => "if it is not an angle, omit it from `angles`",
            false => "if it slides, give metres",
        };
        let remedy = format!(
            "{} spans {turns:.1} turns: if it is in degrees, declare it among `angles`, and `degrees`; {otherwise}",
            c.name
        );
        let swings = swings.get(c.coordinate).copied().unwrap_or_default();
        let changes = speeds.get(c.coordinate).map_or(0, |s| s.count);
        let most = swings.count.max(changes) as f64;
        let wide = swings.travel / TAU > TURNS_IN_A_SWING * most;
        if is_angle && turns > MANY_TURNS && wide && swings.count as f64 >= errors * MANY_SWINGS {
            let doubt = item.with(Verdict::Warn, remedy).in_doubt();
            item = doubt.claims(Some(c.coordinate), 1.0);
        }
    }
    item.finding = listed(&texts);
    item
}

fn wraps(recording: &Recording) -> Item {
    let total: usize = recording.unwrapped.iter().sum();
    let finding = match total {
        0 => "none to unwrap".into(),
        _ => format!("{total} jumps of wrapped angles were unwrapped"),
    };
    Item::pass("wraps", finding).value("unwrapped", total as f64)
}

/// Jumps of a coordinate: samples whose step differs from the prediction from neighbouring steps.
fn jumps(recording: &Recording, c: &Column<'_>) -> Option<Item> {
    let (t, q): (_, Vec<f64>) = (&recording.t, c.iter().collect());
    let slope = |k: usize| (q[k + 1] - q[k]) / (t[k + 1] - t[k]);
    let surprise = |k: usize| {
        let expected = 0.5 * (slope(k - 1) + slope(k + 1));
        (q[k + 1] - q[k] - expected * (t[k + 1] - t[k])).abs()
    };
    // Samples beside a gap have no prediction.
    let longest = GAP * median_step(t);
    let near = |k: usize| t[k - 1..k + 3].windows(2).all(|w| w[1] - w[0] <= longest);
    let surprises = (1..q.len() - 2).map(|k| if near(k) { surprise(k) } else { 0.0 });
    let surprises: Vec<f64> = surprises.collect();
    let (low, high) = c.range();
    let usual = upper_median(&mut surprises.clone());
    let threshold = (JUMP * usual).max(SMALLEST_JUMP * (high - low));
    // The residuals of the neighbours of a jump are half of it.
    let is_jump = |&k: &usize| {
        let own = surprises[k];
        own > threshold
            && surprises.get(k.wrapping_sub(1)).is_none_or(|s| *s < own)
            && surprises.get(k + 1).is_none_or(|s| *s <= own)
    };
    let found: Vec<usize> = (0..surprises.len()).filter(is_jump).collect();
    let k = found.first()? + 1;
    let (step, count, at, name) = (q[k + 1] - q[k], found.len(), t[k + 1], c.name);
    let whole_turn =
        |turn: f64| ((step.abs() - turn).abs() < 0.1 * turn) && high - low < 1.05 * turn;
    let finding = format!("{name} jumps {count} times, first by {step:.4} at t = {at:.4} s");
    let circle = recording.coordinates.is_circle(c.coordinate);
    let item = if !circle && (whole_turn(TAU) || whole_turn(360.0)) {
        let degrees = if whole_turn(TAU) { "" } else { " `degrees`" };
        let remedy = format!("it looks like a wrapped angle: declare it, `angles` {name}{degrees}");
        Item::fail("jumps", finding, remedy)
    } else {
        let remedy = "cut the recording there, or remove the outliers: a derivative across a jump is meaningless";
        Item::warn("jumps", finding, remedy)
    };
    Some(item.value("jumps", count as f64).value("first_s", at))
}

/// Rows that repeat the one before although the system moves faster than a quantisation step a sample.
fn repeats(recording: &Recording, steps: &[f64]) -> Item {
    let n = recording.dof();
    let row = |k: usize| recording.signals.row(n, k);
    let same = |&k: &usize| {
        let mut pairs = row(k).into_iter().zip(row(k - 1));
        pairs.all(|((_, now), (_, before))| {
            let mut values = now.iter().zip(before);
            values.all(|(a, b)| a.total_cmp(b).is_eq())
        })
    };
    let moving = |&&k: &&usize| {
        let (from, to) = (k.saturating_sub(5), (k + 5).min(recording.len() - 1));
        let mut ends = row(from).q.iter().zip(row(to).q).zip(steps);
        ends.any(|((from_q, to_q), step)| (to_q - from_q).abs() > 2.0 * step * (to - from) as f64)
    };
    let near = |&k: &usize| {
        let mut pairs = row(k).q.iter().zip(row(k - 1).q).zip(steps);
        !same(&k) && pairs.all(|((now, before), step)| (now - before).abs() < 1.5 * step)
    };
    let repeated: Vec<usize> = (1..recording.len()).filter(same).collect();
    let (repeated, stuck) = (repeated.len(), repeated.iter().filter(moving).count());
    // Noise of about a quantisation step repeats rows by chance, no more often than it moves them by one step.
    let chance = |k: &usize| near(k) && moving(&k);
    let by_chance = || (1..recording.len()).filter(chance).count();
    let finding = format!("{repeated} rows repeat the one before, {stuck} of them while it moves");
    let often = stuck as f64 > MANY_REPEATS * recording.len() as f64;
    let remedy = "the signals are slower than the log: thin it to their true rate with `every`";
    Item::pass("repeats", finding)
        .warn_if(often && stuck > by_chance(), remedy)
        .value("repeated", repeated as f64)
        .value("stuck", stuck as f64)
}

fn noise(recording: &Recording, columns: &[Column<'_>]) -> Item {
    let mut segments = segments(&recording.t, GAP);
    segments.retain(|s| s.len() >= 8);
    let figure = |c: &Column<'_>| {
        let sigma = noise_variance(c.series, &segments, 3, 8).sqrt();
        let deviation = c.deviation();
        let percent = 100.0 * sigma / deviation.max(f64::MIN_POSITIVE);
        let is_loud = sigma.min(c.steady_noise()) > MUCH_NOISE * deviation && deviation > 0.0;
        (sigma, format!("{sigma:.2e} ({percent:.2} %)"), is_loud)
    };
    let remedy =
        "is mostly noise: filter it at its source (rates may be omitted: they are estimated)";
    let figures = columns.iter().map(|c| (c.name, figure(c)));
    let item = Item::pass("noise", "standard deviation (part of the signal's): ");
    let item = item.with_each(figures, remedy);
    let positions = columns.iter().filter(|c| c.signal == Signal::Q);
    let mut known = positions.filter_map(predicted).peekable();
    // Measured accelerations need no neighbours.
    let loud = recording.qdd.is_empty() && known.peek().is_some() && known.all(|x| x < PREDICTED);
    let finding = "the positions are noise: neighbouring samples do not predict one another";
    let remedy = "omit a recording at rest; else check which columns are positions, the order of the rows, and the sampling rate";
    let failed = loud.then(|| Item::fail("noise", finding, remedy));
    failed.unwrap_or(item)
}

/// Positions of which their neighbours predict less than this part cannot be told from noise.
const PREDICTED: f64 = 0.5;

/// The part of the variance of a column that follows from two neighbours on either side, by least squares; `None` where it is constant or
/// too short.
fn predicted(column: &Column<'_>) -> Option<f64> {
    let values: Vec<f64> = column.iter().collect();
    let mean = mean(&mut column.iter());
    // Sums over the sample and those of its nearest and next neighbours: products [x, a, b] with x, a and b.
    let mut sums = [[0.0; 3]; 3];
    for w in values.windows(5) {
        let [a, b, x, c, d] = [0, 1, 2, 3, 4].map(|k| w[k]);
        let own = [x - mean, b + c - 2.0 * mean, a + d - 2.0 * mean];
        for (row, x) in sums.iter_mut().zip(own) {
            row.iter_mut().zip(own).for_each(|(sum, y)| *sum += x * y);
        }
    }
    let [[xx, xa, xb], [_, aa, ab], [_, _, bb]] = sums;
    let left = xa * xa * bb - 2.0 * xa * xb * ab + xb * xb * aa;
    let explained = left / (aa * bb - ab * ab) / xx;
    (values.len() > 2 * FEWEST_SAMPLES && xx > 0.0)
        .then_some(explained)
        .filter(|x| x.is_finite())
}

impl Item {
    /// Adds a figure of each column, its text, and whether the remedy applies to the column.
    fn with_each<'a>(
        mut self,
        figures: impl Iterator<Item = (&'a str, (f64, String, bool))>,
        remedy: &str,
    ) -> Self {
        let (mut texts, mut bad) = (Vec::new(), Vec::new());
        for (name, (figure, text, is_bad)) in figures {
            texts.push(format!("{name} {text}"));
            self = self.value(name, figure);
            bad.extend(is_bad.then_some(name));
        }
        self.finding += &listed(&texts);
        self.warn_if(!bad.is_empty(), format!("{} {remedy}", listed(&bad)))
    }
}

/// Texts in a row; of many the first.
pub(super) fn listed<T: AsRef<str>>(texts: &[T]) -> String {
    const MOST: usize = 24;
    let few: Vec<&str> = texts.iter().take(MOST).map(AsRef::as_ref).collect();
    match texts.len().saturating_sub(MOST) {
        0 => few.join(", "),
        others => format!("{}, and {others} others", few.join(", ")),
    }
}

fn quantisation(columns: &[Column<'_>], steps: &[f64]) -> Item {
    let figures = columns.iter().zip(steps).map(|(c, &step)| {
        let (low, high) = c.range();
        let is_coarse = high > low && step * COARSE_LEVELS > high - low;
        (c.name, (step, format!("{step:.2e}"), is_coarse))
    });
    let remedy =
        format!("has fewer than {COARSE_LEVELS} levels: use a finer sensor or larger motions");
    Item::pass("quantisation", "smallest step: ").with_each(figures, &remedy)
}

/// Joints whose forces are 0, or small compared with those of another joint.
pub(super) fn passive(recording: &Recording) -> Vec<Item> {
    let mut forces = columns(recording);
    forces.retain(|c| c.signal == Signal::Tau);
    let size = |c: &Column<'_>| root_mean_square(&mut c.iter());
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
    let known = forces.iter().filter(|_| largest > 0.0);
    known.filter_map(item).collect()
}

/// An item where a signal stays at one of its extremes.
fn saturation(c: &Column<'_>) -> Option<Item> {
    let (low, high) = c.range();
    let len = c.iter().count() as f64;
    if !(low.is_finite() && high.is_finite()) {
        return None; // all values are NaN or infinite: `finite` reports it
    }
    if high <= low {
        let forced = c.signal == Signal::Tau && low.abs() > 0.0;
        let finding = format!("{} is constant at {low:.4e}", c.name);
        let remedy = "check that it was recorded: a constant force excites nothing";
        return forced.then(|| Item::warn("saturation", finding, remedy));
    }
    let mean = c.iter().sum::<f64>() / len;
    if c.signal == Signal::Tau && c.deviation() < HARDLY_CHANGES * mean.abs() {
        let (name, deviation) = (c.name, c.deviation());
        let finding = format!("{name} hardly changes: {mean:.4} ± {deviation:.1e}");
        let remedy =
            "check that it was recorded and not merely commanded; a constant force excites nothing";
        return Some(Item::warn("saturation", finding, remedy));
    }
    let near = 1e-6 * (high - low);
    let at = |extreme: f64| c.iter().filter(|x| (x - extreme).abs() <= near).count() as f64 / len;
    let extreme = if at(low) > at(high) { low } else { high };
    let (part, limit_is_rest) = (at(extreme), extreme.abs() <= near);
    let (name, percent) = (c.name, 100.0 * part);
    let finding = format!("{name} is at {extreme:.4} for {percent:.1} % of the samples");
    let remedy = "what the limit hides cannot be learned: check that the true value is recorded, or stay below the limit";
    let item = Item::warn("saturation", finding, remedy)
        .claims(Some(c.coordinate), extreme)
        .value("fraction", part);
    (part > MUCH_SATURATION && !limit_is_rest).then_some(item)
}
