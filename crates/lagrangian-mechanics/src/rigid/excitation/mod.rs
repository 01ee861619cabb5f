//! Motions from which a robot can be identified: they move all joints within their limits so that the torques carry as
//! much information as possible about all combinations of parameters (theory.md, 47b).
//!
//! | file | content |
//! |---|---|
//! | `series.rs` | motions: Fourier series that begin and end at rest |
//! | `criterion.rs` | information of a motion |
//! | `search.rs` | the search for the most informative motion |

mod criterion;
mod search;
mod series;

use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use search::SearchProgress;

use self::criterion::{IdentificationTarget, RobotUnknown, SMOOTHING, information, put_torques};
use self::search::Problem;
use self::series::{Timing, motion};
use super::bodies::RigidBodies;
use super::changes::{Certainty, Changes, Known};
use super::consistent::{Prior, is_consistent};
use super::limits::{Bounds, JointLimits};
use super::regressor::PER_BODY;
use crate::forces::Dissipation;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};

/// Requirements of a motion for the identification of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationConfig {
    /// Duration, s.
    pub duration: f64,
    /// Sample rate, Hz.
    pub rate: f64,
    /// Number of waves of each joint: harmonics of a period of 10 s at most.
    pub harmonics: usize,
    /// Fraction of each limit that is used.
    pub margin: f64,
    /// Deviation of the noise of the torques, relative to the limits of effort or, without these, to the root mean
    /// squares of the torques.
    pub noise: f64,
    /// Number of random motions that the search begins with.
    pub starts: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for ExcitationConfig {
    fn default() -> Self {
        Self {
            duration: 30.0,
            rate: 100.0,
            harmonics: 6,
            margin: 0.9,
            noise: 0.01,
            starts: 32,
            seed: 0,
        }
    }
}

/// The shortest and the longest motion, s; a longer one is a repetition.
const DURATIONS: [f64; 2] = [0.1, 600.0];
/// Minimum and maximum number of samples of a motion.
const SAMPLES: [f64; 2] = [20.0, 1_000_000.0];
/// Maximum number of waves of a joint.
const HARMONICS: usize = 50;
/// Number of random states that determine the identifiable combinations of parameters.
const STATES: usize = 600;
/// Strength of the prior of expected errors, in torques: bodies are known to a factor of about two.
const STRENGTH: f64 = 1.0;

impl ExcitationConfig {
    /// Checks all settings.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first value outside of its domain.
    pub fn validate(&self) -> Result<()> {
        let within = |x: f64, [least, most]: [f64; 2]| (least..=most).contains(&x);
        let checks = [
            (
                "duration",
                self.duration,
                within(self.duration, DURATIONS),
                "from 0.1 to 600 s: repeat a plan for more",
            ),
            (
                "rate",
                self.rate,
                within(self.rate * self.duration, SAMPLES),
                "such that a plan has from 20 to 1 000 000 samples",
            ),
            (
                "harmonics",
                self.harmonics as f64,
                (1..=HARMONICS).contains(&self.harmonics),
                "from 1 to 50",
            ),
            (
                "margin",
                self.margin,
                self.margin > 0.0 && self.margin <= 1.0,
                "above 0, and 1 at most",
            ),
            (
                "noise",
                self.noise,
                self.noise > 0.0 && self.noise.is_finite(),
                "above 0",
            ),
            (
                "starts",
                self.starts as f64,
                (1..=10_000).contains(&self.starts),
                "from 1 to 10 000",
            ),
        ];
        match checks.into_iter().find(|(_, _, right, _)| !right) {
            Some((name, value, _, must)) => Err(Error::argument(name, value, must)),
            None => Ok(()),
        }
    }

    fn timing(&self) -> Timing {
        Timing {
            duration: self.duration,
            harmonics: self.harmonics,
        }
    }

    fn times(&self) -> Vec<f64> {
        let steps = (self.duration * self.rate).floor().max(1.0);
        let count = steps as usize;
        (0..=count)
            .map(|k| self.duration * k as f64 / steps)
            .collect()
    }
}

