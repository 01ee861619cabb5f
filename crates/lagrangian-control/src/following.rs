//! A robot that follows a whole reference, and its errors.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::online::{
    FeedForwardSource, OnlineConfig, OnlineLearner, PayloadSource, Record, Tracked, TrackingConfig,
    track,
};
use super::payload::PayloadConfig;
use super::{
    ComputedTorque, Controller, Desired, Driven, FeedForward, Gains, LoopConfig, Pd, Reference,
    RobotChange, Simulation,
};
use lagrangian::{Coordinates, Error, Model, Result};

/// The control law, with the gains of [`Pd`], [`FeedForward`] or [`ComputedTorque`].
#[derive(Clone, Copy)]
pub enum ControlLaw<'a> {
    /// Feedback only, [`Pd`].
    Feedback(&'a Gains),
    /// Feedback together with the torque that a model predicts along the reference, [`FeedForward`].
    FeedForward(&'a dyn Model, &'a Gains),
    /// Feedback linearised by a model, [`ComputedTorque`].
    ComputedTorque(&'a dyn Model, &'a Gains),
    /// [`FeedForward`] through a model of these coordinates that learns from nothing during the motion, in lock step with it.
    Online(&'a Coordinates, &'a OnlineConfig, &'a Gains),
}

/// Training steps and hand-overs in a second of motion, of a model that learns in lock step with it.
const STEPS: f64 = 100.0;
const HAND_OVERS: f64 = 20.0;

/// Errors of a robot that followed a reference, `[n]` each.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Following {
    /// Root mean square of e = `q_d` − q over all ticks, rad (m).
    pub rmse: Vec<f64>,
    /// Largest |e|, rad (m).
    pub largest: Vec<f64>,
    /// Fraction of the ticks at which the torque was at its limit; 0 without a limit.
    pub at_limit: Vec<f64>,
}

/// Motion of a robot that followed a reference.
#[derive(Debug, Clone)]
pub struct Followed {
    /// Simulated motion, at the times of the reference.
    pub driven: Driven,
    /// Tracking error e = `q_d` − q at the ticks, `[ticks, n]`.
    pub error: Vec<f64>,
    /// Summary of the errors.
    pub following: Following,
    /// Number of ticks at which the feed-forward was not finite, so that only feedback acted.
    pub without_model: u64,
    /// Record of the model that was learned during the motion, if one was.
    pub record: Option<Record>,
}

/// Minimum number of ticks of a reference: a shorter one contains too little motion to follow.
const FEWEST_TICKS: f64 = 10.0;
/// Maximum number of ticks of a reference: all are held in memory.
const MOST_TICKS: f64 = 5e6;
/// Maximum delay, as a fraction of the reference.
const LONGEST_DELAY: f64 = 0.5;

/// Lets `robot`, or the one that takes its place, follow `reference` from its first sample, where it begins without error, to its last.
///
/// # Errors
/// As [`Simulation::new`] and the controllers' and learners' own; [`Error::Shape`] for a robot of other degrees of freedom,
/// [`Error::Argument`] for one without forward dynamics, for a reference of too few or too many ticks, and for delays of
/// more than half of it.
pub fn follow(
    robot: &dyn Model,
    change: Option<RobotChange>,
    reference: &Reference,
    law: ControlLaw,
    control: &LoopConfig,
) -> Result<Followed> {
    control.validate(reference.dof())?;
    refuse_robot(robot, reference)?;
    change.map_or(Ok(()), |other| refuse_robot(other.robot, reference))?;
    refuse_length(reference, control)?;
    let drive = |controller: &mut dyn Controller| {
        let start = reference.first_state();
        let simulation = Simulation::new(robot, &start, control.clone())?.with_change(change);
        Ok::<_, Error>(run(simulation, reference, controller))
    };
    let mut record = None;
    let (driven, without_model) = match law {
        ControlLaw::Feedback(gains) => (drive(&mut Pd::new(gains.clone(), reference)?)?, 0),
        ControlLaw::FeedForward(model, gains) => {
            let mut controller = FeedForward::new(model, gains, reference, control.lead())?;
            (drive(&mut controller)?, controller.dropped())
        }
        ControlLaw::ComputedTorque(model, gains) => {
            let mut controller = ComputedTorque::new(model, gains.clone(), reference)?;
            (drive(&mut controller)?, 0)
        }
        ControlLaw::Online(coordinates, online, gains) => {
            let learner = OnlineLearner::new(coordinates.clone(), online.clone())?;
            let tracked = learn(learner, (robot, change), reference, (gains, control))?;
            record = tracked.record;
            (tracked.driven, tracked.without_model)
        }
    };
    let driven = driven.begun_at(reference.start());
    let error = errors(&driven, reference);
    let all = 0..driven.trajectory.len();
    Ok(Followed {
        following: Following::of(&driven, &error, &control.limit, all),
        driven,
        error,
        without_model,
        record,
    })
}

