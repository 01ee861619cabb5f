//! Identification of a robot whose kinematics are known: inertial parameters that bodies can have, drives and friction
//! (theory.md, 45 to 47).
//!
//! | symbol | meaning |
//! |---|---|
//! | π | ten inertial parameters of each body, then rotors, constant torques, viscous and Coulomb friction, parts of the load or springs |
//! | wⱼ | weight of joint j: one over the root mean square of its residual |
//! | γ | strength of the prior |
//!
//! Of the ten parameters of a body some have no effect and some only together (Gautier, Khalil 1990): for those
//! combinations the prior decides. Joints count by their unexplained torque, as in maximum likelihood; a joint
//! whose friction is large then does not hide the information of the others about the bodies.

use super::{Identification, IdentifiedRobot};
use crate::dataset::Dataset;
use crate::models::correlation::correlations;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::rigid::changes::Certainty;
use lagrangian_mechanics::rigid::consistent::{Prior, is_consistent, minimise, rank};
use lagrangian_mechanics::rigid::joint_sums::{Friction, JointSums, TorqueScale, Weighting};
use lagrangian_mechanics::rigid::regressor::PER_BODY;
use lagrangian_mechanics::rigid::{RigidBodies, RobotConfig};
use lagrangian_motion::Samples;
use lagrangian_motion::statistics::{column, deviation, root_mean_square};
use lagrangian_motion::{Error, Result};

/// Strengths of the prior that are tried, each from the minimum of the one before.
const STRENGTHS: [f64; 8] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-7, 1e-9, 1e-12];
/// The last strength without samples to choose it by.
const STRENGTH: f64 = 1e-3;
/// Smoothing speeds of Coulomb friction that are tried, rad/s or m/s.
const SPEEDS: [f64; 6] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
/// Speeds below which samples of a joint may be left out, in parts of the root mean square of its speed …
const STILL: [f64; 5] = [0.0, 0.05, 0.1, 0.2, 0.3];
/// … and that at which it moves.
const MOVING: f64 = 0.3;
/// Ridge of the regressions that choose them.
const RIDGE: f64 = 1e-6;
/// The number of rounds of weighting the joints by their residuals.
const ROUNDS: usize = 3;
/// The logarithm of a mean square residual that is nearly as good: 5 %, for which a stronger prior, and a better conditioned
/// mass matrix, are preferable.
const NEARLY: f64 = 0.05;
/// An eigenvalue of the regressor's sums, in parts of the largest, below which a combination of parameters has no effect.
const NO_EFFECT: f64 = 1e-9;
/// A spring pulls with at least this part of its joint's torque.
const PULLS: f64 = 0.05;
/// The largest part of its torque that a gear may lose.
const LARGEST_SHARE: f64 = 0.7;
/// The lower bound of a mean square error in a weight, in parts of the square of its scale.
const SMALLEST: f64 = 1e-12;

/// The quantities that are identified beside inertial parameters, rotors and constant torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IdentifyOptions {
    /// Whether there is viscous and Coulomb friction.
    pub friction: bool,
    /// The speed over which Coulomb friction changes its sign, rad/s or m/s; `None`: for each joint the one that explains
    /// its torques best.
    pub smoothing: Option<f64>,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self {
            friction: true,
            smoothing: None,
        }
    }
}

/// What the residuals of a robot are compared with.
pub(crate) fn torque_scale(dataset: &Dataset) -> TorqueScale {
    TorqueScale {
        torques: dataset.force_scale(),
        accelerations: dataset.acceleration_scale(),
        driven: dataset.driven(),
    }
}

/// Identifies a robot of known kinematics from the samples of `dataset`: bodies that can exist, rotors, constant torques and
/// friction. The validation samples choose the strength of the prior.
///
/// # Errors
/// As [`RobotConfig::bodies`]; [`Error::Argument`] where the data hold no forces; [`Error::NotFinite`] where the
/// samples are too large to be squared.
pub fn identify(
    dataset: &Dataset,
    robot: &RobotConfig,
    options: &IdentifyOptions,
) -> Result<Identification> {
    let robot = robot.bodies(&dataset.coordinates)?;
    if !dataset.forced || dataset.train.is_empty() {
        return Err(Error::argument(
            "forces",
            "none",
            "recorded (`tau`): a robot is identified from torques",
        ));
    }
    let problem = Problem::new(dataset, robot, options);
    let without = Frictions::new(&problem, problem.friction.clone());
    let others = problem.others();
    let others = others.into_iter().flatten();
    let others: Vec<Frictions> = others.map(|own| Frictions::new(&problem, own)).collect();
    let best = without.best(&problem);
    let best = best.ok_or_else(|| Error::not_finite("the sums of squares of the samples", 0))?;
    let worth = best.score - NEARLY * problem.robot.dof() as f64;
    let others = others.iter().filter_map(|own| own.best(&problem));
    let others = others.filter(|own| problem.pulls(own));
    let other = others.min_by(|a, b| a.score.total_cmp(&b.score));
    let best = other.filter(|own| own.score < worth).unwrap_or(best);
    problem.assemble(dataset, best)
}

