//! A sample of a log that is longer than what is kept: stretches of successive rows, drawn while the rows stream by.
//!
//! Every stretch has a random number that follows from the seed, its recording and its index. Those with the smallest
//! are kept, as many as the limit allows: all have the same chance, whatever the length of the log, and one pass is
//! enough (bottom-k sampling: Cohen and Kaplan, PODC 2007). Rows of a stretch stay together, so that derivatives, delays
//! and rollouts have their neighbours. Rows that are not kept are checked as well: a NaN is an
//! error in any row.

use std::ops::Range;

use super::{Estimate, EstimateOptions, Recording};
use lagrangian_motion::Trajectory;
use lagrangian_motion::{Error, Result};

/// A limit holds at least this many stretches, if they are no shorter than this.
const FEWEST: usize = 8;
const SHORTEST: usize = 16;
/// Factor over the limit of the rows that are held while reading.
const HELD: f64 = 1.25;
/// Shorter pieces than this do not become a trajectory.
const SHORTEST_PIECE: usize = 8;

/// Number and choice of the rows of a log that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// Largest number of rows that are kept, of all recordings together; shorter logs are kept whole.
    pub rows: usize,
    /// Seed for the choice of the stretches.
    pub seed: u64,
    /// Largest number of rows of a stretch: short stretches cover more of a motion, long ones allow for windows and rollouts.
    pub stretch: usize,
}

impl Sampling {
    /// Length for losses of single samples, with files that hold all signals.
    pub const SHORT: usize = 64;
    /// Length for estimates of derivatives, or rollouts of motions.
    pub const LONG: usize = 512;
    /// Length for windows or delays in seconds, whose number of rows is unknown.
    pub const LONGEST: usize = 2048;

    /// The sampling with stretches that are long enough for estimates.
    pub(super) fn for_estimates(self) -> Self {
        let stretch = self.stretch.max(Self::LONG);
        Self { stretch, ..self }
    }

    /// Number of rows of each stretch.
    #[must_use]
    pub fn length(&self) -> usize {
        self.stretch.min(self.rows / FEWEST).max(SHORTEST)
    }

    /// Number of rows that may be held before stretches are dropped.
    pub(super) fn held(&self) -> usize {
        (HELD * self.rows as f64) as usize
    }

    /// The random number of a stretch: the smallest are kept.
    pub(super) fn number(&self, recording: &str, stretch: usize) -> u64 {
        // FNV-1a of the name.
        let name = recording.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        });
        let odd = 0x9e37_79b9_7f4a_7c15_u64;
        let own = name ^ self.seed.wrapping_mul(odd);
        finalised(own.wrapping_add((stretch as u64 + 1).wrapping_mul(odd)))
    }
}

/// A hash of 64 bits (the finaliser of `SplitMix64`, Steele, Lea, Flood 2014).
pub(super) fn finalised(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Facts about a whole recording of which only a sample may have been kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Number of rows of the whole recording.
    pub rows: usize,
    /// The longest step of time in the whole recording.
    pub longest_step: TimeStep,
    pub(super) stretches: Vec<Stretch>,
    /// The first fault, in a row that may not have been kept.
    pub(super) flaw: Option<Flaw>,
}

/// A step of time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TimeStep {
    /// Its length, s.
    pub seconds: f64,
    /// The time before it, s.
    pub after: f64,
}

/// A wrap of an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wrap {
    /// Row within its stretch.
    pub(super) row: usize,
    pub(super) coordinate: usize,
    /// Number of turns from this row on.
    pub(super) turns: i32,
}

impl Wrap {
    pub(super) fn at(row: usize, coordinate: usize, turns: i32) -> Self {
        Self {
            row,
            coordinate,
            turns,
        }
    }
}

/// Successive rows that were kept.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    /// Index among the stretches of the whole recording.
    pub(super) place: usize,
    /// First row in the whole recording.
    pub(super) row: usize,
    /// First row in the kept rows.
    pub(super) at: usize,
    pub(super) number: u64,
    /// Wraps of angles, in the order of the rows.
    pub(super) wraps: Vec<Wrap>,
}

/// A fault at a row of the whole recording.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Flaw {
    pub(super) row: usize,
    pub(super) column: String,
    pub(super) finding: String,
    pub(super) remedy: &'static str,
}