/// Lets a robot follow a reference through a model that learns during the motion; beside one of known kinematics, an estimate of the load acts.
fn learn(
    learner: OnlineLearner,
    (robot, change): (&dyn Model, Option<RobotChange>),
    reference: &Reference,
    (gains, control): (&Gains, &LoopConfig),
) -> Result<Tracked> {
    let kinematics = learner.kinematics().cloned();
    let payload = kinematics.as_ref().map(|bodies| PayloadSource {
        bodies,
        config: PayloadConfig::default(),
        link: bodies.tip(),
        from: 0.0,
        absorbed: true,
    });
    let config = TrackingConfig {
        robot,
        change,
        gains: gains.clone(),
        control: control.clone(),
        payload,
    };
    let source = FeedForwardSource::LockStep {
        learner: Box::new(learner),
        steps: STEPS,
        hand_overs: HAND_OVERS,
    };
    track(&config, reference, source)
}

impl Followed {
    /// The errors of one of `parts` equal parts of the motion, counted from 0, under these torque limits; the last, where `part` is beyond
    /// it.
    #[must_use]
    pub fn part(&self, part: usize, parts: usize, limit: &[f64]) -> Following {
        let (ticks, parts) = (self.driven.trajectory.len(), parts.max(1));
        let part = part.min(parts - 1);
        let range = part * ticks / parts..(part + 1) * ticks / parts;
        Following::of(&self.driven, &self.error, limit, range)
    }
}

fn refuse_robot(robot: &dyn Model, reference: &Reference) -> Result<()> {
    let (found, expected) = (reference.dof(), robot.coordinates().dof());
    Error::check_shape(
        "reference",
        found,
        expected,
        "give a column of q for each joint of the robot, or the robot of the reference",
    )?;
    if robot.moves() {
        return Ok(());
    }
    Err(Error::argument(
        "robot",
        "a model without forward dynamics",
        "a Lagrangian, a known system, or rigid bodies",
    ))
}

fn refuse_length(reference: &Reference, control: &LoopConfig) -> Result<()> {
    let seconds = reference.end() - reference.start();
    let ticks = seconds * control.rate;
    if !(FEWEST_TICKS..=MOST_TICKS).contains(&ticks) {
        return Err(Error::argument(
            "length of the reference",
            format!("{seconds} s, {ticks:.0} ticks"),
            "10 to 5000000 ticks of the loop: change the rate, or the reference",
        ));
    }
    let delay = (control.actuation_delay + control.sensor_delay) as f64;
    if delay <= LONGEST_DELAY * ticks {
        return Ok(());
    }
    Err(Error::argument(
        "delay",
        format!("{delay} of {ticks:.0} ticks"),
        "at most half of the reference: loops of robots have 0 to some 10 ticks",
    ))
}

fn run(
    mut simulation: Simulation,
    reference: &Reference,
    controller: &mut dyn Controller,
) -> Driven {
    let begin = reference.start();
    let mut shifted = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
        controller.torque(t + begin, q, qd, tau);
    };
    simulation.run(&mut shifted, reference.end() - begin);
    simulation.finish()
}

fn errors(driven: &Driven, reference: &Reference) -> Vec<f64> {
    let n = reference.dof();
    let mut desired = Desired::new(n);
    let rows = driven
        .trajectory
        .t
        .iter()
        .zip(driven.trajectory.q.chunks_exact(n));
    let mut error = Vec::with_capacity(driven.trajectory.q.len());
    for (&t, q) in rows {
        reference.at(t, &mut desired);
        error.extend(desired.q.iter().zip(q).map(|(wanted, q)| wanted - q));
    }
    error
}

impl Following {
    /// The errors of these ticks.
    fn of(driven: &Driven, error: &[f64], limit: &[f64], ticks: Range<usize>) -> Self {
        let n = driven.trajectory.dof();
        let rows = n * ticks.start..n * ticks.end;
        let (tau, error) = (&driven.trajectory.tau[rows.clone()], &error[rows]);
        let ticks = ticks.len() as f64;
        let column = |x: &'_ [f64], i: usize| x.iter().skip(i).step_by(n).copied().collect();
        let each = |figure: &dyn Fn(usize) -> f64| (0..n).map(figure).collect();
        let rmse = |i| {
            let e: Vec<f64> = column(error, i);
            (e.iter().map(|e| e * e).sum::<f64>() / ticks).sqrt()
        };
        let largest = |i| {
            let e: Vec<f64> = column(error, i);
            e.iter().fold(0.0, |most: f64, e| most.max(e.abs()))
        };
        let at_limit = |i| {
            let Some(&limit) = limit.get(i).filter(|limit| **limit > 0.0) else {
                return 0.0;
            };
            let tau: Vec<f64> = column(tau, i);
            tau.iter().filter(|tau| tau.abs() >= limit).count() as f64 / ticks
        };
        Self {
            rmse: each(&rmse),
            largest: each(&largest),
            at_limit: each(&at_limit),
        }
    }
}
