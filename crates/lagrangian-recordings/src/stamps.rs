//! Repair of time stamps that jitter, from positions and velocities of several coordinates.
//!
//! A log whose rows are stamped when they are written, not when they are sampled, contradicts itself: Δq ≠ v̄ dt, where v̄ is the mean velocity
//! of a step. Each coordinate tells the true step, and all must agree: dt = Σⱼ Δqⱼ v̄ⱼ/sⱼ² / Σⱼ v̄ⱼ²/sⱼ², where the recorded step is one more
//! coordinate, of velocity 1. The deviations s are found by expectation and maximisation (Dempster, Laird and Rubin,
//! J. R. Statist. Soc. B 39, 1977).

use std::borrow::Cow;
use std::ops::Range;

use super::Recording;
use super::derivatives::GAP;
use super::local_polynomial::{Series, median_step, segments};
use super::window::noise_variance;
use lagrangian_motion::statistics::root_mean_square;

/// Fewer steps than this do not tell the deviations.
const FEWEST: usize = 16;
/// Rounds of expectation and maximisation, and the deviation of a recorded step, in steps, in the first.
const ROUNDS: usize = 30;
const FIRST: f64 = 0.1;
/// Stamps are wrong where the steps that the *other* coordinates tell leave a coordinate this many times less of Δq − v̄ dt.
const EXPLAINED: f64 = 2.0;
/// Stamps are right where they make the noise of the positions less by this factor: a motion that is fast for its rate is not jitter.
const SMOOTHER: f64 = 1.5;
/// The largest factor between a repaired step and the recorded one.
const LARGEST: f64 = 10.0;

/// A coordinate during a step.
struct Change {
    /// Δq.
    whole: f64,
    /// v̄ times the median step, of fourth order.
    mean: f64,
    /// Difference of v̄ to that of second order: an upper bound of its error.
    uncertain: f64,
}

/// The recorded steps, in median steps, and after them the coordinates that move: `[1 + n][steps]`.
struct Steps(Vec<Vec<Change>>);

impl Steps {
    /// The steps that begin at the samples `at`, with two samples on either side.
    fn new(recording: &Recording, at: &[usize]) -> Self {
        let (n, t) = (recording.dof(), &recording.t);
        let step = median_step(t);
        let stamp = |k: &usize| Change {
            whole: (t[k + 1] - t[*k]) / step,
            mean: 1.0,
            uncertain: 0.0,
        };
        let mut steps = Self(vec![at.iter().map(stamp).collect()]);
        for c in 0..n {
            let change = |k: &usize| {
                let v = |k: usize| step * recording.qd[k * n + c];
                let correction = (v(k + 2) - v(k + 1) - v(*k) + v(k - 1)) / 24.0;
                Change {
                    whole: recording.q[(k + 1) * n + c] - recording.q[k * n + c],
                    mean: 0.5 * (v(*k) + v(k + 1)) - correction,
                    uncertain: correction.abs(),
                }
            };
            let own: Vec<Change> = at.iter().map(change).collect();
            if steps.residual(&own, |k| steps.0[0][k].whole) > 0.0 {
                steps.0.push(own);
            }
        }
        steps
    }

    /// Length of a step and its variance, as all but one tell it.
    fn told(&self, k: usize, deviations: &[f64], but: usize) -> [f64; 2] {
        let (mut sum, mut precision) = (0.0, 0.0);
        for (c, (own, deviation)) in self.0.iter().zip(deviations).enumerate() {
            if c != but {
                sum += own[k].whole * own[k].mean / deviation.powi(2);
                precision += (own[k].mean / deviation).powi(2);
            }
        }
        [sum / precision, 1.0 / precision]
    }

    /// Root mean square of Δq − v̄ dt.
    fn residual(&self, own: &[Change], dt: impl Fn(usize) -> f64) -> f64 {
        let residual = |(k, own): (usize, &Change)| own.whole - own.mean * dt(k);
        root_mean_square(&mut own.iter().enumerate().map(residual))
    }

    fn deviations(&self) -> Vec<f64> {
        let recorded = |k: usize| self.0[0][k].whole;
        let recorded = |own: &Vec<Change>| self.residual(own, recorded);
        let mut deviations: Vec<f64> = self.0.iter().map(recorded).collect();
        deviations[0] = FIRST;
        for _ in 0..ROUNDS {
            let told = (0..self.0[0].len()).map(|k| self.told(k, &deviations, usize::MAX));
            let told: Vec<[f64; 2]> = told.collect();
            let deviation = |own: &Vec<Change>| {
                let pairs = own.iter().zip(&told);
                let mut spread = pairs.map(|(own, told)| own.mean * told[1].sqrt());
                let residual = self.residual(own, |k| told[k][0]);
                residual.hypot(root_mean_square(&mut spread))
            };
            deviations = self.0.iter().map(deviation).collect();
        }
        deviations
    }

    /// Geometric mean of the factors by which the steps that the others tell lessen what the error of v̄ does not explain.
    fn explained(&self, deviations: &[f64]) -> f64 {
        let factor = |c: usize| {
            let mut unexplained = self.0[c].iter().zip(&self.0[0]).map(|(own, recorded)| {
                ((own.whole - own.mean * recorded.whole).abs() - own.uncertain).max(0.0)
            });
            root_mean_square(&mut unexplained)
                / self.residual(&self.0[c], |k| self.told(k, deviations, c)[0])
        };
        let count = self.0.len() - 1;
        let all: f64 = (1..=count).map(factor).product();
        all.powf(1.0 / count as f64)
    }
}

