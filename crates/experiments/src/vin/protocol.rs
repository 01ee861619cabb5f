//! Variational integrator networks and others on positions alone: the protocol of Saemundsson et al. 2020.
//!
//! One motion of a pendulum or of a mass on a spring, sampled every 0.1 s; predictions of 10 s (and longer) from starts
//! that were not seen. The paper adds noise of deviation 0.33 to positions and velocities and infers initial states with a
//! recurrent network; here the noise is a setting, and only positions are seen.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use lagrangian::dataset::{Dataset, split};
use lagrangian::dynamics::{Model, Slopes};
use lagrangian::integrate::{Method, Rule, Variational};
use lagrangian::lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::models::vin::VinConfig;
use lagrangian::rollout::energy_error;
use lagrangian::rollout::{Rollout, RolloutOptions, free, rollout, times};
use lagrangian::train::{
    Budget, Family, FitConfig, Learned, Loss, NaturalConfig, Observer, Optimizer, fit,
};
use lagrangian::trajectory::Signals;
use lagrangian::trajectory::{Columns, EstimateOptions, Recording};
use lagrangian::{Coordinates, Error, Result, State, Trajectory};
use lagrangian_report::Role;

use crate::families;

/// Time between samples, s.
pub(crate) const STEP: f64 = 0.1;

/// A system of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum System {
    /// m = 1 kg, l = 1 m, g = 9.82 m/s²; starts within 90° of the top, so that most motions are large swings.
    Pendulum,
    /// m = 1 kg, k = 2 N/m.
    MassSpring,
}

impl System {
    /// Both.
    pub(crate) const ALL: [Self; 2] = [Self::Pendulum, Self::MassSpring];

    /// Its name among the analytic systems.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pendulum => "pendulum",
            Self::MassSpring => "mass-spring",
        }
    }

    /// The true model.
    pub(crate) fn truth(self) -> Result<Box<dyn AnalyticModel>> {
        match self {
            Self::Pendulum => by_name(self.name(), &[("gravity", 9.82)]),
            Self::MassSpring => by_name(self.name(), &[("stiffness", 2.0)]),
        }
    }

    /// A random start of the paper.
    fn start(self, rng: &mut ChaCha8Rng) -> State {
        let mut sign = |x: f64| if rng.random() { x } else { -x };
        let (q, v) = match self {
            Self::Pendulum => (sign(1.0), 0.0),
            Self::MassSpring => (sign(1.0), sign(1.0)),
        };
        let pi = std::f64::consts::PI;
        let (q, v) = match self {
            Self::Pendulum => (
                q * (pi - rng.random_range(0.1..0.5 * pi)),
                rng.random_range(-1.0..1.0),
            ),
            Self::MassSpring => (
                q * rng.random_range(0.5..1.5),
                v * rng.random_range(-0.5..0.5),
            ),
        };
        State::new(vec![q], vec![v])
    }

    /// So many random starts.
    pub(crate) fn starts(self, count: usize, seed: u64) -> Vec<State> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| self.start(&mut rng)).collect()
    }

    /// The energy that drifts are compared with, J: that of the highest position, or of the widest swing.
    pub(crate) fn reference_energy(self) -> f64 {
        match self {
            Self::Pendulum => 2.0 * 9.82,
            Self::MassSpring => 2.25,
        }
    }
}

/// One motion of which positions are seen, with noise.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    /// The system.
    pub(crate) system: System,
    /// The noisy positions; velocities are zeros.
    pub(crate) motion: Trajectory,
    coordinates: Coordinates,
}

/// One motion of `samples` positions every `step` seconds with noise of deviation `noise` (rad or m).
pub(crate) fn seen(
    system: System,
    (samples, step): (usize, f64),
    noise: f64,
    seed: u64,
) -> Result<Seen> {
    let truth = system.truth()?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start = system.start(&mut rng);
    let duration = step * samples.saturating_sub(1) as f64;
    let times = times(duration, step)?;
    let options = RolloutOptions::truth();
    let mut motion = rollout(&*truth, &start.q, &start.qd, &times, &free, &options)?.trajectory;
    let mut normal = || lagrangian::analytic::normal(&mut rng);
    motion.q.iter_mut().for_each(|q| *q += noise * normal());
    motion.qd.fill(0.0);
    (motion.qdd, motion.tau) = (Vec::new(), Vec::new());
    Ok(Seen {
        system,
        motion,
        coordinates: truth.coordinates().clone(),
    })
}

impl Seen {
    /// The motion with velocities and accelerations estimated from its positions.
    fn estimated(&self) -> Result<Trajectory> {
        let recording = Recording {
            name: self.motion.name.clone(),
            coordinates: self.coordinates.clone(),
            t: self.motion.t.clone(),
            columns: Columns::default(),
            unwrapped: vec![0],
            sampled: None,
            signals: Signals {
                q: self.motion.q.clone(),
                ..Signals::default()
            },
        };
        Ok(recording.into_trajectory(&EstimateOptions::default())?.0)
    }
}

