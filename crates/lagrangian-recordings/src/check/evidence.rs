//! Confirmation of findings: a finding that all samples are wrong must hold in each half of the data.
//!
//! The halves have equal numbers of samples, or else equal travel of the coordinate in question, since data inform about a coordinate
//! only where it moves. Within a half, half as many standard errors count as evidence.

use super::{Item, Verdict, duration};
use crate::Recording;

/// Standard errors that are evidence in one half of the data, as a fraction of those that all data need.
pub(super) const OF_HALF: f64 = 0.5;
/// The findings of the halves agree where their sizes differ by no more than this factor.
const FACTOR: f64 = 2.0;

/// A claim of a finding about all samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    /// The coordinate that it is about; `None` if it is about all of them.
    pub coordinate: Option<usize>,
    /// Its effect, with its sign: a delay, a slope; 1 for one that has no size.
    pub size: f64,
}

impl Item {
    /// Adds the claim that the finding makes about all samples.
    pub(super) fn claims(mut self, coordinate: Option<usize>, size: f64) -> Self {
        self.claim = Some(Claim { coordinate, size });
        self
    }

    /// Whether another finding makes the same accusation.
    fn agrees(&self, other: &Self) -> bool {
        let agree = |(a, b): (Claim, Claim)| {
            let ratio = a.size / b.size;
            a.coordinate == b.coordinate && (FACTOR.recip()..=FACTOR).contains(&ratio)
        };
        other.accuses() && self.name == other.name && self.claim.zip(other.claim).is_some_and(agree)
    }
}

/// Replaces accusations that do not hold in each half of the recordings by findings of doubt.
pub(super) fn confirm(
    items: &mut [Item],
    recordings: &[Recording],
    findings: impl Fn(&[Recording]) -> Vec<Item>,
) {
    let accused = |k: &usize| items[*k].claim.is_some() && items[*k].accuses();
    let mut open: Vec<usize> = (0..items.len()).filter(accused).collect();
    let n = recordings.first().map_or(0, Recording::dof);
    for own in std::iter::once(None).chain((0..n).map(Some)) {
        let concerned =
            |k: &usize| own.is_none() || items[*k].claim.is_some_and(|c| c.coordinate == own);
        if !open.iter().any(concerned) {
            continue;
        }
        let found = halves(recordings, own).map(|half| findings(&half));
        let says = |half: &Vec<Item>, k: &usize| half.iter().any(|other| items[*k].agrees(other));
        open.retain(|k| !(concerned(k) && found.iter().all(|half| says(half, k))));
    }
    let seconds = 2.0 * duration(recordings);
    let remedy = format!("to tell it, record {seconds:.0} s or more with such motion");
    for k in open {
        let item = &mut items[k];
        item.finding += "; but not in each half of the data, so it is not certain";
        item.remedy = Some(remedy.clone());
        (item.verdict, item.doubtful) = (Verdict::Pass, false);
    }
}

/// The recordings in two halves, split at the sample where half of the samples, or of the travel, is reached.
fn halves(recordings: &[Recording], coordinate: Option<usize>) -> [Vec<Recording>; 2] {
    let travel: Vec<Vec<f64>> = recordings.iter().map(|r| travel(r, coordinate)).collect();
    let mut left = 0.5 * travel.iter().flatten().sum::<f64>();
    let mut halves = [Vec::new(), Vec::new()];
    for (recording, steps) in recordings.iter().zip(&travel) {
        let before = |step: &&f64| {
            left -= **step;
            left > 0.0
        };
        let row = steps.iter().take_while(before).count();
        for (half, rows) in halves.iter_mut().zip([0..row, row..recording.len()]) {
            if !rows.is_empty() {
                half.push(recording.piece(&rows));
            }
        }
    }
    halves
}

/// The travel of a coordinate up to each sample from the previous one; without a coordinate each sample counts as 1.
fn travel(recording: &Recording, coordinate: Option<usize>) -> Vec<f64> {
    let (n, len) = (recording.dof(), recording.len());
    let Some(i) = coordinate else {
        return vec![1.0; len];
    };
    let steps = recording.q.windows(n + 1).skip(i).step_by(n);
    let steps = steps.map(|w| (w[n] - w[0]).abs());
    std::iter::once(0.0).chain(steps).take(len).collect()
}

impl Recording {
    /// The given rows of the recording.
    fn piece(&self, rows: &std::ops::Range<usize>) -> Self {
        Self {
            t: self.t[rows.clone()].to_vec(),
            signals: self.signals.rows(self.dof(), rows),
            sampled: None,
            ..self.clone()
        }
    }
}