impl Sampled {
    pub(super) fn new() -> Self {
        Self {
            rows: 0,
            longest_step: TimeStep::default(),
            stretches: Vec::new(),
            flaw: None,
        }
    }

    /// Ranges of the stretches in the kept `len` rows.
    pub(super) fn ranges(&self, len: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let ends = self.stretches.iter().skip(1).map(|s| s.at).chain([len]);
        self.stretches.iter().zip(ends).map(|(s, end)| s.at..end)
    }

    /// Ranges of the kept `len` rows that are contiguous in the file.
    pub(crate) fn runs(&self, len: usize) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        let mut next = usize::MAX;
        for (stretch, range) in self.stretches.iter().zip(self.ranges(len)) {
            match runs.last_mut() {
                Some(run) if stretch.place == next => run.end = range.end,
                _ => runs.push(range),
            }
            next = stretch.place + 1;
        }
        runs
    }

    /// Updates the stretches after rows were dropped: `rows` of `len` rows remain, ascending.
    pub(super) fn follow(&mut self, rows: &[usize], len: usize) {
        if self.rows == len {
            // The recording was kept whole, and the remaining rows are the new whole.
            self.rows = rows.len();
        }
        for stretch in &mut self.stretches {
            stretch.at = rows.partition_point(|r| *r < stretch.at);
        }
    }
}

impl Recording {
    /// Facts about the whole recording, if only a part of it was kept.
    #[must_use]
    pub fn part(&self) -> Option<&Sampled> {
        self.sampled.as_ref().filter(|s| s.rows > self.len())
    }

    /// The first fault in the whole recording, if only a part of it was kept.
    pub(crate) fn flaw(&self) -> Option<Error> {
        let flaw = self.part()?.flaw.as_ref()?;
        Some(Error::Sample {
            trajectory: self.name.clone(),
            row: flaw.row + 1,
            column: flaw.column.clone(),
            finding: flaw.finding.clone(),
            remedy: flaw.remedy,
        })
    }

    /// Whether no row is left, and there is no fault to report.
    fn vanished(&self) -> bool {
        let silent = |s: &Sampled| s.flaw.is_none() && s.rows >= 2;
        self.is_empty() && self.sampled.as_ref().is_some_and(silent)
    }

    /// Drops all stretches except those whose number is below `least`.
    fn keep_below(&mut self, least: u64) {
        let (n, len) = (self.dof(), self.len());
        let Some(sampled) = &mut self.sampled else {
            return;
        };
        let ranges: Vec<Range<usize>> = sampled.ranges(len).collect();
        let mut kept = Vec::new();
        let mut write = 0;
        let stretches = std::mem::take(&mut sampled.stretches);
        for (stretch, range) in stretches.into_iter().zip(ranges) {
            if stretch.number < least {
                let at = write;
                write += range.len();
                kept.push(range);
                sampled.stretches.push(Stretch { at, ..stretch });
            }
        }
        let compact = |signal: &mut Vec<f64>, width: usize| {
            let mut write = 0;
            for range in &kept {
                signal.copy_within(range.start * width..range.end * width, write);
                write += range.len() * width;
            }
            signal.truncate(write);
        };
        compact(&mut self.t, 1);
        let known = self.iter_mut().filter(|(_, signal)| !signal.is_empty());
        known.for_each(|(_, signal)| compact(signal, n));
    }
}

/// Drops stretches of these recordings until at most `rows` rows are left; returns the least number of the dropped
/// ones, if there are any.
pub(super) fn drop_stretches(recordings: &mut [&mut Recording], rows: usize) -> Option<u64> {
    let of = |r: &Recording| -> Vec<(u64, usize)> {
        let sampled = r.sampled.iter();
        let both = sampled.flat_map(|s| s.stretches.iter().zip(s.ranges(r.len())));
        both.map(|(s, range)| (s.number, range.len())).collect()
    };
    let mut all: Vec<(u64, usize)> = recordings.iter().flat_map(|r| of(r)).collect();
    all.sort_unstable();
    let mut sum = 0;
    let least = all.iter().find(|(_, len)| {
        sum += len;
        sum > rows
    });
    let least = least?.0;
    recordings.iter_mut().for_each(|r| r.keep_below(least));
    Some(least)
}

