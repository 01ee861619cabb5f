//! Time stamps: order, rate, jitter, gaps.

use super::Item;
use super::column::robust_deviation;
use crate::derivatives::{GAP, SHORTEST};
use crate::local_polynomial::{median_step, segments};
use crate::unit::Stated;
use crate::{Recording, TimeStep};
use lagrangian_motion::statistics::root_mean_square;

/// Jitter above this part of a step makes finite differences of other programs, and lags, unreliable.
const MUCH_JITTER: f64 = 0.5;

/// A higher fraction of dropped samples is a fault of the log.
const MANY_DROPPED: f64 = 0.01;
/// Time stamps are compared with the usual step only if their jitter is less than this part of it.
const LITTLE_JITTER: f64 = 0.1;

/// An item where the longest piece without a gap is too short for the estimates.
pub(super) fn too_short(recording: &Recording) -> Option<Item> {
    let measured = !recording.qd.is_empty() && !recording.qdd.is_empty();
    if measured || recording.t.len() < 2 {
        return None;
    }
    let pieces = segments(&recording.t, GAP);
    let longest = pieces.iter().map(std::ops::Range::len).max().unwrap_or(0);
    let finding =
        format!("{longest} samples without a gap, where {SHORTEST} are needed to estimate q̈");
    let remedy = "omit this trajectory, or record a longer one";
    let item = Item::fail("length", finding, remedy).value("longest", longest as f64);
    (longest < SHORTEST).then_some(item)
}

/// Whether the time stamps are usable: finite and increasing, with enough samples for a window.
pub(super) fn usable(recording: &Recording) -> bool {
    let t = &recording.t;
    t.len() >= 8 && t.iter().all(|t| t.is_finite()) && t.windows(2).all(|w| w[1] > w[0])
}

pub(super) fn items(recording: &Recording) -> Vec<Item> {
    let t = &recording.t;
    if t.len() < 2 {
        let finding = format!("{} sample", t.len());
        let remedy = "a trajectory needs at least two: remove it or record more";
        return vec![Item::fail("time", finding, remedy)];
    }
    if let Some(k) = t.iter().position(|t| !t.is_finite()) {
        let finding = format!("time is {} at sample {}", t[k], k + 1);
        return vec![Item::fail("time", finding, "remove or repair that row")];
    }
    let back = t.windows(2).filter(|w| w[1] < w[0]).count();
    let repeats = |w: &&[f64]| w[1].total_cmp(&w[0]).is_eq();
    let repeated = t.windows(2).filter(repeats).count();
    if back + repeated > 0 {
        let at = t.windows(2).position(|w| w[1] <= w[0]).unwrap_or(0) + 2;
        let finding = format!(
            "time goes back {back} times and stands still {repeated} times, first at sample {at}"
        );
        let remedy = remedy_of_order(t, back);
        let item = Item::fail("time", finding, remedy).value("back", back as f64);
        return vec![item.value("repeated", repeated as f64)];
    }
    let rate = rate(t);
    let even = rate.values["jitter"] < LITTLE_JITTER;
    let mut items = vec![whole_numbers(recording).unwrap_or(rate), gaps(recording)];
    items.extend(dropped(t).filter(|_| even));
    items
}

/// Remedy for time that does not increase.
fn remedy_of_order(t: &[f64], back: usize) -> &'static str {
    let begin = t.first().copied().unwrap_or_default();
    let step = median_step(t).abs();
    let restarts = t.windows(2).filter(|w| w[1] < w[0] && w[1] <= begin + step);
    let shortest = shortest_piece(t);
    if back + 1 == t.len() {
        "time runs backwards: reverse the rows, and the sign of velocities that were differences of them"
    } else if restarts.count() == back && back > 0 {
        match shortest >= 8 {
            true => {
                "time starts again: several logs are in one file; tell them apart with a column and `trajectory`, or divide the file"
            }
            false => {
                "time starts again after fewer than 8 rows: remove such pieces, or tell them apart with a column and `trajectory`"
            }
        }
    } else {
        "sort the rows by time, remove repeats, or tell trajectories apart with `trajectory`"
    }
}

/// The shortest piece in which time increases, samples.
fn shortest_piece(t: &[f64]) -> usize {
    let pieces = t.chunk_by(|a, b| b > a);
    pieces.map(<[f64]>::len).min().unwrap_or(0)
}

fn rate(t: &[f64]) -> Item {
    let step = median_step(t);
    let mut off: Vec<f64> = t.windows(2).map(|w| (w[1] - w[0] - step).abs()).collect();
    let jitter = robust_deviation(&mut off) / step;
    let (rate, percent) = (step.recip(), 100.0 * jitter);
    let finding = format!("{rate:.4} Hz, jitter {percent:.2} % of a step");
    let remedy = "the true time stamps are used, but check that they tell when a sample was taken, not when it was written";
    Item::pass("rate", finding)
        .warn_if(jitter > MUCH_JITTER, remedy)
        .value("rate_hz", rate)
        .value("jitter", jitter)
        .value("step_s", step)
}