/// The recording with stamps that agree with positions and velocities of two or more coordinates, where the recorded ones do not.
fn repaired(recording: &Recording) -> Option<Recording> {
    let t = &recording.t;
    if recording.dof() < 2 || recording.qd.is_empty() || recording.validate().is_err() {
        return None;
    }
    let all = segments(t, GAP);
    let inside = |s: Range<usize>| s.start + 1..s.end.saturating_sub(2).max(s.start + 1);
    let pieces: Vec<Range<usize>> = all.iter().cloned().map(inside).collect();
    let at: Vec<usize> = pieces.iter().flat_map(Clone::clone).collect();
    let steps = Steps::new(recording, &at);
    if steps.0.len() < 3 || at.len() < FEWEST {
        return None;
    }
    let deviations = steps.deviations();
    let corrected = |(k, Change { whole, .. }): (usize, &Change)| {
        let dt = steps.told(k, &deviations, usize::MAX)[0];
        dt.clamp(whole / LARGEST, whole * LARGEST)
    };
    let told: Vec<f64> = steps.0[0].iter().enumerate().map(corrected).collect();
    // A lag of the velocities, or a motion that is fast for its rate, would make neighbouring corrections alike.
    let corrections = told.iter().zip(&steps.0[0]).map(|(dt, own)| dt - own.whole);
    let corrections: Vec<f64> = corrections.collect();
    let mut changes = corrections.windows(2).map(|w| w[1] - w[0]);
    let is_rough =
        root_mean_square(&mut changes) > root_mean_square(&mut corrections.iter().copied());
    if !(is_rough && steps.explained(&deviations) > EXPLAINED) {
        return None;
    }
    let (mut repaired, mut told) = (t.clone(), told.into_iter());
    for piece in pieces.into_iter().filter(|piece| !piece.is_empty()) {
        // Velocities in another unit change no duration.
        let own: Vec<f64> = told.by_ref().take(piece.len()).collect();
        let scale = (t[piece.end] - t[piece.start]) / own.iter().sum::<f64>();
        for (k, dt) in piece.zip(own) {
            repaired[k + 1] = repaired[k] + scale * dt;
        }
    }
    let own = Recording {
        t: repaired,
        ..recording.clone()
    };
    (noise(recording, &all) > SMOOTHER * noise(&own, &all)).then_some(own)
}

/// Geometric mean over the coordinates of the deviation of the noise of the positions.
fn noise(recording: &Recording, all: &[Range<usize>]) -> f64 {
    let n = recording.dof();
    let own = |c: usize| {
        let series = Series::of(recording, &recording.q, c);
        0.5 * noise_variance(series, all, 3, 8).ln()
    };
    ((0..n).map(own).sum::<f64>() / n as f64).exp()
}

impl Recording {
    /// The recording with stamps that agree with its positions and velocities.
    pub(crate) fn repaired(&self) -> Cow<'_, Self> {
        repaired(self).map_or(Cow::Borrowed(self), Cow::Owned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lagrangian_motion::{Coordinates, Signals};
    use rand::{RngExt, SeedableRng};

    /// Two coordinates at 50 Hz, sampled with `jitter`, in steps, that the stamps do not tell; the true times.
    fn recording(jitter: f64, noise: f64, fast: f64) -> (Recording, Vec<f64>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let t: Vec<f64> = (0..400).map(|k| 0.02 * f64::from(k)).collect();
        let sampled: Vec<f64> = t.iter().map(|t| t + 0.02 * jitter * normal()).collect();
        let q = |t: &f64| [(fast * t).sin(), (1.7 * fast * t).cos()];
        let qd = |t: &f64| {
            [
                fast * (fast * t).cos(),
                -1.7 * fast * (1.7 * fast * t).sin(),
            ]
        };
        let mut noisy = |x: f64| x + noise * normal();
        let signals = Signals {
            q: sampled.iter().flat_map(q).map(&mut noisy).collect(),
            qd: sampled.iter().flat_map(qd).map(&mut noisy).collect(),
            ..Signals::default()
        };
        let recording = Recording::new("swing", Coordinates::lines(2), t, signals);
        (recording, sampled)
    }

    #[test]
    fn stamps_that_jitter_are_repaired_and_others_kept() {
        for noise in [0.0, 1e-4, 1e-3] {
            let (jittering, truth) = recording(0.1, noise, 3.0);
            let repaired = jittering.repaired();
            let error = |t: &[f64]| {
                let own = t.windows(2).zip(truth.windows(2));
                own.map(|(a, b)| (a[1] - a[0] - b[1] + b[0]).powi(2))
                    .sum::<f64>()
            };
            assert!(error(&repaired.t) < 0.1 * error(&jittering.t), "{noise}");
            for fast in [1.0, 3.0, 30.0] {
                let (good, _) = recording(0.0, noise, fast);
                assert!(
                    matches!(good.repaired(), Cow::Borrowed(_)),
                    "{noise} {fast}"
                );
            }
        }
    }
}