/// A motion for identification.
#[derive(Debug, Clone)]
pub struct Excitation {
    /// The motion, with the torques of the description where there is one; these do not include friction.
    pub plan: Trajectory,
    /// Factor by which the information about a combination of parameters grew in the search, as the geometric mean of all.
    pub gain: f64,
    /// Number of combinations of parameters that can be identified.
    pub combinations: usize,
    /// Number of motions that were tried.
    pub tried: usize,
    /// Assumed deviation of the noise of each torque, `[n]`; empty without a robot.
    pub noise: Vec<f64>,
    /// Expected result of an identification with this motion, if there is a robot: standard errors of all quantities
    /// under noise that is independent from sample to sample.
    pub expected: Option<Changes>,
}

/// Searches for a motion of a robot from which its parameters can be identified, until `watch` breaks; a given `seed` and number of
/// rounds always give the same motion. Collisions are not checked.
///
/// The motion maximises log det of the information about all combinations of inertial parameters, rotors, constant torques and
/// friction that can be identified (D-optimality; Swevers et al. 1997), within `margin` times the `limits` of the joints.
///
/// # Errors
/// As [`ExcitationConfig::validate`]; [`Error::Setting`] for limits that are missing or allow no motion, or
/// where every motion needs more torque than `effort`; [`Error::Shape`] for another number of limits.
///
/// ```
/// use std::ops::ControlFlow;
/// use lagrangian_mechanics::rigid::{self, ExcitationConfig, JointLimits, RigidBodies};
///
/// let text = rigid::example("two_link_arm").unwrap_or_default();
/// let arm = RigidBodies::from_urdf(text)?;
/// let limits = JointLimits::of_urdf(text, arm.joints())?;
/// let config = ExcitationConfig { duration: 5.0, ..ExcitationConfig::default() };
/// let found = rigid::excite(&arm, &limits, &config, &mut |progress| match progress.rounds {
///     0..20 => ControlFlow::Continue(()),
///     _ => ControlFlow::Break(()),
/// })?;
/// assert!(found.gain > 1.0 && found.plan.len() == 501);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
pub fn excite(
    robot: &RigidBodies,
    limits: &[JointLimits],
    config: &ExcitationConfig,
    watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
) -> Result<Excitation> {
    config.validate()?;
    let bounds = bounds(robot.joints(), limits, config)?;
    let states = random_states(robot, &bounds, config.seed);
    let noise = noise(&states, &bounds, config);
    let weights: Vec<f64> = noise.iter().map(|s| 1.0 / s).collect();
    let unknown = IdentificationTarget::Robot(RobotUnknown::new(robot, weights.clone(), &states));
    let mut found = search(unknown, &bounds, config, watch)?;
    put_torques(robot, &mut found.plan.signals);
    let samples = Samples::new(robot.dof(), found.plan.signals.clone());
    found.expected = Some(expected(robot, &weights, &samples)?);
    found.noise = noise;
    Ok(found)
}

/// Searches for a motion of joints that are known only by their limits: positions, velocities and accelerations of all
/// joints are large and not correlated, as far as the limits allow. Otherwise as [`excite`].
///
/// # Errors
/// As [`excite`].
pub fn excite_joints(
    coordinates: &Coordinates,
    limits: &[JointLimits],
    config: &ExcitationConfig,
    watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
) -> Result<Excitation> {
    config.validate()?;
    if coordinates.dof() == 0 {
        return Err(Error::argument("joints", 0, "1 or above"));
    }
    let names: Vec<String> = coordinates.0.iter().map(|c| c.name.clone()).collect();
    let bounds = bounds(&names, limits, config)?;
    search(
        IdentificationTarget::Linear { bounds: &bounds },
        &bounds,
        config,
        watch,
    )
}

