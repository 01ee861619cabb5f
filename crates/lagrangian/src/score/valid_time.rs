//! The time for which a prediction stayed valid (theory.md, equation 26).

use lagrangian_motion::statistics::{mean, positive, root_mean_square};
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};

/// The time for which a prediction stayed valid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValidTime {
    /// Time from the first sample to the first at which the error exceeds the threshold, s; the duration where
    /// none does.
    pub seconds: f64,
    /// Whether the error exceeded the threshold at all; otherwise the true value is longer.
    pub exceeded: bool,
}

/// Valid prediction time: the first t at which the normalised error of (q, q̇)
///
///   ε(t) = √( 1/(2n) Σᵢ ((x̂ᵢ(t) − xᵢ(t)) / σᵢ)² )
///
/// exceeds `threshold` (0.5 is usual), with σᵢ the standard deviation of component i of the truth over time
/// (Vlachas et al., Neural Networks 126, 2020, equation 17). Angles are compared on the circle, and their σ is at
/// most that of the uniform distribution there, π/√3; a component that does not move has σ = 1, a coordinate that deviates by less than
/// twice its known standard error does not count, and a velocity that hardly changes has that with which its position crosses σ within the
/// motion.
///
/// A prediction that ends before the truth is invalid from there on.
///
/// # Errors
/// [`Error::Shape`] where the degrees of freedom differ or the prediction is longer, [`Error::Argument`] where
/// the threshold is not positive or the time stamps differ, and the errors of [`Trajectory::validate`].
pub fn valid_prediction_time(
    truth: &Trajectory,
    prediction: &Trajectory,
    coordinates: &Coordinates,
    threshold: f64,
) -> Result<ValidTime> {
    if !(threshold.is_finite() && threshold > 0.0) {
        let must = "a finite number above 0, usually 0.5";
        return Err(Error::argument("threshold", threshold, must));
    }
    comparable(truth, prediction, coordinates)?;
    let error = NormalisedError::new(truth, coordinates);
    let since = |k: usize| truth.t[k] - truth.t[0];
    // An error that is NaN is above every threshold.
    let is_valid = |k: usize| error.at(truth, prediction, k) <= threshold;
    let ended = Some(prediction.len()).filter(|len| *len < truth.len());
    let bad = (0..prediction.len()).find(|&k| !is_valid(k)).or(ended);
    Ok(ValidTime {
        seconds: since(bad.unwrap_or(truth.len() - 1)),
        exceeded: bad.is_some(),
    })
}

fn comparable(
    truth: &Trajectory,
    prediction: &Trajectory,
    coordinates: &Coordinates,
) -> Result<()> {
    truth.validate()?;
    prediction.validate()?;
    let (n, remedy) = (
        coordinates.dof(),
        "compare trajectories of the same system, with at least one sample",
    );
    Error::check_shape("a state of the truth", truth.dof(), n, remedy)?;
    Error::check_shape("a state of the prediction", prediction.dof(), n, remedy)?;
    let (found, most) = (prediction.len(), truth.len());
    if found > most {
        let remedy = "cut the prediction where the truth ends";
        return Err(Error::shape("the prediction", found, most, remedy));
    }
    let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-9 * a.abs().max(1.0);
    if let Some(k) = truth.t.iter().zip(&prediction.t).position(differs) {
        let value = format!("{} where the truth has {}", prediction.t[k], truth.t[k]);
        let must = "the same in both: roll out at the time stamps of the truth";
        return Err(Error::argument("t", value, must));
    }
    Ok(())
}

/// The error of a prediction in deviations of the truth.
pub(super) struct NormalisedError<'a> {
    coordinates: &'a Coordinates,
    /// As [`deviations`], `[n]`.
    pub(super) sigma_q: Vec<f64>,
    /// The same with ∞ for a coordinate that rests.
    moving: Vec<f64>,
    /// Deviation of each velocity, `[n]`.
    pub(super) sigma_qd: Vec<f64>,
}

impl<'a> NormalisedError<'a> {
    pub(super) fn new(truth: &Trajectory, coordinates: &'a Coordinates) -> Self {
        let sigma_q = deviations(coordinates, &truth.q);
        Self {
            coordinates,
            moving: without_rest(sigma_q.clone(), std::slice::from_ref(truth)),
            sigma_q,
            sigma_qd: of_velocities(truth),
        }
    }

    /// The root mean square over the components of the error at sample `k`.
    pub(super) fn at(&self, truth: &Trajectory, prediction: &Trajectory, k: usize) -> f64 {
        let n = self.sigma_q.len();
        let component = |i: usize| {
            let j = k * n + i;
            let dq = self.coordinates.difference(i, prediction.q[j], truth.q[j]);
            let dqd = prediction.qd[j] - truth.qd[j];
            (dq / self.sigma_q[i]).powi(2) + (dqd / self.sigma_qd[i]).powi(2)
        };
        let moving = (0..n).filter(|i| self.moving[*i].is_finite());
        let count = moving.clone().count();
        (moving.map(component).sum::<f64>() / (2 * count) as f64).sqrt()
    }
}

