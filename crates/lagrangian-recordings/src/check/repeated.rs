//! Repeated stretches of motion: errors on them are not errors on new motions.

use std::collections::HashMap;

use super::{CheckReport, Item};
use crate::Recording;
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
        let Shared {
            first,
            second,
            samples,
        } = s;
        let finding = match first == second {
            true => format!(
                "{samples} samples of '{}' repeat earlier ones of it",
                name(second)
            ),
            false => format!(
                "{samples} of {} samples of '{}' are those of '{}'",
                recordings[second].len(),
                name(second),
                name(first)
            ),
        };
        let remedy = "remove the copy: what is held back from a fit would be what it was fitted to";
        Item::doubt("repeated", finding, remedy).value("samples", samples as f64)
    };
    shared(&all, 0).into_iter().map(item).collect()
}

/// Checks for validation recordings that repeat the training recordings.
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
        let remedy = "validate on other motions, or omit the validation files: some of the samples are then held back";
        Item::fail("validation", finding, remedy).value("samples", samples as f64)
    };
    let found = shared(&all, training.len());
    let mut items: Vec<Item> = found
        .iter()
        .filter(|s| s.first < training.len() && s.second >= training.len())
        .map(item)
        .collect();
    if items.is_empty() {
        items.push(Item::pass("validation", "no sample of it is fitted to"));
    }
    CheckReport { items }
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
            let here = Place {
                recording: second,
                row,
            };
            seen.entry(key).or_insert(here);
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
    match found
        .iter_mut()
        .find(|s| s.first == first && s.second == second)
    {
        Some(known) => known.samples += samples,
        None => found.push(Shared {
            first,
            second,
            samples,
        }),
    }
}

/// Hash and first row of each window of consecutive samples in which a value changes at every sample.
fn windows(recording: &Recording) -> impl Iterator<Item = (usize, u64)> {
    let n = recording.dof();
    let signals = [Signal::Q, Signal::Qd, Signal::Tau];
    let measured = move |row: usize| {
        let values = signals.into_iter().filter_map(|s| recording.values(s));
        values.flat_map(move |v| v.get(row * n..(row + 1) * n).unwrap_or_default())
    };
    let rows: Vec<u64> = (0..recording.len())
        .map(|row| measured(row).fold(SEED, |hash, x| mixed(hash, x.to_bits())))
        .collect();
    let moves = |w: &&[u64]| w.windows(2).all(|pair| pair[0] != pair[1]);
    let keys: Vec<(usize, u64)> = rows
        .windows(WINDOW)
        .enumerate()
        .filter(|(_, w)| moves(w))
        .map(|(row, w)| (row, w.iter().fold(SEED, |hash, x| mixed(hash, *x))))
        .collect();
    keys.into_iter()
}

const SEED: u64 = 0xcbf2_9ce4_8422_2325;

/// One step of a hash.
fn mixed(hash: u64, x: u64) -> u64 {
    finalised((hash ^ x).wrapping_add(0x9e37_79b9_7f4a_7c15))
}