/// The speed below which the torque of each joint is left out, and the smoothing of its friction.
///
/// Near a standstill dry friction is any force between its bounds, which no function of the speed is. Where a regression without
/// these samples predicts the torques of a moving joint better, they are left out. They still tell how fast friction changes its sign, by
/// absolute errors: a force that is either of two values is then as near to each of them as to their mean, and the sharpest
/// change is taken.
fn signs(dataset: &Dataset, robot: &RigidBodies, smoothings: &[f64]) -> (Vec<f64>, Friction) {
    let (n, train, judge) = (robot.dof(), &dataset.train, dataset.compared());
    let speeds = column(&train.qd, n, root_mean_square);
    let slowest = |part: f64| -> Vec<f64> { speeds.iter().map(|speed| part * speed).collect() };
    let sums = |samples: &Samples, part: f64| {
        JointSums::over_moving(samples, 0..samples.len(), robot, smoothings, &slowest(part))
    };
    let without = STILL.map(|part| sums(train, part));
    let (every, moving) = (sums(judge, 0.0), sums(judge, MOVING));
    let of_all = without[0].regressions(&every, RIDGE);
    let of_moving = without
        .each_ref()
        .map(|sums| sums.regressions(&moving, RIDGE));
    let least = |errors: &[f64]| errors.iter().copied().fold(f64::INFINITY, f64::min);
    let of_joint = |j: usize| {
        let error = |part: usize| least(&of_moving[part][j]);
        let parts = || 1..STILL.len();
        let told = parts().map(error).fold(f64::INFINITY, f64::min);
        // The more is left out, the farther is what is left from a change of sign.
        let widest = parts()
            .rev()
            .find(|part| error(*part) <= (1.0 + NEARLY) * told);
        let left_out = told < error(0) / (1.0 + NEARLY);
        let best = widest.filter(|_| left_out).unwrap_or(0);
        let (errors, near) = match best {
            0 => (of_all[j].clone(), 1.0),
            _ => {
                let left = &without[best];
                let errors = left.absolute_residuals(j, judge, robot, (smoothings, RIDGE));
                (errors, 1.0 + NEARLY)
            }
        };
        let sharpest = errors.iter().position(|own| *own <= near * least(&errors));
        // The torque of a passive joint, 0, is predicted with every smoothing.
        let told = sharpest.filter(|_| least(&errors) > 0.0);
        let middle = smoothings.len() / 2;
        (STILL[best] * speeds[j], told.unwrap_or(middle))
    };
    let (slowest, friction) = (0..n).map(of_joint).unzip();
    (slowest, Friction::Coulomb(friction))
}

/// The robot with the values of all parameters; friction of joint j changes its sign over the speed of its index.
pub(super) fn motion(
    robot: &RigidBodies,
    values: &[f64],
    friction: &Friction,
    smoothings: &[f64],
) -> Result<Mechanical<RigidBodies>> {
    let n = robot.dof();
    let (bodies, rest) = values.split_at(PER_BODY * n);
    let mut coefficients = rest.chunks_exact(n.max(1)).map(<[f64]>::to_vec);
    let mut next = || coefficients.next().unwrap_or_default();
    let robot = robot.clone().with_inertial_parameters(bodies)?;
    let robot = robot.with_drives(next(), next())?;
    let Some(speeds) = friction.speeds() else {
        return Ok(Mechanical::conservative(robot));
    };
    let dissipation = Dissipation {
        viscous: next(),
        coulomb: next(),
        smoothing: speeds.iter().map(|&k| smoothings[k]).collect(),
        load: matches!(friction, Friction::Loaded(_)).then(&mut next),
        ..Dissipation::default()
    };
    let robot = match friction.springs() {
        true => robot.with_springs(next())?,
        false => robot,
    };
    Mechanical::dissipative(robot, dissipation)
}

