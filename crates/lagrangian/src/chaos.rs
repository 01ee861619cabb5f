//! How long a prediction can be right: Lyapunov exponents and valid prediction times (theory.md, equation 26).

use crate::dynamics::Model;
use crate::integrate::{Control, Dop853, Ending, adaptive};
use crate::rollout::RolloutOptions;
use crate::{Coordinates, Error, Result, State, Trajectory};

/// How long a prediction stayed valid.
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
/// most that of the uniform distribution there, π/√3; a component that does not move has σ = 1.
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
        return Err(Error::Argument {
            name: "threshold",
            value: threshold.to_string(),
            must,
        });
    }
    comparable(truth, prediction, coordinates)?;
    let error = NormalisedError::new(truth, coordinates);
    let since = |k: usize| truth.t[k] - truth.t[0];
    let invalid = |&k: &usize| error.at(truth, prediction, k) > threshold;
    let bad = (0..prediction.len()).find(invalid);
    Ok(match bad {
        Some(k) => ValidTime {
            seconds: since(k),
            exceeded: true,
        },
        None if prediction.len() < truth.len() => ValidTime {
            seconds: since(prediction.len()),
            exceeded: true,
        },
        None => ValidTime {
            seconds: since(truth.len() - 1),
            exceeded: false,
        },
    })
}

/// The normalised error ε of [`valid_prediction_time`] at each sample of the prediction.
///
/// # Errors
/// As [`valid_prediction_time`].
pub fn normalised_error(
    truth: &Trajectory,
    prediction: &Trajectory,
    coordinates: &Coordinates,
) -> Result<Vec<f64>> {
    comparable(truth, prediction, coordinates)?;
    let error = NormalisedError::new(truth, coordinates);
    Ok((0..prediction.len())
        .map(|k| error.at(truth, prediction, k))
        .collect())
}

fn comparable(
    truth: &Trajectory,
    prediction: &Trajectory,
    coordinates: &Coordinates,
) -> Result<()> {
    truth.validate()?;
    prediction.validate()?;
    let shape = |what: &str, found, expected, remedy: &str| Error::Shape {
        what: what.into(),
        found,
        expected,
        remedy: remedy.into(),
    };
    let n = coordinates.dof();
    for (what, trajectory) in [
        ("a state of the truth", truth),
        ("a state of the prediction", prediction),
    ] {
        if trajectory.dof() != n {
            let remedy = "compare trajectories of the same system, with at least one sample";
            return Err(shape(what, trajectory.dof(), n, remedy));
        }
    }
    if prediction.len() > truth.len() {
        let remedy = "cut the prediction where the truth ends";
        return Err(shape(
            "the prediction",
            prediction.len(),
            truth.len(),
            remedy,
        ));
    }
    let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-9 * a.abs().max(1.0);
    if let Some(k) = truth.t.iter().zip(&prediction.t).position(differs) {
        let value = format!("{} where the truth has {}", prediction.t[k], truth.t[k]);
        let must = "the same in both: roll out at the time stamps of the truth";
        return Err(Error::Argument {
            name: "t",
            value,
            must,
        });
    }
    Ok(())
}

struct NormalisedError<'a> {
    coordinates: &'a Coordinates,
    sigma_q: Vec<f64>,
    sigma_qd: Vec<f64>,
}

impl<'a> NormalisedError<'a> {
    fn new(truth: &Trajectory, coordinates: &'a Coordinates) -> Self {
        let n = coordinates.dof();
        let on_circle = std::f64::consts::PI / 3.0_f64.sqrt();
        let sigma_q = (0..n).map(|i| {
            let most = if coordinates.is_circle(i) {
                on_circle
            } else {
                f64::INFINITY
            };
            deviation(&truth.q, n, i).min(most)
        });
        let sigma_qd = (0..n).map(|i| deviation(&truth.qd, n, i));
        Self {
            coordinates,
            sigma_q: sigma_q.collect(),
            sigma_qd: sigma_qd.collect(),
        }
    }

    fn at(&self, truth: &Trajectory, prediction: &Trajectory, k: usize) -> f64 {
        let n = self.sigma_q.len();
        let component = |i: usize| {
            let j = k * n + i;
            let mut dq = prediction.q[j] - truth.q[j];
            if self.coordinates.is_circle(i) {
                dq -= std::f64::consts::TAU * (dq / std::f64::consts::TAU).round();
            }
            let dqd = prediction.qd[j] - truth.qd[j];
            (dq / self.sigma_q[i]).powi(2) + (dqd / self.sigma_qd[i]).powi(2)
        };
        ((0..n).map(component).sum::<f64>() / (2 * n) as f64).sqrt()
    }
}

/// Standard deviation of component i of `[len, n]` values, 1 where it does not vary.
fn deviation(values: &[f64], n: usize, i: usize) -> f64 {
    let component = || values.iter().skip(i).step_by(n);
    let count = (values.len() / n) as f64;
    let mean = component().sum::<f64>() / count;
    let variance = component().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    if variance > 1e-24 * (1.0 + mean * mean) {
        variance.sqrt()
    } else {
        1.0
    }
}

/// Distance of the neighbour in the state space, in SI units.
const SEPARATION: f64 = 1e-8;
/// The neighbour is brought back this often in a run.
const RESTARTS: usize = 400;
/// A neighbour that moves away e³ = 20 times in the second half of a run shows chaos: in regular motion the
/// distance grows like t, twice.
const CHAOTIC_GROWTH: f64 = 3.0;

