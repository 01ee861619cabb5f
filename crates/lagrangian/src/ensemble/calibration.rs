//! The errors of an ensemble on samples that its members have not seen.

use lagrangian_motion::parallel::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Ask, Prediction, Spread, asked, forward, inverse, spread};
use crate::models::Learned;
use crate::score::{bounded, predict};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{Rollout, RolloutOptions};
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::sort_numbers;
use lagrangian_motion::{Error, Result, Trajectory};

/// The levels of the factors that are stored: 0.01 … 0.99.
pub const LEVELS: usize = 99;

/// The length of the motions that the bands of positions are calibrated on, s.
const SECONDS: f64 = 1.0;
/// The largest number of such motions of a recording.
const MOTIONS: usize = 4;

/// Facts about each predicted signal of an ensemble; `None` for one that the data or the models do not have.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EachSignal<T> {
    /// The fact about accelerations.
    pub acceleration: Option<T>,
    /// The fact about torques.
    pub torque: Option<T>,
    /// The fact about positions in the first second of a motion.
    pub position: Option<T>,
}

/// The scales of the bands of an ensemble.
pub type Calibration = EachSignal<Scale>;

/// The part of the samples that lies in the bands of an ensemble.
pub type Coverage = EachSignal<Covered>;

impl Calibration {
    /// Refuses scales that are not for `n` coordinates.
    pub(super) fn check(&self, n: usize) -> Result<()> {
        let scales = [&self.acceleration, &self.torque, &self.position];
        scales.into_iter().flatten().try_for_each(|s| s.check(n))
    }
}

/// The scale of the bands of one signal.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scale {
    /// The root mean square of the errors of each coordinate that no member could predict, `[n]`.
    pub floor: Vec<f64>,
    /// The half width of a band in deviations, `[n, 99]`, for the levels 0.01 … 0.99.
    pub factors: Vec<Vec<f64>>,
}

impl Scale {
    /// The half width of the band of each coordinate, in deviations.
    ///
    /// # Errors
    /// [`Error::Argument`] for a level outside of 0 … 0.99.
    pub fn factors(&self, level: f64) -> Result<Vec<f64>> {
        let most = LEVELS as f64 / (LEVELS + 1) as f64;
        if !(0.0..=most + 1e-12).contains(&level) {
            return Err(Error::argument("level", level, "between 0 and 0.99"));
        }
        let place = level * (LEVELS + 1) as f64;
        let (before, part) = (place.floor() as usize, place.fract());
        let at = |factors: &Vec<f64>, k: usize| match k {
            0 => 0.0,
            _ => factors[(k - 1).min(LEVELS - 1)],
        };
        let between = |f: &Vec<f64>| at(f, before) + part * (at(f, before + 1) - at(f, before));
        Ok(self.factors.iter().map(between).collect())
    }

    pub(super) fn prediction(&self, spread: Spread) -> Prediction {
        let n = self.floor.len();
        let all = spread.deviation.iter().enumerate();
        let deviation = all.map(|(k, own)| own.hypot(self.floor[k % n])).collect();
        Prediction {
            mean: spread.mean,
            deviation,
            scale: self.clone(),
        }
    }

    fn check(&self, n: usize) -> Result<()> {
        let whole = self.floor.len() == n
            && self.factors.len() == n
            && self.factors.iter().all(|f| f.len() == LEVELS);
        let usable = |x: &f64| x.is_finite() && *x >= 0.0;
        match whole && self.factors.iter().flatten().chain(&self.floor).all(usable) {
            true => Ok(()),
            false => Err(Error::DamagedModel {
                reason: "the calibration of the ensemble is not one of its coordinates".into(),
            }),
        }
    }
}

impl Coverage {
    /// The levels that are reported.
    pub const LEVELS: [f64; 3] = [0.5, 0.8, 0.95];
}

/// The part of the samples of one signal that lies in each of the bands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Covered {
    /// The part over all coordinates, for each of [`Coverage::LEVELS`].
    pub all: Vec<f64>,
    /// The part for each coordinate, `[levels, n]`.
    pub each: Vec<Vec<f64>>,
    /// The number of samples.
    pub samples: usize,
}

/// Errors beside the deviation of the members, by coordinate.
pub(super) struct Errors {
    /// (error, deviation) of each sample, `[n]`.
    of: Vec<Vec<(f64, f64)>>,
    /// Errors of the first samples of motions, where motions exist.
    first: Vec<Vec<f64>>,
}

impl Errors {
    pub(super) fn new(n: usize) -> Self {
        Self {
            of: vec![Vec::new(); n],
            first: vec![Vec::new(); n],
        }
    }

    /// Adds the samples of a motion.
    pub(super) fn add_samples(
        &mut self,
        members: &[&Learned],
        motion: &Trajectory,
        signal: Signal,
    ) {
        let (ask, other): (Ask, Signal) = match signal {
            Signal::Tau => (inverse, Signal::Qdd),
            _ => (forward, Signal::Tau),
        };
        let Some(truth) = motion.values(signal) else {
            return;
        };
        let free = vec![0.0; truth.len()];
        let other = match (motion.values(other), signal) {
            (Some(values), _) => values,
            (None, Signal::Tau) => return,
            (None, _) => &free,
        };
        let given = [&motion.q[..], &motion.qd[..], other];
        if let Some(spread) = asked(members, given, ask) {
            self.add(truth, &spread, |_, x, mean| x - mean);
        }
    }