/// The candidate of the strongest prior among those that explain the torques of all `n` joints nearly as well as the best.
fn strongest(candidates: Vec<Candidate<'_>>, n: usize) -> Option<Candidate<'_>> {
    let scores = candidates.iter().map(|c| c.score);
    let least = scores.min_by(f64::total_cmp)? + NEARLY * n as f64;
    let near = candidates.into_iter().filter(|c| c.score <= least);
    near.min_by(|a, b| {
        let by_score = || a.score.total_cmp(&b.score);
        b.strength.total_cmp(&a.strength).then_with(by_score)
    })
}

/// The terms of friction with the priors of all parameters.
struct Frictions {
    friction: Friction,
    priors: [Prior; 2],
}

impl Frictions {
    fn new(problem: &Problem, friction: Friction) -> Self {
        let priors = [problem.described(&friction), problem.generic(&friction)];
        Self { friction, priors }
    }

    fn best<'a>(&'a self, problem: &Problem) -> Option<Candidate<'a>> {
        let all = self.priors.iter();
        let candidates = all.flat_map(|prior| problem.candidates(prior, &self.friction));
        strongest(candidates.collect(), problem.robot.dof())
    }
}

/// The minimum with one prior.
struct Candidate<'a> {
    prior: &'a Prior,
    friction: &'a Friction,
    strength: f64,
    weights: Weighting,
    values: Vec<f64>,
    /// The sum over the joints of the logarithm of the mean square residual, on validation samples where they exist.
    score: f64,
}

/// Sums over the samples.
struct Problem {
    robot: RigidBodies,
    train: JointSums,
    validation: JointSums,
    scale: TorqueScale,
    /// The deviation of each coordinate, `[n]`.
    spread: Vec<f64>,
    speeds: Vec<f64>,
    friction: Friction,
}

impl Problem {
    fn new(dataset: &Dataset, robot: RigidBodies, options: &IdentifyOptions) -> Self {
        let speeds = options
            .smoothing
            .map_or(SPEEDS.to_vec(), |speed| vec![speed]);
        let (slowest, friction) = match options.friction {
            true => signs(dataset, &robot, &speeds),
            false => (vec![0.0; robot.dof()], Friction::Frictionless),
        };
        let sums = |samples: &Samples| {
            JointSums::over_moving(samples, 0..samples.len(), &robot, &speeds, &slowest)
        };
        let (train, validation) = (sums(&dataset.train), sums(&dataset.validation));
        Self {
            scale: torque_scale(dataset),
            spread: column(&dataset.train.q, robot.dof(), deviation),
            robot,
            train,
            validation,
            speeds,
            friction,
        }
    }

    /// This friction with terms in proportion to the load, and with springs, where held-out samples can show whether they help.
    fn others(&self) -> Option<[Friction; 2]> {
        let speeds = || self.friction.speeds().unwrap_or_default().to_vec();
        let is_known = self.validation.samples > 0 && self.friction.speeds().is_some();
        is_known.then(|| [Friction::Loaded(speeds()), Friction::Sprung(speeds())])
    }

    /// The description as a prior; bodies that it does not describe are generic.
    fn described(&self, friction: &Friction) -> Prior {
        let generic = self.generic(friction);
        let described = self.robot.inertial_parameters();
        let bodies = described
            .as_chunks::<PER_BODY>()
            .0
            .iter()
            .zip(&generic.bodies);
        Prior {
            bodies: bodies
                .map(|(own, other)| if is_consistent(own) { *own } else { *other })
                .collect(),
            ..generic
        }
    }

    /// A prior for unknown bodies.
    fn generic(&self, friction: &Friction) -> Prior {
        self.train.prior(&self.scale.torques, friction)
    }

    /// The minima under `prior`, from the strongest to the weakest.
    fn candidates<'a>(&self, prior: &'a Prior, friction: &'a Friction) -> Vec<Candidate<'a>> {
        let last = if self.validation.samples > 0 {
            0.0
        } else {
            STRENGTH
        };
        let mut found: Vec<Candidate<'a>> = Vec::new();
        for strength in STRENGTHS.into_iter().filter(|s| *s >= last) {
            let before = found.last();
            let start = before.map_or_else(|| prior.values(), |b| b.values.clone());
            let weights = before.map_or_else(|| self.scale.first(), |b| b.weights.clone());
            match self.solve((prior, friction), strength, weights, start) {
                Some(candidate) => found.push(candidate),
                None => break,
            }
        }
        found
    }