/// The kind of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Neighbours move apart linearly in time.
    Regular,
    /// Neighbours move apart exponentially.
    Chaotic,
}

/// The largest Lyapunov exponent of one motion, as far as a run of finite length shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Lyapunov {
    /// The mean rate λ at which a neighbour moves away, 1/s.
    pub exponent: f64,
    /// Regular or chaotic, judged by the growth in the second half of the run.
    pub motion: Motion,
    /// The time that was run, s; less than was asked where the motion diverged.
    pub duration: f64,
    /// Running estimates: (t, λ up to t).
    pub convergence: Vec<(f64, f64)>,
}

impl Lyapunov {
    /// The Lyapunov time 1/λ, s, of a chaotic motion.
    #[must_use]
    pub fn time(&self) -> Option<f64> {
        (self.motion == Motion::Chaotic).then(|| 1.0 / self.exponent)
    }
}

/// The largest Lyapunov exponent of the free motion from `start`, by Benettin's method: a neighbour 10⁻⁸ away
/// runs along and is brought back to that distance along its direction 400 times,
///
///   λ = 1/T Σ ln(dₖ/d₀)
///
/// (Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15, 1980). Both run as one system, so that both take the
/// same steps; `options` gives the tolerances of the 8th-order method.
///
/// # Errors
/// As [`crate::rollout::rollout`]; [`Error::Argument`] where the duration is not positive.
pub fn largest_lyapunov_exponent(
    model: &dyn Model,
    start: &State,
    duration: f64,
    options: &RolloutOptions,
) -> Result<Lyapunov> {
    if !(duration.is_finite() && duration > 0.0) {
        let must = "a finite number of seconds above 0";
        return Err(Error::Argument {
            name: "duration",
            value: duration.to_string(),
            must,
        });
    }
    // Its checks are those needed here.
    crate::rollout::rollout(
        model,
        &start.q,
        &start.qd,
        &[0.0],
        &crate::rollout::free,
        options,
    )?;
    let mut pair = Pair::new(model, start, options.control());
    let interval = duration / RESTARTS as f64;
    let (mut growth, mut half) = (0.0, 0.0);
    let mut convergence = Vec::with_capacity(RESTARTS);
    for k in 1..=RESTARTS {
        let Some(distance) = pair.run(interval) else {
            break;
        };
        growth += (distance / SEPARATION).ln();
        pair.restart(distance);
        let t = k as f64 * interval;
        convergence.push((t, growth / t));
        if k == RESTARTS / 2 {
            half = growth;
        }
    }
    let &(duration, exponent) = convergence.last().unwrap_or(&(0.0, 0.0));
    let chaotic = convergence.len() == RESTARTS && growth - half > CHAOTIC_GROWTH;
    let motion = if chaotic {
        Motion::Chaotic
    } else {
        Motion::Regular
    };
    Ok(Lyapunov {
        exponent,
        motion,
        duration,
        convergence,
    })
}

/// A motion and its neighbour as one state: (q, q' of both; q̇, q̇' of both).
struct Pair<'a> {
    evaluator: Box<dyn crate::dynamics::Evaluator + 'a>,
    x: Vec<f64>,
    n: usize,
    control: Control,
}

impl<'a> Pair<'a> {
    fn new(model: &'a dyn Model, start: &State, control: Control) -> Self {
        let n = start.q.len();
        let mut x = [&start.q[..], &start.q, &start.qd, &start.qd].concat();
        // A direction without symmetry: not along any eigenvector.
        let direction = |i: usize| 1.0 + 0.618 * i as f64;
        let norm = (0..2 * n).map(|i| direction(i).powi(2)).sum::<f64>().sqrt();
        for i in 0..n {
            x[n + i] += SEPARATION * direction(i) / norm;
            x[3 * n + i] += SEPARATION * direction(n + i) / norm;
        }
        Self {
            evaluator: model.evaluator(),
            x,
            n,
            control,
        }
    }

    /// Runs both for a while; their distance then, or `None` where they cannot go on.
    fn run(&mut self, interval: f64) -> Option<f64> {
        let both = 2 * self.n;
        let still = vec![0.0; both];
        let (evaluator, x0) = (&mut self.evaluator, self.x.clone());
        let mut f = |_: f64, x: &[f64], dx: &mut [f64]| {
            let ((q, qd), (dq, dqd)) = (x.split_at(both), dx.split_at_mut(both));
            dq.copy_from_slice(qd);
            let _ = evaluator.forward_dynamics(q, qd, &still, dqd);
        };
        let (x, control) = (&mut self.x, self.control);
        let mut sink = |k: usize, state: &[f64]| {
            if k == 1 {
                x.copy_from_slice(state);
            }
        };
        let times = [0.0, interval];
        let solution = adaptive::solve::<Dop853>(&mut f, &x0, &times, &control, &mut sink);
        // The step limit is for the whole run.
        self.control.max_steps -= solution.steps + solution.rejected;
        let distance = self
            .differences()
            .map(|(i, j)| (self.x[j] - self.x[i]).powi(2))
            .sum::<f64>()
            .sqrt();
        (solution.ending == Ending::Finished && distance > 0.0).then_some(distance)
    }

    fn restart(&mut self, distance: f64) {
        for (i, j) in self.differences() {
            self.x[j] = self.x[i] + (self.x[j] - self.x[i]) * SEPARATION / distance;
        }
    }

    /// Indices of each component and of the neighbour's.
    fn differences(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.n;
        (0..n).chain(2 * n..3 * n).map(move |i| (i, i + n))
    }
}