fn bounds(
    joints: &[String],
    limits: &[JointLimits],
    config: &ExcitationConfig,
) -> Result<Vec<Bounds>> {
    Error::check_shape(
        "limits",
        limits.len(),
        joints.len(),
        "give them for each joint",
    )?;
    let pairs = joints.iter().zip(limits);
    pairs
        .map(|(joint, limits)| Bounds::of(limits, joint, config.margin))
        .collect()
}

fn search(
    unknown: IdentificationTarget<'_>,
    bounds: &[Bounds],
    config: &ExcitationConfig,
    watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
) -> Result<Excitation> {
    let problem = Problem::new(unknown, bounds, config.timing());
    let mut last = None;
    let mut noted = |progress: &SearchProgress| {
        last = Some(*progress);
        watch(progress)
    };
    let found = problem.search(config.seed, config.starts, &mut noted);
    let found = found.ok_or_else(|| {
        Error::setting(
            "every motion that was tried needs more torque than the limits `effort`",
            "give larger ones, or postures in which the robot is easier to hold (`lower`, `upper`)",
        )
    })?;
    Ok(Excitation {
        plan: motion(&found.series, problem.timing, &config.times()),
        gain: last.map_or(1.0, |progress| progress.gain),
        tried: last.map_or(0, |progress| progress.tried),
        combinations: problem.unknown.combinations(),
        noise: Vec::new(),
        expected: None,
    })
}

/// Random states within the bounds, with their torques.
fn random_states(robot: &RigidBodies, bounds: &[Bounds], seed: u64) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut signals = Signals::<Vec<f64>>::default();
    for _ in 0..STATES {
        for b in bounds {
            signals.q.push(rng.random_range(b.lower..b.upper));
            signals.qd.push(rng.random_range(-b.velocity..b.velocity));
            signals
                .qdd
                .push(rng.random_range(-b.acceleration..b.acceleration));
        }
    }
    put_torques(robot, &mut signals);
    Samples::new(bounds.len(), signals)
}

/// Noise of each torque.
fn noise(states: &Samples, bounds: &[Bounds], config: &ExcitationConfig) -> Vec<f64> {
    let n = bounds.len();
    let of = |(i, b): (usize, &Bounds)| {
        if b.effort.is_finite() {
            return config.noise * b.effort / config.margin;
        }
        let squares = states.tau.iter().skip(i).step_by(n).map(|t| t * t);
        config.noise
            * (squares.sum::<f64>() / states.len() as f64)
                .sqrt()
                .max(1e-9)
    };
    bounds.iter().enumerate().map(of).collect()
}

/// Certainty after a motion about the robot of the description, with a weak prior.
fn expected(robot: &RigidBodies, weights: &[f64], samples: &Samples) -> Result<Changes> {
    let n = robot.dof();
    let scale: Vec<f64> = weights.iter().map(|w| 100.0 / w).collect();
    let mut prior = Prior::generic(&scale, (4, false));
    let described = robot.inertial_parameters();
    let own = described.as_chunks::<PER_BODY>().0.iter();
    for (body, own) in prior
        .bodies
        .iter_mut()
        .zip(own)
        .filter(|(_, own)| is_consistent(own))
    {
        *body = *own;
    }
    let (torques, values) = ((samples.len() * n) as f64, prior.values());
    let data = information(robot, weights, samples);
    let certainty = Certainty::after(&data, torques, &prior, STRENGTH / torques, &values);
    let known = robot
        .clone()
        .with_inertial_parameters(values.split_at(PER_BODY * n).0)?;
    let coefficient = |kind: usize| values[PER_BODY * n + kind * n..][..n].to_vec();
    let friction = Dissipation {
        viscous: coefficient(2),
        coulomb: coefficient(3),
        smoothing: vec![SMOOTHING; n],
        ..Dissipation::default()
    };
    let known = Known {
        robot: &known.with_drives(coefficient(0), coefficient(1))?,
        described: robot,
        friction: Some(&friction),
        certainty: &certainty,
    };
    Ok(known.changes())
}
