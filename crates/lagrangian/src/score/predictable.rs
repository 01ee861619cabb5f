//! The time for which a motion can be predicted: whatever the model, an error of the first state grows.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::following;
use super::valid_time::{NormalisedError, deviation};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_motion::Signal;
use lagrangian_motion::Trajectory;

/// The largest number of natural periods for which a model must follow a motion.
const PERIODS: f64 = 3.0;
/// The number of points of a natural period at which the growth of errors is known.
const POINTS: f64 = 40.0;
/// The step of the differences of accelerations over the state, in deviations of the motion; a finite step smooths friction at rest.
const STEP: f64 = 0.02;
/// The error of the first state that is granted to all data, in deviations of the motion.
const GRANTED: f64 = 0.02;
/// The part of the error up to which a motion is followed that the error of the first state may use up.
const USED_UP: f64 = 0.5;
/// Degrees of freedom for which the growth of errors is computed: its cost grows with the cube.
const LARGEST: usize = 24;

/// The time for which a good model follows a motion from its first state, s (theory.md, 139): until an error of the first
/// state has grown, by the linearised equation of motion along the recording, to half of the allowed error, and for three natural
/// periods at most. The error of the first state is taken from the prediction itself, before forces can have moved it far.
///
/// 0 where this is unknown: without motion, for a model that moves by drives, or in more than 24 degrees of freedom.
pub(super) fn predictable_seconds(
    model: &dyn Model,
    truth: &Trajectory,
    prediction: &Trajectory,
) -> f64 {
    let n = truth.dof();
    if n == 0 || n > LARGEST || truth.len() < 3 || model.driven().is_some() {
        return 0.0;
    }
    let error = &NormalisedError::new(truth, model.coordinates());
    let period = natural_period(truth, error);
    let points = points(&truth.t, period);
    let first = first_error(truth, prediction, error, period);
    let slopes = Slopes::new(model, truth, error, &points);
    let size = 2 * n;
    let mut growth = Mat::<f64>::identity(size, size);
    for (i, pair) in points.windows(2).enumerate() {
        let half = 0.5 * (truth.t[pair[1]] - truth.t[pair[0]]);
        // The trapezoidal rule, which is stable where friction is stiff.
        let unit = |r: usize, c: usize| if r == c { 1.0 } else { 0.0 };
        let step = |sign: f64, k: usize| {
            Mat::from_fn(size, size, |r, c| {
                unit(r, c) + sign * half * slopes.at(k, r, c)
            })
        };
        growth = step(-1.0, i + 1)
            .partial_piv_lu()
            .solve(step(1.0, i) * growth);
        let rms = growth.norm_l2() / (size as f64).sqrt();
        if rms.is_nan() || rms * first > USED_UP * following(truth) {
            return truth.t[pair[0]] - truth.t[0];
        }
    }
    points.last().map_or(0.0, |k| truth.t[*k] - truth.t[0])
}

/// 2π σ(q̇)/σ(q̈) of the fastest coordinate, or 2π σ(q)/σ(q̇) without accelerations, s.
pub(super) fn natural_period(truth: &Trajectory, error: &NormalisedError<'_>) -> f64 {
    let n = truth.dof();
    let rate = |i: usize| match truth.values(Signal::Qdd) {
        Some(qdd) => deviation(qdd, n, i) / error.sigma_qd[i],
        None => error.sigma_qd[i] / error.sigma_q[i],
    };
    std::f64::consts::TAU / (0..n).map(rate).fold(f64::MIN_POSITIVE, f64::max)
}

/// Samples of the first natural periods, not closer than needed.
fn points(t: &[f64], period: f64) -> Vec<usize> {
    let mut points = vec![0];
    let mut last = t[0];
    for (k, &time) in t.iter().enumerate().skip(1) {
        if time - t[0] > PERIODS * period {
            break;
        }
        if time - last >= period / POINTS {
            points.push(k);
            last = time;
        }
    }
    points
}

/// The root mean square of the normalised error over a twentieth of a period: an error that is there at once is one of the first state.
fn first_error(
    truth: &Trajectory,
    prediction: &Trajectory,
    error: &NormalisedError<'_>,
    period: f64,
) -> f64 {
    let near = truth
        .t
        .partition_point(|t| t - truth.t[0] <= period / 20.0)
        .max(2);
    let errors = (1..near.min(prediction.len())).map(|k| error.at(truth, prediction, k).powi(2));
    let (sum, count) = errors.fold((0.0, 0.0), |(s, c), e| (s + e, c + 1.0));
    (sum / f64::max(count, 1.0)).sqrt().max(GRANTED)
}

