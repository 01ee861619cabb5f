//! The error of predictions a short time ahead, and what new motions can expect.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use super::bounded;
use super::predictable::natural_period;
use super::restarts::windows;
use super::valid_time::NormalisedError;
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{Hold, Rollout, RolloutOptions, rollout_recorded};
use lagrangian_motion::statistics::{deviation, mean, median};
use lagrangian_motion::{Coordinates, Result, Trajectory};

/// The time ahead, s, where it suits the recordings …
const AHEAD: f64 = 0.5;
/// … and is of the order of their natural period; else this part of that period.
const PERIODS: std::ops::Range<f64> = 0.02..5.0;
const PART: f64 = 0.25;
/// The fewest samples within that time.
const SAMPLES: f64 = 4.0;
/// The largest number of predictions.
const STARTS: usize = 120;
/// The logarithm of the factor between the errors on two sets of many motions of the same kind, and what fewer and more different ones
/// add to it.
const WIDE: f64 = 0.6;
const SPREAD: f64 = 0.4;
/// The part of what noise explains that may be an error of the model.
const NOISE_LEFT: f64 = 0.5;
/// Fewer motions than these say little of others.
const FEW: usize = 4;
/// Errors below this part of the deviation are as good as none.
const SLIGHT: f64 = 1e-3;
/// The error of a prediction that ends early, and the largest of all, in deviations.
const LOST: f64 = 10.0;

/// The error of predictions a short time ahead, from states that were recorded, in deviations of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Forecast {
    /// The time ahead, s.
    pub seconds: f64,
    /// The same in natural periods of the motion, the median over the recordings.
    pub periods: f64,
    /// The number of motions and of predictions.
    pub motions: usize,
    /// See `motions`.
    pub starts: usize,
    /// Root mean square over coordinates and starts of the errors of q in its deviations, on the circle for angles; a prediction that
    /// ends early counts 10.
    pub error: f64,
    /// The part of it that the uncertainty of the recorded states explains.
    pub noise: f64,
    /// The deviation of the logarithm of the error from motion to motion.
    pub spread: f64,
    /// The range that holds the error on new motions like these in nine of ten cases, least and largest.
    pub range: [f64; 2],
}

impl Forecast {
    /// The error of the model itself: what noise does not explain.
    #[must_use]
    pub fn own(&self) -> f64 {
        (self.error.powi(2) - self.noise.powi(2)).max(0.0).sqrt()
    }

    /// With the range for new motions (ADR 0131).
    fn with_range(mut self) -> Self {
        let few = (self.motions as f64).sqrt().recip();
        let factor = (WIDE + few * (WIDE + SPREAD * self.spread)).exp();
        let most = (self.own() + NOISE_LEFT * self.noise) * factor;
        let range = [self.own() / factor, most.max(SLIGHT)];
        self.range = range.map(|error| if error < SLIGHT { 0.0 } else { error });
        self
    }

    /// The forecast in words.
    #[must_use]
    pub fn sentence(&self) -> String {
        let percent = |part: f64| match 100.0 * part {
            x if x >= 10.0 => format!("{x:.0}"),
            x if x >= 0.1 || x <= 0.0 => format!("{x:.1}"),
            x => format!("{x:.0e}"),
        };
        let [least, most] = self.range;
        let expected = match least > 0.0 {
            true => format!("{} … {} %", percent(least), percent(most)),
            false => format!("at most {} %", percent(most)),
        };
        let ahead = match self.seconds == AHEAD {
            true => "half a second".into(),
            false => format!("{:.2} s", self.seconds),
        };
        format!(
            "{ahead} ahead ({:.2} periods of the motion) it errs by {} % of the motion's spread; on new motions expect {expected}",
            self.periods,
            percent(self.error)
        )
    }

    /// What limits the forecast most, and what to do.
    pub(super) fn remedy(&self) -> &'static str {
        if self.noise >= self.own() {
            "most of it is the noise of the recorded states: record more motions, or with less noise"
        } else if self.motions < FEW {
            "more motions that are held back, or given for validation, would narrow the range; fit longer, or record more motions"
        } else {
            "noise explains little of it: something may be missing, such as friction (`forces`), play, or a coordinate or force that was not recorded; or fit longer, or record more motions"
        }
    }
}

