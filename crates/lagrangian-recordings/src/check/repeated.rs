//! Repeated stretches of motion: errors on them are not errors on new motions.

use std::cmp::Ordering;
use std::collections::HashMap;

use super::column::{Column, columns};
use super::{CheckReport, Item, drive};
use crate::Recording;
use crate::local_polynomial::median_step;
use crate::low_pass::lagrange;
use crate::sample::finalised;
use lagrangian_motion::Signal;

/// Consecutive samples that must be equal.
const WINDOW: usize = 12;
/// Number of repeated rows above which a match by chance is unlikely.
const FEWEST: usize = 24;

/// Position of the first occurrence of a window of samples.
#[derive(Clone, Copy)]
struct Place {
    recording: usize,
    row: usize,
}

/// The samples that two recordings share.
struct Shared {
    first: usize,
    second: usize,
    samples: usize,
}

/// Items about stretches that occur twice in the recordings.
pub(super) fn items(recordings: &[Recording]) -> Vec<Item> {
    let all: Vec<&Recording> = recordings.iter().collect();
    let name = |k: usize| &recordings[k].name;
    let item = |s: Shared| {
        let (first, second, samples) = (name(s.first), name(s.second), s.samples);
        let finding = match s.first == s.second {
            true => format!("{samples} samples of '{second}' repeat earlier ones of it"),
            false => {
                let all = recordings[s.second].len();
                format!("{samples} of {all} samples of '{second}' are those of '{first}'")
            }
        };
        let remedy = "remove the copy: what is held back from a fit would be what it was fitted to";
        Item::doubt("repeated", finding, remedy).value("samples", samples as f64)
    };
    shared(&all, 0).into_iter().map(item).collect()
}

/// Checks for validation recordings that repeat the training recordings, or disagree with their law.
///
/// # Example
/// ```
/// use lagrangian_recordings::{Format, Layout, check::check_validation};
/// let rows: String = (0..200).map(|k| f64::from(k) * 0.02).map(|t| format!("{t},{}\n", t.sin())).collect();
/// let file = std::io::Cursor::new(format!("t,q1\n{rows}"));
/// let swing = Format::Csv.read(file, "swing", &Layout::default())?.recordings;
/// let report = check_validation(&swing, &swing);
/// assert!(report.items[0].finding.contains("200 of 200"));
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[must_use]
pub fn check_validation(training: &[Recording], validation: &[Recording]) -> CheckReport {
    let all: Vec<&Recording> = training.iter().chain(validation).collect();
    let item = |s: &Shared| {
        let (second, samples) = (all[s.second], s.samples);
        let finding = format!(
            "{samples} of {} samples of the validation motion '{}' are among those of '{}', which the model is fitted to",
            second.len(),
            second.name,
            all[s.first].name
        );
        Item::fail("validation", finding, OTHERS).value("samples", samples as f64)
    };
    let mut found = shared(&all, training.len());
    found.retain(|s| s.first < training.len() && s.second >= training.len());
    let is_new = |k: &usize| found.iter().all(|s| s.second != *k);
    let positions: Vec<_> = all.iter().map(|r| Positions::of(r)).collect();
    let retold = (training.len()..all.len()).filter(is_new).filter_map(|k| {
        let own = &positions[k];
        let first = (0..training.len()).find(|first| own.retell(&positions[*first]))?;
        let finding = format!(
            "the validation motion '{}' follows the path of '{}', which the model is fitted to, to within rounding and noise",
            all[k].name, all[first].name
        );
        Some(Item::fail("validation", finding, OTHERS))
    });
    let mut items: Vec<Item> = found.iter().map(item).chain(retold).collect();
    items.extend(drive::disagreement(&all, training.len(), None));
    if items.is_empty() {
        items.push(Item::pass("validation", "no sample of it is fitted to"));
    }
    CheckReport { items }
}

const OTHERS: &str = "validate on other motions, or omit the validation files: some of the samples are then held back";

/// Number of places of a motion that are looked for in another, and of samples of each that are compared.
const PLACES: usize = 24;
const COMPARED: usize = 6;
/// A motion is another one where more than this part of its places are not found in it.
const MISSED: f64 = 0.1;
/// Standard deviations of noise and rounding within which samples are equal.
const DEVIATIONS: f64 = 4.0;
/// With more noise than this part of the deviation nothing is told. One free coordinate fills its plane of states: there every motion
/// comes nearer to an older one.
const NOISY: f64 = 5e-3;
const NOISY_PLANE: f64 = 1e-4;