/// The linearised equation of motion at points of a motion, in deviations of it: ẋ = A x with x = (δq/σ, δq̇/σ).
struct Slopes<'a> {
    error: &'a NormalisedError<'a>,
    /// q̈ at each point, disturbed along each component up and down, `[points, 2 n, 2, n]`.
    qdd: Vec<f64>,
}

impl<'a> Slopes<'a> {
    fn new(
        model: &dyn Model,
        truth: &Trajectory,
        error: &'a NormalisedError<'a>,
        points: &[usize],
    ) -> Self {
        let n = truth.dof();
        let [mut q, mut qd, mut tau] = [const { Vec::new() }; 3];
        for &k in points {
            for (i, sign) in (0..2 * n).flat_map(|i| [(i, 1.0), (i, -1.0)]) {
                let (row, at) = (truth.row(k), q.len());
                q.extend(row.q);
                qd.extend(row.qd);
                tau.extend((0..n).map(|i| row.tau.get(i).copied().unwrap_or(0.0)));
                match i < n {
                    true => q[at + i] += sign * STEP * error.sigma_q[i],
                    false => qd[at + i - n] += sign * STEP * error.sigma_qd[i - n],
                }
            }
        }
        let mut qdd = vec![0.0; q.len()];
        let _ = model.evaluator().forward_dynamics(&q, &qd, &tau, &mut qdd);
        Self { error, qdd }
    }

    /// A at a point, of this row and column.
    fn at(&self, point: usize, row: usize, column: usize) -> f64 {
        let n = self.error.sigma_q.len();
        if row < n {
            let own = if column == row + n { 1.0 } else { 0.0 };
            return own * self.error.sigma_qd[row] / self.error.sigma_q[row];
        }
        let value = |down: usize| self.qdd[((point * 2 * n + column) * 2 + down) * n + row - n];
        (value(0) - value(1)) / (2.0 * STEP * self.error.sigma_qd[row - n])
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::rollout::{RolloutOptions, free, rollout, times};

    /// The predictable time of a motion of 20 s that was measured with an error of its first state, in periods.
    fn periods(system: &str, q0: &[f64], qd0: &[f64], off: f64) -> f64 {
        let model = by_name(system, &[]).unwrap();
        let clock = times(20.0, 0.01).unwrap();
        let moved = |q0: &[f64]| {
            let options = RolloutOptions::default();
            rollout(&*model, q0, qd0, &clock, &free, &options)
                .unwrap()
                .trajectory
        };
        let start: Vec<f64> = q0.iter().map(|q| q + off).collect();
        let (truth, prediction) = (moved(q0), moved(&start));
        let error = NormalisedError::new(&truth, model.coordinates());
        predictable_seconds(&*model, &truth, &prediction) / natural_period(&truth, &error)
    }

    #[test]
    fn an_oscillation_is_predictable_for_three_periods_and_less_where_its_start_is_uncertain() {
        let exact = periods("mass-spring", &[1.0], &[0.0], 0.0);
        assert!((2.9..=3.0).contains(&exact), "{exact}");
        // Errors of a spring do not grow: 0.07 deviations use up less than is allowed, 0.4 more.
        assert!(periods("mass-spring", &[1.0], &[0.0], 0.05) > 2.9);
        assert!(periods("mass-spring", &[1.0], &[0.0], 0.3) < 0.1);
    }

    #[test]
    fn an_unstable_start_and_chaos_are_not_predictable_for_long() {
        let (calm, wild) = (
            periods("pendulum", &[1.0], &[0.0], 0.0),
            periods("pendulum", &[3.1], &[0.0], 0.0),
        );
        assert!(calm > 2.9 && wild < 0.5 * calm, "{calm} {wild}");
        let (calm, wild) = (
            periods("double-pendulum", &[0.2, 0.3], &[0.0; 2], 0.0),
            periods("double-pendulum", &[2.0, 2.5], &[0.0; 2], 0.0),
        );
        assert!(wild < 0.6 * calm, "{calm} {wild}");
    }
}