/// A start within a motion.
struct Start {
    motion: usize,
    truth: Trajectory,
}

/// The time ahead and the natural period, s; `None` without motion.
fn horizon(coordinates: &Coordinates, motions: &[Trajectory]) -> Option<[f64; 2]> {
    let moving = || motions.iter().filter(|m| m.len() > 1);
    let duration = |m: &Trajectory| m.t[m.len() - 1] - m.t[0];
    let longest = moving().map(duration).reduce(f64::max)?;
    let step = moving().map(|m| duration(m) / (m.len() - 1) as f64);
    let step = step.reduce(f64::max)?;
    let period = |m: &Trajectory| natural_period(m, &NormalisedError::new(m, coordinates));
    let period = median(moving().map(period).collect());
    let suits = longest >= 2.0 * AHEAD && AHEAD >= SAMPLES * step;
    let seconds = match suits && PERIODS.contains(&(AHEAD / period)) {
        true => AHEAD,
        false => (PART * period).min(0.5 * longest).max(SAMPLES * step),
    };
    Some([seconds, period])
}

/// The forecast of a model on motions that it has not seen; `None` for a model without forward dynamics or with drives, and for motions
/// that are too short or stopped.
///
/// # Errors
/// As [`score`](crate::score()).
pub(super) fn forecast(
    model: &dyn Model,
    motions: &[Trajectory],
    options: &RolloutOptions,
) -> Result<Option<Forecast>> {
    let Some([seconds, period]) = horizon(model.coordinates(), motions) else {
        return Ok(None);
    };
    let starts = starts(motions, seconds);
    if !model.moves() || model.driven().is_some() || starts.is_empty() {
        return Ok(None);
    }
    let spread = Spread::of(motions, model.coordinates());
    let truths: Vec<&Trajectory> = starts.iter().map(|own| &own.truth).collect();
    let forced = truths.iter().any(|own| !own.tau.is_empty());
    let predicted = |hold: Hold| -> Result<_> {
        let predictions = predictions(model, &truths, hold, options)?;
        let errors = spread.errors(&truths, &predictions);
        Ok((errors.iter().sum::<f64>(), hold, errors, predictions))
    };
    let mut best = predicted(Hold::Previous)?;
    if forced {
        // Whether forces were held or moved on between the samples is not known.
        let linear = predicted(Hold::Linear)?;
        if linear.0 < best.0 {
            best = linear;
        }
    }
    let (_, hold, errors, nominal) = best;
    let disturbed: Vec<Trajectory> = truths.iter().zip(0..).map(disturbed).collect();
    let disturbed: Vec<&Trajectory> = disturbed.iter().collect();
    let moved = predictions(model, &disturbed, hold, options)?;
    let noise = spread.noise(&truths, &nominal, &moved);
    let logarithms = logarithms(&starts, &errors);
    let root = |values: &[f64]| mean(&mut values.iter().copied()).sqrt();
    let forecast = Forecast {
        seconds,
        periods: seconds / period,
        motions: logarithms.len(),
        starts: starts.len(),
        error: root(&errors),
        noise: root(&noise),
        spread: deviation(&mut logarithms.iter().copied()),
        range: [0.0; 2],
    };
    Ok((!options.stop.is_asked()).then(|| forecast.with_range()))
}

/// The logarithm of the error in each motion, from the squared errors of its starts.
fn logarithms(starts: &[Start], squares: &[f64]) -> Vec<f64> {
    let pairs: Vec<(usize, f64)> = (starts.iter().zip(squares))
        .map(|(start, square)| (start.motion, *square))
        .collect();
    let of_motion = |own: &[(usize, f64)]| {
        let square = mean(&mut own.iter().map(|(_, square)| *square));
        0.5 * square.max(f64::MIN_POSITIVE).ln()
    };
    pairs.chunk_by(|a, b| a.0 == b.0).map(of_motion).collect()
}