/// The most times of a motion that a place of another one is looked for at, before the best is refined.
const LOOKED_AT: usize = 4096;

/// A recording, with deviation, noise and rounding of each position; those of one that is too short to be compared are not known.
struct Positions<'a> {
    recording: &'a Recording,
    sizes: Vec<[f64; 3]>,
}

impl<'a> Positions<'a> {
    fn of(recording: &'a Recording) -> Self {
        let all = columns(recording).into_iter();
        let all = all.filter(|_| recording.len() >= 2 * WINDOW);
        let size = |c: Column<'_>| [c.deviation(), c.steady_noise(), c.quantum()];
        Self {
            recording,
            sizes: all.filter(|c| c.signal == Signal::Q).map(size).collect(),
        }
    }

    /// Whether it retells another one: each of its places, a sixth of its time long, has one in the other with positions that are equal
    /// to within noise and rounding, whatever the rates, the rounding and the noise of both.
    fn retell(&self, other: &Self) -> bool {
        let (copy, of) = (self.recording, other.recording);
        let n = of.dof();
        if copy.dof() != n || n == 0 || copy.len() < 2 * WINDOW || of.len() < 2 * WINDOW {
            return false;
        }
        let noisy = match n == 1 && of.tau.is_empty() {
            true => NOISY_PLANE,
            false => NOISY,
        };
        // The noise that is present throughout contains rounding.
        let scale = |(own, other): (&[f64; 3], &[f64; 3])| {
            let noise = own[1].hypot(other[1]);
            (other[0], noise.max(own[2].max(other[2])))
        };
        let scales: Vec<(f64, f64)> = self.sizes.iter().zip(&other.sizes).map(scale).collect();
        let told =
            |(d, noise): &(f64, f64)| noise.partial_cmp(&(noisy * d)) == Some(Ordering::Less);
        scales.iter().all(told) && Pair::new(copy, of, scales).is_found()
    }
}

/// Two recordings of which one may retell the other.
struct Pair<'a> {
    copy: &'a Recording,
    of: &'a Recording,
    /// Deviation of each position and its noise.
    scales: Vec<(f64, f64)>,
    /// The time between two states that are compared, s.
    step: f64,
}

impl<'a> Pair<'a> {
    fn new(copy: &'a Recording, of: &'a Recording, scales: Vec<(f64, f64)>) -> Self {
        let span = |r: &Recording| r.t[r.len() - 1] - r.t[0];
        Self {
            copy,
            of,
            scales,
            step: span(copy).min(span(of)) / (6 * (COMPARED - 1)) as f64,
        }
    }

    /// Whether nearly all places of `copy` are found in `of`.
    fn is_found(&self) -> bool {
        let (begin, last) = (self.copy.t[0], self.last(self.copy));
        let missed = |k: &usize| {
            let t = begin + (last - begin) * *k as f64 / (PLACES - 1) as f64;
            let place = self.nearest(t);
            place.is_none_or(|u| self.difference(t, u) > DEVIATIONS)
        };
        (0..PLACES).filter(missed).count() as f64 <= MISSED * PLACES as f64
    }

    /// The last time at which a place of a recording can begin.
    fn last(&self, r: &Recording) -> f64 {
        r.t[r.len() - 1] - (COMPARED - 1) as f64 * self.step
    }

    /// The differences of all positions where the place of `copy` at t is laid on that of `of` at u, after `later` steps.
    fn differences(&self, t: f64, u: f64, later: usize) -> impl Iterator<Item = f64> {
        let later = later as f64 * self.step;
        (0..self.scales.len())
            .map(move |i| position(self.copy, i, t + later) - position(self.of, i, u + later))
    }

    /// The largest difference in standard deviations of the noise.
    fn difference(&self, t: f64, u: f64) -> f64 {
        let all = (0..COMPARED).flat_map(|k| self.differences(t, u, k).zip(&self.scales));
        all.fold(0.0, |worst, (d, (_, noise))| worst.max(d.abs() / noise))
    }

    /// The squared difference at three times in deviations of the motion.
    fn distance(&self, t: f64, u: f64) -> f64 {
        let all = [0, 1, 3].into_iter();
        let all = all.flat_map(|k| self.differences(t, u, k).zip(&self.scales));
        all.map(|(d, (deviation, _))| (d / deviation).powi(2)).sum()
    }