/// Thins recordings of several files, read with the same sampling, as if they came from one file.
///
/// Recordings without remaining rows are removed.
pub fn thin(recordings: &mut Vec<Recording>, sampling: &Sampling) {
    let mut all: Vec<&mut Recording> = recordings.iter_mut().collect();
    drop_stretches(&mut all, sampling.rows);
    recordings.retain(|r| !r.vanished());
}

impl Recording {
    /// Like [`Recording::into_trajectory`], but each run of a sample, and each piece between [`Recording::breaks`], becomes a separate
    /// trajectory: windows are chosen for all together, and half a window is omitted beside each cut of a sample.
    ///
    /// # Errors
    /// As [`Recording::into_trajectory`].
    pub fn into_trajectories(
        self,
        options: &EstimateOptions,
    ) -> Result<(Vec<Trajectory>, Vec<Estimate>)> {
        let (kept, breaks) = (self.kept(), self.breaks.clone());
        let (whole, estimates) = self.into_trajectory(options)?;
        let window = estimates.iter().map(|e| e.window).max().unwrap_or(0);
        let own = match kept.is_empty() {
            true => vec![whole],
            false => pieces(&whole, &kept, window / 2),
        };
        let each = own.into_iter();
        Ok((
            each.flat_map(|own| between(own, &breaks)).collect(),
            estimates,
        ))
    }

    /// The runs of rows in time, if only a sample was kept.
    fn kept(&self) -> Vec<Kept> {
        let Some(part) = self.part() else {
            return Vec::new();
        };
        let runs = part.runs(self.len()).into_iter();
        let own = |run: Range<usize>| Kept {
            begin: self.t[run.start],
            end: self.t[run.end - 1],
            cut_before: true,
            cut_after: true,
        };
        let mut kept: Vec<Kept> = runs.filter(|run| !run.is_empty()).map(own).collect();
        // The ends of the log itself are not cuts.
        let (first, last) = (part.stretches.first(), part.stretches.last());
        if let (Some(run), Some(0)) = (kept.first_mut(), first.map(|s| s.place)) {
            run.cut_before = false;
        }
        let rest = last.map(|s| part.rows.saturating_sub(s.row) <= self.len() - s.at);
        if let (Some(run), Some(true)) = (kept.last_mut(), rest) {
            run.cut_after = false;
        }
        kept
    }
}

/// A run of rows: its first and last time, and whether rows were omitted before and after it.
struct Kept {
    begin: f64,
    end: f64,
    cut_before: bool,
    cut_after: bool,
}

/// The pieces of a motion between breaks.
fn between(whole: Trajectory, breaks: &[f64]) -> Vec<Trajectory> {
    let (Some(&begin), Some(&last)) = (whole.t.first(), whole.t.last()) else {
        return vec![whole];
    };
    let inner: Vec<f64> = breaks
        .iter()
        .copied()
        .filter(|t| *t > begin && *t <= last)
        .collect();
    if inner.is_empty() {
        return vec![whole];
    }
    let begins: Vec<f64> = std::iter::once(begin).chain(inner).collect();
    let ends = begins[1..].iter().copied().chain([f64::INFINITY]);
    let runs = begins.iter().zip(ends).map(|(&begin, next)| Kept {
        begin,
        end: next.next_down(),
        cut_before: false,
        cut_after: false,
    });
    pieces(&whole, &runs.collect::<Vec<_>>(), 0)
}

/// The motions of these runs, without `margin` samples beside each cut.
fn pieces(whole: &Trajectory, kept: &[Kept], margin: usize) -> Vec<Trajectory> {
    let at = |cut: bool| if cut { margin } else { 0 };
    let piece = |run: &Kept| {
        let first = whole.t.partition_point(|t| *t < run.begin) + at(run.cut_before);
        let after = whole.t.partition_point(|t| *t <= run.end);
        let last = after.saturating_sub(at(run.cut_after));
        (last >= first + SHORTEST_PIECE).then(|| Trajectory {
            name: format!("{} from {:.3} s", whole.name, run.begin),
            ..whole.part(first..last)
        })
    };
    kept.iter().filter_map(piece).collect()
}