/// Starts in all motions, evenly spread.
fn starts(motions: &[Trajectory], seconds: f64) -> Vec<Start> {
    let own = |(motion, t): (usize, &Trajectory)| {
        let pieces = windows(t, seconds).into_iter();
        pieces
            .map(move |truth| Start { motion, truth })
            .collect::<Vec<_>>()
    };
    let all: Vec<Start> = motions.iter().enumerate().flat_map(own).collect();
    let every = all.len().div_ceil(STARTS).max(1);
    all.into_iter().step_by(every).collect()
}

fn predictions(
    model: &dyn Model,
    truths: &[&Trajectory],
    hold: Hold,
    options: &RolloutOptions,
) -> Result<Vec<Option<Rollout>>> {
    let own = |truth: &&Trajectory| match options.stop.is_asked() {
        true => Ok(None),
        false => {
            let options = bounded(options, truth, truths.len());
            rollout_recorded(model, truth, hold, &options).map(Some)
        }
    };
    truths.par_iter().map(own).collect()
}

/// The motion with its first state off by one standard error in each component, up or down.
fn disturbed((truth, seed): (&&Trajectory, u64)) -> Trajectory {
    let (mut motion, n) = ((*truth).clone(), truth.dof());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let errors = motion.errors.clone();
    let pairs = [
        (&mut motion.signals.q, errors.q),
        (&mut motion.signals.qd, errors.qd),
    ];
    for (values, errors) in pairs {
        for (x, error) in values.iter_mut().zip(&errors).take(n) {
            *x += if rng.random() { *error } else { -error };
        }
    }
    motion
}

/// Deviations of the coordinates over all motions, `[n]`.
struct Spread<'a> {
    coordinates: &'a Coordinates,
    sigma: Vec<f64>,
}

impl<'a> Spread<'a> {
    fn of(motions: &[Trajectory], coordinates: &'a Coordinates) -> Self {
        let n = coordinates.dof();
        let sigma = |i: usize| {
            let column = motions
                .iter()
                .flat_map(|m| m.q.iter().skip(i).step_by(n).copied());
            let column: Vec<f64> = column.collect();
            let own = super::valid_time::deviation(&column, 1, 0);
            if coordinates.is_circle(i) {
                own.min(std::f64::consts::PI / 3.0_f64.sqrt())
            } else {
                own
            }
        };
        Self {
            coordinates,
            sigma: (0..n).map(sigma).collect(),
        }
    }

    /// Mean squares over the coordinates of the distance of the last positions.
    fn errors(&self, truths: &[&Trajectory], predictions: &[Option<Rollout>]) -> Vec<f64> {
        let own = |(truth, prediction): (&&Trajectory, &Option<Rollout>)| match prediction {
            Some(own) if own.outcome.is_finished() => {
                self.distance(last(truth), last(&own.trajectory))
            }
            _ => LOST * LOST,
        };
        truths.iter().zip(predictions).map(own).collect()
    }

    /// What errors of the first and last states explain.
    fn noise(
        &self,
        truths: &[&Trajectory],
        nominal: &[Option<Rollout>],
        moved: &[Option<Rollout>],
    ) -> Vec<f64> {
        let own = |((truth, a), b): ((&&Trajectory, &Option<Rollout>), &Option<Rollout>)| {
            let grown = match (a, b) {
                (Some(a), Some(b)) if a.outcome.is_finished() && b.outcome.is_finished() => {
                    self.distance(last(&a.trajectory), last(&b.trajectory))
                }
                _ => 0.0,
            };
            let n = self.sigma.len();
            let from = truth.errors.q.len().saturating_sub(n);
            let ends = truth.errors.q[from..].iter().zip(&self.sigma);
            grown + ends.map(|(e, s)| (e / s).powi(2)).sum::<f64>() / n as f64
        };
        truths.iter().zip(nominal).zip(moved).map(own).collect()
    }

    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let squares = (0..self.sigma.len())
            .map(|i| (self.coordinates.difference(i, a[i], b[i]) / self.sigma[i]).powi(2));
        let mean = squares.sum::<f64>() / self.sigma.len() as f64;
        if mean.is_finite() {
            mean.min(LOST * LOST)
        } else {
            LOST * LOST
        }
    }
}

/// The last position.
fn last(motion: &Trajectory) -> &[f64] {
    &motion.q[motion.q.len() - motion.dof()..]
}
