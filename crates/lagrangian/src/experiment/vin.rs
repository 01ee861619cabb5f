//! Variational integrator networks and others on positions alone: the protocol of Saemundsson et al. 2020.
//!
//! One motion of a pendulum or of a mass on a spring, sampled every 0.1 s; predictions of 10 s (and longer) from starts
//! that were not seen. The paper adds noise of deviation 0.33 to positions and velocities and infers initial states with a
//! recurrent network; here the noise is a setting, and only positions are seen.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::baseline::MlpConfig;
use crate::dataset::{Dataset, split};
use crate::dynamics::Model;
use crate::integrate::{Method, Rule};
use crate::lagrangian::analytic::{AnalyticModel, by_name};
use crate::lagrangian::{DelanConfig, Inertia, LnnConfig};
use crate::rollout::{RolloutOptions, free, rollout, times};
use crate::train::{
    Budget, Family, FitConfig, Learned, Loss, NaturalConfig, Observer, Optimizer, fit,
};
use crate::trajectory::{Columns, EstimateOptions, Recording};
use crate::{Coordinates, Error, Result, State, Trajectory};

/// Time between samples, s.
pub const STEP: f64 = 0.1;

/// A system of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum System {
    /// m = 1 kg, l = 1 m, g = 9.82 m/s²; starts within 90° of the top, so that most motions are large swings.
    Pendulum,
    /// m = 1 kg, k = 2 N/m.
    MassSpring,
}

impl System {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Pendulum, Self::MassSpring];

    /// Its name among the analytic systems.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pendulum => "pendulum",
            Self::MassSpring => "mass-spring",
        }
    }

    /// The true model.
    ///
    /// # Errors
    /// As [`by_name`].
    pub fn truth(self) -> Result<Box<dyn AnalyticModel>> {
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
    #[must_use]
    pub fn starts(self, count: usize, seed: u64) -> Vec<State> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| self.start(&mut rng)).collect()
    }

    /// The energy that drifts are compared with, J: that of the highest position, or of the widest swing.
    #[must_use]
    pub fn reference_energy(self) -> f64 {
        match self {
            Self::Pendulum => 2.0 * 9.82,
            Self::MassSpring => 2.25,
        }
    }
}

/// One motion of which positions are seen, with noise.
#[derive(Debug, Clone)]
pub struct Seen {
    /// The system.
    pub system: System,
    /// The noisy positions; velocities are zeros.
    pub motion: Trajectory,
    coordinates: Coordinates,
}

/// One motion of `samples` positions with noise of deviation `noise` (rad or m).
///
/// # Errors
/// As [`rollout`].
pub fn seen(system: System, samples: usize, noise: f64, seed: u64) -> Result<Seen> {
    let truth = system.truth()?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start = system.start(&mut rng);
    let duration = STEP * samples.saturating_sub(1) as f64;
    let times = times(duration, STEP)?;
    let options = RolloutOptions::truth();
    let mut motion = rollout(&*truth, &start.q, &start.qd, &times, &free, &options)?.trajectory;
    let mut normal = || crate::mlp::normal(&mut rng);
    motion.q.iter_mut().for_each(|q| *q += noise * normal());
    motion.qd.fill(0.0);
    (motion.qdd, motion.tau) = (None, None);
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
            q: self.motion.q.clone(),
            qd: None,
            qdd: None,
            tau: None,
            columns: Columns::default(),
            unwrapped: vec![0],
        };
        Ok(recording.into_trajectory(&EstimateOptions::default())?.0)
    }
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contestant {
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

impl Contestant {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::VinTrapezoidal,
        Self::VinMidpoint,
        Self::Delan,
        Self::Lnn,
        Self::LnnEstimates,
        Self::Mlp,
    ];

    /// What it is minimised by.
    #[must_use]
    pub fn loss(self) -> Loss {
        match self {
            Self::VinTrapezoidal => Loss::PositionsTrapezoidal,
            Self::VinMidpoint | Self::Delan | Self::Lnn => Loss::Positions,
            Self::LnnEstimates | Self::Mlp => Loss::Acceleration,
        }
    }

    /// The method that it is rolled out by at the step of the data: its own, where it learned with one.
    #[must_use]
    pub fn method(self) -> Method {
        match self.loss().rule() {
            Some(Rule::Midpoint) => Method::VariationalMidpoint,
            Some(Rule::Trapezoidal) => Method::VariationalTrapezoidal,
            None => Method::Dop853,
        }
    }

    fn family(self, width: usize) -> Family {
        let delan = |inertia| {
            Family::Delan(DelanConfig {
                width,
                inertia,
                ..DelanConfig::default()
            })
        };
        match self {
            Self::VinTrapezoidal | Self::VinMidpoint => delan(Inertia::Constant),
            Self::Delan => delan(Inertia::Configuration),
            Self::Lnn | Self::LnnEstimates => Family::Lnn(LnnConfig {
                width,
                ..LnnConfig::default()
            }),
            Self::Mlp => Family::Mlp(MlpConfig {
                width,
                ..MlpConfig::default()
            }),
        }
    }
}