/// An item where the stamps were repaired.
pub(super) fn jitter(recorded: &Recording, repaired: &Recording) -> Option<Item> {
    let pairs = recorded.t.windows(2).zip(repaired.t.windows(2));
    let mut errors = pairs.map(|(a, b)| a[1] - a[0] - b[1] + b[0]);
    let jitter = root_mean_square(&mut errors) / median_step(&recorded.t);
    let percent = 100.0 * jitter;
    let finding = format!(
        "steps between time stamps err by {percent:.1} %: positions and velocities tell others, and agree; the stamps were repaired"
    );
    let remedy = "stamp rows when they are sampled, not when they are written";
    let item = Item::warn("stamps", finding, remedy).value("jitter", jitter);
    (jitter > 0.0).then_some(item)
}

/// An item for time in whole numbers with large steps, which is unlikely to be in seconds, unless its name says so.
fn whole_numbers(recording: &Recording) -> Option<Item> {
    let (t, stated) = (&recording.t, Stated::of(&recording.columns.t).unit);
    if stated.is_some_and(|own| own.is_of_time()) {
        return None;
    }
    let step = median_step(t);
    let whole = t.iter().all(|t| t.fract().abs() <= 0.0);
    if whole && t.windows(2).all(|w| w[1] - w[0] <= 1.0) {
        let finding = "time counts the rows: 0, 1, 2 …";
        let remedy = "divide it by the sampling rate, Hz: times are expected in seconds";
        let item = Item::doubt("rate", finding, remedy).value("rate_hz", 1.0);
        return Some(item.value("step_s", 1.0));
    }
    let whole = whole && step >= 2.0;
    // Motions are sampled about ten to a few thousand times a second.
    let (unit, divisor) = match step {
        x if x < 500.0 => ("milliseconds", "1000"),
        x if x < 5e5 => ("microseconds", "1e6"),
        _ => ("nanoseconds", "1e9"),
    };
    let remedy = format!(
        "divide the column of time by {divisor} (or by what makes it seconds); if these are seconds, name it 't (s)'"
    );
    let finding = format!("time comes in whole numbers, {step} apart: it looks like {unit}");
    let item = Item::warn("rate", finding, remedy).value("rate_hz", step.recip());
    whole.then_some(item.value("step_s", step))
}

/// Missing single samples: steps of two to five usual ones.
fn dropped(t: &[f64]) -> Option<Item> {
    let step = median_step(t);
    let ratios = t.windows(2).map(|w| (w[1] - w[0]) / step);
    let dropped = ratios.filter(|r| *r > 1.5 && *r <= GAP);
    let missing: f64 = dropped.map(|r| r.round() - 1.0).sum();
    let finding = format!("{missing} single samples are missing");
    let remedy = "the true time stamps are used, but a log that loses samples may also be late: check the recorder";
    let item = Item::warn("dropped", finding, remedy).value("missing", missing);
    (missing > MANY_DROPPED * t.len() as f64).then_some(item)
}

/// An item about the whole recording, where only a sample of it was kept.
pub(super) fn sample(recording: &Recording) -> Option<Item> {
    let part = recording.part()?;
    let (rows, runs) = (recording.len(), part.runs(recording.len()).len());
    let all = part.rows;
    let finding = format!("{rows} of {all} rows, in {runs} pieces, are checked below");
    let item = match recording.flaw() {
        Some(lagrangian_motion::Error::Sample {
            row,
            column,
            finding,
            remedy,
            ..
        }) => {
            let finding = format!("column '{column}' at row {row}: {finding}");
            Item::fail("sample", finding, remedy)
        }
        _ => Item::pass("sample", finding),
    };
    let item = item.value("rows", all as f64);
    Some(item.value("kept", rows as f64))
}

/// Gaps: long steps of time, except at breaks and where rows were skipped; of skipped rows only the longest step is known.
fn gaps(recording: &Recording) -> Item {
    let (t, part) = (&recording.t, recording.part());
    let step = median_step(t);
    let cuts: Vec<usize> = part.map_or(Vec::new(), |part| {
        let runs = part.runs(t.len());
        runs.iter().map(|run| run.end.saturating_sub(1)).collect()
    });
    let begins = |t: f64| recording.breaks.iter().any(|b| b.total_cmp(&t).is_eq());
    let is_cut = |k: usize| cuts.binary_search(&k).is_ok() || begins(t[k + 1]);
    let own = t.windows(2).enumerate();
    let own = own.filter(|(k, w)| w[1] - w[0] > GAP * step && !is_cut(*k));
    let mut gaps: Vec<(f64, f64)> = own.map(|(_, w)| (w[0], w[1] - w[0])).collect();
    if let Some(TimeStep { seconds, after }) = part.map(|part| part.longest_step)
        && seconds > GAP * step
        && gaps.iter().all(|gap| gap.1 < seconds)
    {
        gaps.push((after, seconds));
    }
    let longest = gaps.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let item = match longest {
        None => Item::pass("gaps", "none"),
        Some((before, dt)) => {
            let count = gaps.len();
            let finding = format!("{count} gaps, the longest {dt:.4} s after t = {before:.4} s");
            let remedy =
                "nothing is estimated across them; single samples between them are omitted";
            Item::warn("gaps", finding, remedy)
        }
    };
    item.value("gaps", gaps.len() as f64)
        .value("longest_s", longest.map_or(0.0, |g| g.1))
}