/// The models that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Kind {
    /// Constant M and V(q), by the trapezoidal rule: VIN-SV of the paper.
    VinTrapezoidal,
    /// The same by the midpoint rule.
    VinMidpoint,
    /// M(q) and V(q), positions by the midpoint rule.
    Delan,
    /// Any L, positions by the midpoint rule.
    Lnn,
    /// Any L, accelerations estimated from the positions.
    LnnEstimates,
    /// Plain network, accelerations estimated from the positions.
    Mlp,
}

impl Kind {
    /// All of them.
    pub(crate) const ALL: [Self; 6] = [
        Self::VinTrapezoidal,
        Self::VinMidpoint,
        Self::Delan,
        Self::Lnn,
        Self::LnnEstimates,
        Self::Mlp,
    ];

    /// Its name in JSON.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::VinTrapezoidal => "vin-trapezoidal",
            Self::VinMidpoint => "vin-midpoint",
            Self::Delan => "delan",
            Self::Lnn => "lnn",
            Self::LnnEstimates => "lnn-estimates",
            Self::Mlp => "mlp",
        }
    }

    /// Its name on the page.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::VinTrapezoidal => "VIN, trapezoidal (VIN-SV)",
            Self::VinMidpoint => "VIN, midpoint",
            Self::Delan => "deep Lagrangian network",
            Self::Lnn => "Lagrangian network",
            Self::LnnEstimates => "Lagrangian network, estimated q̈",
            Self::Mlp => "plain network, estimated q̈",
        }
    }

    pub(crate) fn role(self) -> Role {
        match self {
            Self::VinMidpoint => Role::Lnn,
            Self::Mlp => Role::Baseline,
            Self::VinTrapezoidal => Role::Other(0),
            Self::Delan => Role::Other(1),
            Self::Lnn => Role::Other(2),
            Self::LnnEstimates => Role::Other(3),
        }
    }

    /// The loss that it minimises.
    pub(crate) fn loss(self) -> Loss {
        match self {
            Self::VinTrapezoidal => Loss::POSITIONS_TRAPEZOIDAL,
            Self::VinMidpoint | Self::Delan | Self::Lnn => Loss::POSITIONS,
            Self::LnnEstimates | Self::Mlp => Loss::ACCELERATION,
        }
    }

    /// The method that it is rolled out by at the step of the data: its own, where it learned with one.
    pub(crate) fn method(self) -> Method {
        match self.loss().rule() {
            Some(Rule::Midpoint) => Method::VariationalMidpoint,
            Some(Rule::Trapezoidal) => Method::VariationalTrapezoidal,
            None => Method::Dop853,
        }
    }

    fn family(self, width: usize) -> Box<dyn Family> {
        match self {
            Self::VinTrapezoidal | Self::VinMidpoint => Box::new(VinConfig {
                width,
                ..VinConfig::default()
            }),
            Self::Delan => families::delan(width),
            Self::Lnn | Self::LnnEstimates => families::lnn(width),
            Self::Mlp => families::mlp(width),
        }
    }
}

/// How a contestant is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effort {
    /// Distance of neighbouring positions, in samples.
    pub(crate) baseline: usize,
    /// Steps of the natural gradient, whole batches.
    pub(crate) steps: usize,
    /// Units of a hidden layer.
    pub(crate) width: usize,
    /// Of weights and batches.
    pub(crate) seed: u64,
}

/// Damping of the last step: as small as the noise allows. Each batch is solved for itself, noise and all.
fn damping(noisy: bool) -> f64 {
    if noisy { 1e-2 } else { 1e-7 }
}

/// Fits a contestant to what was seen; the last tenth of it chooses the weights.
pub(crate) fn learn(
    kind: Kind,
    seen: &Seen,
    noisy: bool,
    effort: Effort,
    observer: &mut dyn Observer,
) -> Result<Learned> {
    let positions = kind.loss().rule().is_some();
    let motion = match positions {
        true => seen.motion.clone(),
        false => seen.estimated()?,
    };
    let (train, validation) = split(vec![motion], 0.1, effort.seed)?;
    let coordinates = seen.coordinates.clone();
    let data = match positions {
        true => Dataset::of_positions(coordinates, &train, &validation, effort.baseline)?,
        false => Dataset::new(coordinates, &train, &validation)?,
    };
    let config = FitConfig {
        family: kind.family(effort.width),
        loss: kind.loss(),
        optimizer: Optimizer::Natural(NaturalConfig {
            damping_last: damping(noisy),
            ..NaturalConfig::default()
        }),
        budget: Budget::Steps(effort.steps),
        batch: 512,
        seed: effort.seed,
        ..FitConfig::default()
    };
    Ok(fit(&data, &config, None, observer)?.model)
}