/// How a contestant is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Distance of neighbouring positions, in samples.
    pub baseline: usize,
    /// Steps of the natural gradient, whole batches.
    pub steps: usize,
    /// Units of a hidden layer.
    pub width: usize,
    /// Of weights and batches.
    pub seed: u64,
}

/// Damping of the last step: as small as the noise allows. Each batch is solved for itself, noise and all.
fn damping(noisy: bool) -> f64 {
    if noisy { 1e-2 } else { 1e-7 }
}

/// Fits a contestant to what was seen; the last tenth of it chooses the weights.
///
/// # Errors
/// As [`fit`] and [`Dataset::of_positions`].
pub fn learn(
    contestant: Contestant,
    seen: &Seen,
    noisy: bool,
    effort: Effort,
    observer: &mut dyn Observer,
) -> Result<Learned> {
    let positions = contestant.loss().rule().is_some();
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
        family: contestant.family(effort.width),
        loss: contestant.loss(),
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

/// How good predictions are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Root mean square of the position error over the first 10 s, of all starts, rad or m.
    pub error: f64,
    /// Largest change of the true energy over the whole prediction, of all starts, relative to the reference.
    pub drift: f64,
    /// Predictions that did not reach their end; they are in no figure.
    pub unfinished: usize,
}

/// Seconds over which the position error is taken: the horizon of the paper.
pub const HORIZON: f64 = 10.0;

/// Predictions of `duration` by `model` from `starts`, with `method` at `step`, against the truth.
///
/// # Errors
/// As [`rollout`]; [`Error::Argument`] for no start.
pub fn judge(
    system: System,
    model: &dyn Model,
    starts: &[State],
    (method, step): (Method, f64),
    duration: f64,
) -> Result<Judgement> {
    if starts.is_empty() {
        return Err(Error::Argument {
            name: "starts",
            value: "none".into(),
            must: "at least one",
        });
    }
    let truth = system.truth()?;
    let times = times(duration, step.max(STEP))?;
    let options = RolloutOptions {
        method,
        step,
        ..RolloutOptions::default()
    };
    let near = times.iter().filter(|t| **t <= HORIZON + 1e-9).count();
    let mut found = Judgement {
        error: 0.0,
        drift: 0.0,
        unfinished: 0,
    };
    let mut finished = 0;
    for start in starts {
        let prediction = rollout(model, &start.q, &start.qd, &times, &free, &options)?;
        if !prediction.outcome.is_finished() {
            found.unfinished += 1;
            continue;
        }
        finished += 1;
        let exact = RolloutOptions::truth();
        let right = rollout(&*truth, &start.q, &start.qd, &times[..near], &free, &exact)?;
        let t = &prediction.trajectory;
        let pairs = right.trajectory.q.iter().zip(&t.q);
        let squares = pairs.map(|(a, b)| difference(system, *a, *b).powi(2));
        found.error += squares.sum::<f64>() / near as f64;
        let drift = super::long_rollouts::energy_error(&*truth, t, system.reference_energy());
        let worst = drift.iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
        found.drift = found.drift.max(0.01 * worst);
    }
    found.error = match finished {
        0 => f64::NAN,
        count => (found.error / f64::from(count)).sqrt(),
    };
    if finished == 0 {
        found.drift = f64::NAN;
    }
    Ok(found)
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