    /// The time in `of` whose place resembles that of `copy` at t most: between two samples the motion goes on by up to a step, so
    /// first the nearest of the samples, then the times about it.
    fn nearest(&self, t: f64) -> Option<f64> {
        let every = self.of.len().div_ceil(LOOKED_AT);
        let fine = every as f64 * median_step(&self.of.t);
        let last = self.last(self.of);
        let times = self.of.t.iter().copied().step_by(every);
        let least = |times: &mut dyn Iterator<Item = f64>| {
            let distances = times.map(|u| (u, self.distance(t, u)));
            Some(distances.min_by(|a, b| a.1.total_cmp(&b.1))?.0)
        };
        let mut best = least(&mut times.take_while(|u| *u <= last))?;
        for width in [fine, fine / 20.0, fine / 400.0] {
            let mut about = (-20..=20).map(|k| best + f64::from(k) * width / 20.0);
            best = least(&mut about)?;
        }
        Some(best)
    }
}

/// Position i of a recording at time t: the cubic through four samples.
fn position(r: &Recording, i: usize, t: f64) -> f64 {
    let next = r.t.partition_point(|x| *x <= t);
    let first = next.saturating_sub(2).min(r.len() - 4);
    let q = [0, 1, 2, 3].map(|k| r.q[(first + k) * r.dof() + i]);
    lagrange(&r.t[first..first + 4], &q, t)
}

/// Samples that pairs of recordings share, in the order of the second; those before `from` are not compared with one another.
fn shared(recordings: &[&Recording], from: usize) -> Vec<Shared> {
    let mut seen: HashMap<u64, Place> = HashMap::new();
    let mut found: Vec<Shared> = Vec::new();
    for (second, recording) in recordings.iter().enumerate() {
        let mut run: Option<(Place, usize, usize)> = None;
        for (row, key) in windows(recording) {
            let place = seen
                .get(&key)
                .copied()
                .filter(|p| second >= from && (p.recording != second || p.row + WINDOW <= row));
            run = match (run, place) {
                (Some((start, at, len)), Some(p))
                    if p.recording == start.recording && p.row == start.row + (row - at) =>
                {
                    Some((start, at, len + 1))
                }
                (run, place) => {
                    end(&mut found, second, run);
                    place.map(|p| (p, row, 1))
                }
            };
            let recording = second;
            seen.entry(key).or_insert(Place { recording, row });
        }
        end(&mut found, second, run);
    }
    found
}

/// Adds a finished run of equal windows to `found`.
fn end(found: &mut Vec<Shared>, second: usize, run: Option<(Place, usize, usize)>) {
    let Some((start, _, len)) = run else { return };
    let samples = len + WINDOW - 1;
    if samples < FEWEST {
        return;
    }
    let first = start.recording;
    let mut known = found.iter_mut();
    match known.find(|s| s.first == first && s.second == second) {
        Some(known) => known.samples += samples,
        None => found.push(Shared {
            first,
            second,
            samples,
        }),
    }
}

/// Hash and first row of each window of consecutive samples in which a value changes at every sample.
fn windows(recording: &Recording) -> Vec<(usize, u64)> {
    let n = recording.dof();
    let signals = [Signal::Q, Signal::Qd, Signal::Tau];
    let measured = move |row: usize| {
        let values = signals.into_iter().filter_map(|s| recording.values(s));
        values.flat_map(move |v| v.get(row * n..(row + 1) * n).unwrap_or_default())
    };
    let row = |row| measured(row).fold(SEED, |hash, x| mixed(hash, x.to_bits()));
    let rows: Vec<u64> = (0..recording.len()).map(row).collect();
    let moves = |w: &[u64]| w.windows(2).all(|pair| pair[0] != pair[1]);
    let key = |w: &[u64]| moves(w).then(|| w.iter().fold(SEED, |hash, x| mixed(hash, *x)));
    let keys = rows.windows(WINDOW).enumerate();
    keys.filter_map(|(row, w)| Some((row, key(w)?))).collect()
}

const SEED: u64 = 0xcbf2_9ce4_8422_2325;

/// One step of a hash.
fn mixed(hash: u64, x: u64) -> u64 {
    finalised((hash ^ x).wrapping_add(0x9e37_79b9_7f4a_7c15))
}