    fn solve<'a>(
        &self,
        (prior, friction): (&'a Prior, &'a Friction),
        strength: f64,
        mut weights: Weighting,
        mut values: Vec<f64>,
    ) -> Option<Candidate<'a>> {
        for _ in 0..ROUNDS {
            let data = weights.quadratic(&self.train, friction);
            values = minimise(&data, prior, strength, &values)?.values;
            let at = (&values[..], friction);
            weights = self.scale.weighting_at(&self.train, at, SMALLEST);
        }
        let scored = match self.validation.samples {
            0 => &self.train,
            _ => &self.validation,
        };
        let mut relative = self.scale.relative(scored, &values, friction);
        self.by_drive(scored, (&values, friction), &mut relative);
        let score = relative.iter().map(|r| r.max(1e-30).ln()).sum::<f64>();
        let known = score.is_finite() && self.moves(&values, friction);
        known.then_some(Candidate {
            prior,
            friction,
            strength,
            weights,
            values,
            score,
        })
    }

    /// Turns errors of what gears pass on into those of what drives exert. A share l of the load leaves 1 − l of a force that drives, of its
    /// noise too, so that any torque that always drives would be explained by a large share.
    fn by_drive(
        &self,
        sums: &JointSums,
        (values, friction): (&[f64], &Friction),
        errors: &mut [f64],
    ) {
        let Friction::Loaded(speeds) = friction else {
            return;
        };
        let shares = &values[values.len() - self.robot.dof()..];
        let each = errors.iter_mut().zip(shares);
        for ((error, share), driving) in each.zip(sums.driving(speeds)) {
            let [drives, brakes] = [1.0, -1.0].map(|sign| (1.0 - sign * share).powi(-2));
            *error *= 0.5 * ((1.0 + driving) * drives + (1.0 - driving) * brakes);
        }
    }

    /// Whether the springs, where there are any, do more than make up for what is not exact.
    fn pulls(&self, own: &Candidate<'_>) -> bool {
        let n = self.robot.dof();
        let springs = &own.values[own.values.len() - n..];
        let torques = springs.iter().zip(&self.spread).map(|(k, q)| k * q);
        let pulls = |(torque, scale): (f64, &f64)| torque.abs() > PULLS * scale;
        !own.friction.springs() || torques.zip(&self.scale.torques).any(pulls)
    }

    /// Whether every gear passes enough of its torque on.
    fn moves(&self, values: &[f64], friction: &Friction) -> bool {
        let n = self.robot.dof();
        let shares = match friction {
            Friction::Loaded(_) => &values[values.len() - n..],
            _ => &[],
        };
        shares.iter().all(|share| *share < LARGEST_SHARE)
    }

    /// The mean square of the residuals in parts of the deviation of the torques.
    fn loss(&self, sums: &JointSums, of: &Candidate<'_>) -> f64 {
        let relative = self.scale.relative(sums, &of.values, of.friction);
        relative.iter().sum::<f64>() / self.robot.dof().max(1) as f64
    }

    /// The model of the best candidate, solved once more with the validation samples.
    fn assemble(&self, dataset: &Dataset, best: Candidate<'_>) -> Result<Identification> {
        let all = self.train.clone().plus(&self.validation);
        let data = best.weights.quadratic(&all, best.friction);
        let minimum = minimise(&data, best.prior, best.strength, &best.values)
            .filter(|minimum| self.moves(&minimum.values, best.friction));
        let values = minimum.map_or_else(|| best.values.clone(), |minimum| minimum.values);
        let motion = motion(&self.robot, &values, best.friction, &self.speeds)?;
        let correlations = correlations(dataset, &motion);
        let certainty = self.certainty(&all, &best, &values, &correlations);
        Ok(Identification {
            model: IdentifiedRobot::new(motion, certainty.errors())?,
            described: self.robot.clone(),
            loss: self.loss(&self.train, &best),
            validation: (self.validation.samples > 0).then(|| self.loss(&self.validation, &best)),
            samples: all.samples,
            independent: correlations
                .iter()
                .map(|c| all.samples as f64 / c)
                .collect(),
            combinations: rank(&data, NO_EFFECT),
            certainty,
        })
    }

    /// Covariances from the information of data and prior: residuals have the variance 1 by their weights, and those of
    /// joint j count as a κⱼth of their number. The strength of the prior is relative to the data, so it is reduced
    /// accordingly.
    fn certainty(
        &self,
        all: &JointSums,
        best: &Candidate<'_>,
        values: &[f64],
        correlations: &[f64],
    ) -> Certainty {
        let torques = (all.samples * self.robot.dof()).max(1) as f64;
        let mean = correlations.iter().sum::<f64>() / correlations.len().max(1) as f64;
        let weights = best.weights.weights.iter().zip(correlations);
        let weights: Vec<f64> = weights.map(|(w, c)| w / c.sqrt()).collect();
        let data = all.quadratic(&weights, best.friction);
        let strength = best.strength / mean.max(1.0);
        Certainty::after(&data, torques, best.prior, strength, values)
    }
}