    /// Adds motions of [`SECONDS`] along a recording, from the measured state at the start of each.
    pub(super) fn add_motions(&mut self, members: &[&Learned], recording: &Trajectory) {
        let (coordinates, n) = (members[0].coordinates(), self.of.len());
        if !members[0].moves() || recording.t.len() < 3 {
            return;
        }
        let windows: Vec<Trajectory> = starts(recording)
            .into_iter()
            .map(|start| {
                let end = recording.t[start] + SECONDS;
                recording.part(start..recording.t.partition_point(|&t| t <= end))
            })
            .collect();
        let followed = |truth: &Trajectory| follow(members, truth, windows.len());
        let followed: Vec<Option<Vec<Rollout>>> = windows.par_iter().map(followed).collect();
        for (truth, motions) in windows.iter().zip(followed) {
            let motions = motions.unwrap_or_default();
            let length = motions.iter().map(|m| m.trajectory.q.len()).min();
            // A motion that some member cannot follow has no band at its end.
            let Some(length) = length.filter(|length| *length > n) else {
                continue;
            };
            let each: Vec<&[f64]> = motions.iter().map(|m| &m.trajectory.q[n..length]).collect();
            let spread = spread(&each);
            for (i, first) in self.first.iter_mut().enumerate() {
                first.push(coordinates.difference(i, truth.q[n + i], spread.mean[i]));
            }
            let difference = |i: usize, x: f64, mean: f64| coordinates.difference(i, x, mean);
            self.add(&truth.q[n..length], &spread, difference);
        }
    }

    fn add(&mut self, truth: &[f64], spread: &Spread, difference: impl Fn(usize, f64, f64) -> f64) {
        let n = self.of.len();
        let pairs = spread.mean.iter().zip(&spread.deviation);
        for (k, (truth, (mean, deviation))) in truth.iter().zip(pairs).enumerate() {
            self.of[k % n].push((difference(k % n, *truth, *mean), *deviation));
        }
    }

    /// The scale of bands that hold these errors; `None` without errors.
    pub(super) fn scale(&self) -> Option<Scale> {
        if self.of.iter().any(Vec::is_empty) {
            return None;
        }
        let floors = self.of.iter().zip(&self.first).map(|(all, first)| {
            let own: Vec<f64> = match first.is_empty() {
                true => all.iter().map(|(error, _)| *error).collect(),
                false => first.clone(),
            };
            let squares: f64 = own.iter().map(|x| x * x).sum();
            (squares / own.len() as f64).sqrt()
        });
        let floor: Vec<f64> = floors.collect();
        let factors = self.of.iter().zip(&floor).map(|(all, floor)| {
            let mut sizes: Vec<f64> = all.iter().map(|e| relative(*e, *floor)).collect();
            sort_numbers(&mut sizes);
            (1..=LEVELS).map(|k| quantile(&sizes, k)).collect()
        });
        let scale = Scale {
            factors: factors.collect(),
            floor,
        };
        scale.check(self.of.len()).is_ok().then_some(scale)
    }

    /// The part of the errors that lies in the bands of a scale.
    pub(super) fn covered(&self, scale: &Scale) -> Option<Covered> {
        let inside = |i: usize, factor: f64| {
            let own = self.of[i].iter();
            own.filter(|e| relative(**e, scale.floor[i]) <= factor)
                .count() as f64
        };
        let samples = self.of.first().map_or(0, Vec::len);
        let (n, count) = (self.of.len(), samples as f64);
        let each = Coverage::LEVELS.map(|level| {
            let factors = scale.factors(level).unwrap_or_default();
            let parts = factors
                .iter()
                .enumerate()
                .map(|(i, f)| inside(i, *f) / count);
            parts.collect::<Vec<f64>>()
        });
        let all = each
            .iter()
            .map(|parts| parts.iter().sum::<f64>() / n as f64);
        (samples > 0).then(|| Covered {
            all: all.collect(),
            each: each.to_vec(),
            samples,
        })
    }
}

/// The size of an error in deviations, where 0 over 0 is 0.
fn relative((error, deviation): (f64, f64), floor: f64) -> f64 {
    let expected = deviation.hypot(floor);
    if error.abs() <= 0.0 {
        0.0
    } else {
        error.abs() / expected
    }
}

/// The conformal quantile of sorted sizes at `k` of a hundred: with m of them the one of rank ⌈(m + 1) k/100⌉.
fn quantile(sizes: &[f64], k: usize) -> f64 {
    let rank = ((sizes.len() + 1) * k).div_ceil(LEVELS + 1);
    sizes[rank.clamp(1, sizes.len()) - 1]
}

/// The motion of each member from the start of `truth`, one of `count` such motions; `None` where a member yields no motion.
fn follow(members: &[&Learned], truth: &Trajectory, count: usize) -> Option<Vec<Rollout>> {
    let options = bounded(&RolloutOptions::for_comparison(), truth, count);
    let motion = |member: &&Learned| predict(*member, truth, &options).ok();
    members.iter().map(motion).collect()
}

/// The samples at which motions begin along a recording, evenly spread.
fn starts(recording: &Trajectory) -> Vec<usize> {
    let (Some(first), Some(last)) = (recording.t.first(), recording.t.last()) else {
        return Vec::new();
    };
    let count = (((last - first) / SECONDS) as usize).clamp(1, MOTIONS);
    let at = |k: usize| {
        let time = first + (last - first) * k as f64 / count as f64;
        recording.t.partition_point(|&t| t < time)
    };
    (0..count)
        .map(at)
        .filter(|s| s + 2 < recording.t.len())
        .collect()
}
