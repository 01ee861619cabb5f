//! Variational integrator networks and others on positions alone: the protocol of Saemundsson et al. 2020.
//!
//! One motion of a pendulum or of a mass on a spring, sampled every 0.1 s; predictions of 10 s (and longer) from starts
//! that were not seen. The paper adds noise of deviation 0.33 to positions and velocities and infers initial states with a
//! recurrent network; here the noise is a setting, and only positions are seen.

use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::integrate::{Method, Rule, Variational};
use lagrangian::mechanics::Slopes;
use lagrangian::rollout::{energy_error, free, times};
use lagrangian::{
    Budget, Coordinates, Dataset, Error, FitConfig, Learned, Loss, Model, Observer, Result,
    Rollout, RolloutOptions, State, TrainingTask, Trajectory, fit, rollout, split,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::data::{estimated, shorter};
use crate::families::{self, MakeFamily};
use crate::harness::spread::upper_median;
use crate::harness::{Contestant, contestants};

/// Time between samples, s.
pub(crate) const STEP: f64 = 0.1;

/// A system of the paper.
pub(crate) struct System {
    /// Its name among the analytic systems.
    pub(crate) name: &'static str,
    /// The parameter that is not the usual one.
    parameter: (&'static str, f64),
    /// A random start of the paper.
    start: fn(&mut ChaCha8Rng) -> State,
    /// The energy that drifts are compared with, J: that of the highest position, or of the widest swing.
    reference_energy: f64,
}

/// m = 1 kg, l = 1 m, g = 9.82 m/s²; starts within 90° of the top, so that most motions are large swings.
pub(crate) static PENDULUM: System = System {
    name: "pendulum",
    parameter: ("gravity", 9.82),
    start: |rng| {
        let (sign, pi) = (sign(rng), std::f64::consts::PI);
        let q = sign * (pi - rng.random_range(0.1..0.5 * pi));
        State::new(vec![q], vec![rng.random_range(-1.0..1.0)])
    },
    reference_energy: 2.0 * 9.82,
};

/// m = 1 kg, k = 2 N/m.
pub(crate) static MASS_SPRING: System = System {
    name: "mass-spring",
    parameter: ("stiffness", 2.0),
    start: |rng| {
        let (q, v) = (sign(rng), sign(rng));
        let q = q * rng.random_range(0.5..1.5);
        State::new(vec![q], vec![v * rng.random_range(-0.5..0.5)])
    },
    reference_energy: 2.25,
};

fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random() { 1.0 } else { -1.0 }
}

impl System {
    /// Whether it is the pendulum, whose coordinate is an angle and whose motions are drawn.
    pub(crate) fn is_pendulum(&self) -> bool {
        self.name == PENDULUM.name
    }

    /// The true model.
    pub(crate) fn truth(&self) -> Result<Box<dyn AnalyticModel>> {
        by_name(self.name, &[self.parameter])
    }

    /// So many random starts.
    pub(crate) fn starts(&self, count: usize, seed: u64) -> Vec<State> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| (self.start)(&mut rng)).collect()
    }
}

/// One motion of which positions are seen, with noise.
pub(crate) struct Seen {
    /// The system.
    pub(crate) system: &'static System,
    /// The noisy positions; velocities are zeros.
    pub(crate) motion: Trajectory,
    coordinates: Coordinates,
}

/// One motion of `samples` positions every `step` seconds with noise of deviation `noise` (rad or m).
pub(crate) fn seen(
    system: &'static System,
    (samples, step): (usize, f64),
    noise: f64,
    seed: u64,
) -> Result<Seen> {
    let truth = system.truth()?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let start = (system.start)(&mut rng);
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
        let mut positions = self.motion.clone();
        positions.qd = Vec::new();
        estimated(positions, &self.coordinates)
    }
}

/// What a contestant learns by, and as what.
pub(crate) struct Recipe {
    pub(crate) loss: Loss,
    family: MakeFamily,
}

/// The models that are compared.
pub(crate) static CONTESTANTS: [Contestant<Recipe>; 6] = contestants! {
    "vin-trapezoidal", "VIN, trapezoidal (VIN-SV)", Other(0), by(Loss::POSITIONS_TRAPEZOIDAL, families::vin);
    "vin-midpoint", "VIN, midpoint", Lnn, by(Loss::POSITIONS, families::vin);
    "delan", "deep Lagrangian network", Other(1), by(Loss::POSITIONS, families::delan);
    "lnn", "Lagrangian network", Other(2), by(Loss::POSITIONS, families::lnn);
    "lnn-estimates", "Lagrangian network, estimated q̈", Other(3), by(Loss::ACCELERATION, families::lnn);
    "mlp", "plain network, estimated q̈", Baseline, by(Loss::ACCELERATION, families::mlp);
};

/// Constant M and V(q), by the trapezoidal and by the midpoint rule.
pub(crate) static VIN: &[Contestant<Recipe>] = CONTESTANTS.split_at(2).0;

const fn by(loss: Loss, family: MakeFamily) -> Recipe {
    Recipe { loss, family }
}

impl Recipe {
    /// The method that it is rolled out by at the step of the data: its own, where it learned with one.
    pub(crate) fn method(&self) -> Method {
        match self.loss.rule() {
            Some(Rule::Midpoint) => Method::VariationalMidpoint,
            Some(Rule::Trapezoidal) => Method::VariationalTrapezoidal,
            None => Method::Dop853,
        }
    }
}

/// How a contestant is fitted.
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
    recipe: &Recipe,
    seen: &Seen,
    noisy: bool,
    effort: Effort,
    observer: &mut dyn Observer,
) -> Result<Learned> {
    let positions = recipe.loss.rule().is_some();
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
        family: (recipe.family)(effort.width),
        training: TrainingTask {
            loss: recipe.loss,
            optimizer: families::natural(damping(noisy)),
            budget: Budget::Steps(effort.steps),
            batch: 512,
            seed: effort.seed,
            ..TrainingTask::default()
        },
    };
    Ok(fit(&data, &config, None, observer)?.model)
}

/// How good predictions are; medians over the starts.
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
pub(crate) fn drift(system: &System, prediction: &Trajectory) -> Result<Vec<f64>> {
    let truth = system.truth()?;
    let percent = energy_error(&*truth, prediction, system.reference_energy);
    Ok(percent.into_iter().map(|p| 0.01 * p).collect())
}

/// Predictions of `duration` by `model` from `starts`, with `method` at `step`, against the truth.
pub(crate) fn errors(
    system: &'static System,
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
        let finished = prediction.outcome.is_finished();
        lost += usize::from(!finished || worst > 1.0);
        drifts.push(if finished { worst } else { f64::INFINITY });
        let t = &prediction.trajectory;
        let near = t.t.iter().filter(|t| **t <= HORIZON + 1e-9).count();
        let options = RolloutOptions::truth();
        let right = rollout(&*truth, &start.q, &start.qd, &t.t[..near], &free, &options)?;
        let pairs = right.trajectory.q.iter().zip(&t.q);
        let squares = pairs.map(|(a, b)| shorter(a - b, truth.coordinates(), 0).powi(2));
        all.push((squares.sum::<f64>() / near as f64).sqrt());
    }
    Ok(Errors {
        error: upper_median(all).unwrap_or(f64::NAN),
        drift: upper_median(drifts).unwrap_or(f64::NAN),
        lost,
    })
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