/// How good predictions are; medians over the starts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Errors {
    /// Root mean square of the position error over the first 10 s, rad or m.
    pub(crate) error: f64,
    /// Largest change of the true energy over the whole prediction, relative to the reference.
    pub(crate) drift: f64,
    /// Predictions that did not reach their end or changed their energy by more than the reference.
    pub(crate) lost: usize,
}

/// Seconds over which the position error is taken: the horizon of the paper.
pub(crate) const HORIZON: f64 = 10.0;

/// A prediction of `duration`, sampled about every [`STEP`], by `model`, with `method` at `step`.
pub(crate) fn predict(
    model: &dyn Model,
    start: &State,
    (method, step): (Method, f64),
    duration: f64,
) -> Result<Rollout> {
    let options = RolloutOptions {
        method,
        step,
        ..RolloutOptions::default()
    };
    // Samples that whole steps meet.
    let sampling = step * (STEP / step - 1e-9).ceil();
    let times = times(duration, sampling)?;
    rollout(model, &start.q, &start.qd, &times, &free, &options)
}

/// Change of the true energy along a prediction, relative to the reference.
pub(crate) fn drift(system: System, prediction: &Trajectory) -> Result<Vec<f64>> {
    let truth = system.truth()?;
    let percent = energy_error(&*truth, prediction, system.reference_energy());
    Ok(percent.into_iter().map(|p| 0.01 * p).collect())
}

/// Predictions of `duration` by `model` from `starts`, with `method` at `step`, against the truth.
pub(crate) fn errors(
    system: System,
    model: &dyn Model,
    starts: &[State],
    method: (Method, f64),
    duration: f64,
) -> Result<Errors> {
    let truth = system.truth()?;
    let (mut all, mut drifts, mut lost) = (Vec::new(), Vec::new(), 0);
    for start in starts {
        let prediction = predict(model, start, method, duration)?;
        let changes = drift(system, &prediction.trajectory)?;
        let worst = changes.iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
        lost += usize::from(!prediction.outcome.is_finished() || worst > 1.0);
        drifts.push(if prediction.outcome.is_finished() {
            worst
        } else {
            f64::INFINITY
        });
        let t = &prediction.trajectory;
        let near = t.t.iter().filter(|t| **t <= HORIZON + 1e-9).count();
        let options = RolloutOptions::truth();
        let right = rollout(&*truth, &start.q, &start.qd, &t.t[..near], &free, &options)?;
        let pairs = right.trajectory.q.iter().zip(&t.q);
        let squares = pairs.map(|(a, b)| difference(system, *a, *b).powi(2));
        all.push((squares.sum::<f64>() / near as f64).sqrt());
    }
    Ok(Errors {
        error: middle(all),
        drift: middle(drifts),
        lost,
    })
}

/// The middle one; the upper of two.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Root mean square of what the discrete equation of the true model leaves of the positions that were seen, relative to
/// that of the second differences: the least loss that a model without the error of the step can reach, as a root.
pub(crate) fn residual_of_truth(seen: &Seen, rule: Rule, baseline: usize) -> Result<f64> {
    let truth = seen.system.truth()?;
    let motion = std::slice::from_ref(&seen.motion);
    let data = Dataset::of_positions(seen.coordinates.clone(), motion, &[], baseline)?;
    let unsolved = || {
        Error::argument(
            "step",
            format!("{} samples", baseline),
            "shorter: the discrete equation of the true model has no solution",
        )
    };
    let mut mechanics = truth.mechanics().ok_or_else(unsolved)?;
    let mut slopes = |_: f64, q: &[f64], v: &[f64], slopes: &mut Slopes| {
        mechanics.slopes(q, v, &[0.0], slopes);
    };
    let mut method = Variational::new(1, rule);
    let (samples, mut squares, mut all) = (&data.train, 0.0, 0.0);
    for (k, h) in samples.steps.chunks_exact(2).enumerate() {
        let (q, v, a) = (samples.q[k], samples.qd[k], samples.qdd[k]);
        let (_, plus) = method.momenta(&mut slopes, (0.0, h[0]), &[q - h[0] * v], &[q]);
        let (mut next, mut p, mut velocity) = ([q], [plus[0]], [v]);
        let solved = method.advance(&mut slopes, (0.0, h[1]), &mut next, &mut p, &mut velocity);
        solved.map_err(|_| unsolved())?;
        let found = (velocity[0] - v) / (0.5 * (h[0] + h[1]));
        squares += (found - a).powi(2);
        all += a * a;
    }
    Ok((squares / all).sqrt())
}

/// a − b, of angles by the shorter way.
fn difference(system: System, a: f64, b: f64) -> f64 {
    let turn = match system {
        System::Pendulum => std::f64::consts::TAU,
        System::MassSpring => return a - b,
    };
    let difference = a - b;
    difference - turn * (difference / turn).round()
}