/// Deviation of each velocity, `[n]`: of one that hardly changes that with which its position crosses its own within the motion.
fn of_velocities(truth: &Trajectory) -> Vec<f64> {
    let (n, seconds) = (truth.dof(), duration(truth));
    let own = |i: usize| spread(&truth.qd, n, i).max(spread(&truth.q, n, i) / seconds);
    (0..n).map(|i| positive(own(i))).collect()
}

/// The squares of the accelerations with which velocities, or positions, cross their deviations within motions, mean over these, `[n]`:
/// where something falls the acceleration is constant, and errors in parts of its variance say nothing.
pub(super) fn least_variances(motions: &[Trajectory], n: usize) -> Vec<f64> {
    let square = |motion: &Trajectory, i: usize| {
        let seconds = duration(motion);
        let speed = spread(&motion.qd, n, i).max(spread(&motion.q, n, i) / seconds);
        (speed / seconds).powi(2)
    };
    let own = |i: usize| mean(&mut motions.iter().map(|motion| square(motion, i)));
    (0..n).map(own).collect()
}

/// From the first sample to the last, s.
fn duration(motion: &Trajectory) -> f64 {
    let ends = motion.t.last().zip(motion.t.first());
    ends.map_or(0.0, |(last, first)| last - first)
        .max(f64::MIN_POSITIVE)
}

/// Deviations with ∞ for each coordinate that rests but for its noise, as the mark of a pivot does: there is nothing to predict.
pub(super) fn without_rest(sigma: Vec<f64>, motions: &[Trajectory]) -> Vec<f64> {
    let n = sigma.len();
    let noise = |i: usize| {
        let each = motions
            .iter()
            .flat_map(|m| m.errors.q.iter().skip(i).step_by(n));
        root_mean_square(&mut each.copied())
    };
    // A place that a solver of another program holds drifts by its tolerance.
    let size = |i: usize| {
        let each = motions.iter().flat_map(|m| m.q.iter().skip(i).step_by(n));
        root_mean_square(&mut each.copied())
    };
    let own = |(i, s): (usize, &f64)| match *s < RESTS * noise(i) + HELD * size(i) {
        true => f64::INFINITY,
        false => *s,
    };
    let moving: Vec<f64> = sigma.iter().enumerate().map(own).collect();
    match moving.iter().any(|s| s.is_finite()) {
        true => moving,
        false => sigma,
    }
}

/// A coordinate rests where it deviates by less than this multiple of its standard error, or this part of its size.
const RESTS: f64 = 2.0;
const HELD: f64 = 1e-9;

/// The differences of positions, `[m, n]`, on the circle for angles.
pub(super) fn differences(
    coordinates: &Coordinates,
    truth: &[f64],
    predicted: &[f64],
) -> impl Iterator<Item = f64> {
    let pairs = truth.iter().zip(predicted).enumerate();
    pairs.map(|(k, (x, y))| coordinates.difference(k % coordinates.dof(), *y, *x))
}

/// Deviation of each coordinate of positions `[m, n]`, on the circle at most that of the uniform distribution there, `[n]`.
pub(super) fn deviations(coordinates: &Coordinates, q: &[f64]) -> Vec<f64> {
    let n = coordinates.dof();
    (0..n)
        .map(|i| deviation(q, n, i).min(widest(coordinates, i)))
        .collect()
}

/// The largest deviation of a coordinate.
fn widest(coordinates: &Coordinates, i: usize) -> f64 {
    match coordinates.is_circle(i) {
        true => widest_angle(),
        false => f64::INFINITY,
    }
}

/// The deviation of an angle that takes all values alike.
pub(super) fn widest_angle() -> f64 {
    std::f64::consts::PI / 3.0_f64.sqrt()
}

/// Standard deviation of component i of `[len, n]` values, 1 where it does not vary.
pub(super) fn deviation(values: &[f64], n: usize, i: usize) -> f64 {
    positive(spread(values, n, i))
}

/// Standard deviation of component i of `[len, n]` values, 0 where it varies by rounding alone.
fn spread(values: &[f64], n: usize, i: usize) -> f64 {
    let component = || values.iter().skip(i).step_by(n);
    let count = (values.len() / n) as f64;
    let mean = component().sum::<f64>() / count;
    let variance = component().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    if variance > 1e-24 * (1.0 + mean * mean) {
        variance.sqrt()
    } else {
        0.0
    }
}
