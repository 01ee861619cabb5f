//! A robot that follows a reference with a feed-forward that may be learned during the motion.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{OnlineLearner, Record, spawn};
use crate::payload::{PayloadConfig, PayloadEstimator, PayloadFeedForward};
use crate::{
    Controller, Driven, FeedForward, Gains, LoopConfig, LoopOutcome, Pd, Reference, RobotChange,
    Simulation,
};
use lagrangian::rigid::{LoadParameters, RigidBodies};
use lagrangian::{Error, Learned, Model, Result};

/// Source of the feed-forward torque.
pub enum FeedForwardSource<'a> {
    /// Without feed-forward: only feedback acts.
    None,
    /// A fixed model.
    Model(&'a dyn Model),
    /// A model that is learned in lock step with the motion, with fixed rates of steps and hand-overs.
    LockStep {
        /// Learner of the model.
        learner: Box<OnlineLearner>,
        /// Number of training steps in a second of motion.
        steps: f64,
        /// Number of hand-overs in a second of motion.
        hand_overs: f64,
    },
    /// A model that is learned on a separate thread while the loop runs in real time.
    Thread(Box<OnlineLearner>),
}

/// A robot, its loop, and a change of the robot during the motion.
pub struct TrackingConfig<'a> {
    /// Robot that follows the reference.
    pub robot: &'a dyn Model,
    /// Robot that replaces the first one during the motion, if any.
    pub change: Option<RobotChange<'a>>,
    /// Gains of the feedback.
    pub gains: Gains,
    /// Settings of the loop.
    pub control: LoopConfig,
    /// Estimator of the load of the robot, which adds its torque to that of the feed-forward, if any.
    pub payload: Option<PayloadSource<'a>>,
}

/// Place of a payload, and settings of its estimation.
#[derive(Clone, Copy)]
pub struct PayloadSource<'a> {
    /// Kinematics of the robot.
    pub bodies: &'a RigidBodies,
    /// Settings of the estimator.
    pub config: PayloadConfig,
    /// Link that carries the payload.
    pub link: &'a str,
    /// Time of the first estimate, s from the start of the motion: a learned model must first
    /// fit the robot.
    pub from: f64,
    /// Whether the learned model takes the load up itself: it then learns from the torques with those of the load, which its estimate makes
    /// up for until then.
    pub absorbed: bool,
}

/// Motion of a robot that followed a reference, and record of its learner.
pub struct Tracked {
    /// Simulated motion.
    pub driven: Driven,
    /// Record of the learner, if there was one.
    pub record: Option<Record>,
    /// Number of ticks without feed-forward: before the first model, or when a model was not finite.
    pub without_model: u64,
    /// Load at the end of the motion, if it was estimated.
    pub load: Option<LoadParameters>,
}

/// Lets a robot follow `reference` from its first sample to its last.
///
/// # Errors
/// As [`Simulation::new`], [`FeedForward::new`], [`PayloadEstimator::new`] and the learner's own.
pub fn track<'a>(
    config: &'a TrackingConfig<'a>,
    reference: &'a Reference,
    feed_forward: FeedForwardSource<'a>,
) -> Result<Tracked> {
    let n = reference.dof();
    Error::check_shape(
        "reference",
        n,
        config.robot.coordinates().dof(),
        "give a column of q and qd for each coordinate of the robot",
    )?;
    let estimator = |source: PayloadSource<'a>| {
        PayloadEstimator::new(source.bodies, source.link, source.config)
    };
    let mut run = Run {
        estimator: config.payload.map(estimator).transpose()?,
        simulation: Simulation::new(
            config.robot,
            &reference.first_state(),
            config.control.clone(),
        )?
        .with_change(config.change),
        config,
        reference,
        row: vec![0.0; super::Differentiator::width(n)],
        begin: reference.start(),
        without_model: 0,
    };
    let record = match feed_forward {
        FeedForwardSource::None => run.drive(None, &mut |_| false).map(|()| None),
        FeedForwardSource::Model(model) => run.drive(Some(model), &mut |_| false).map(|()| None),
        FeedForwardSource::LockStep {
            learner,
            steps,
            hand_overs,
        } => run.lock_step(*learner, steps, hand_overs).map(Some),
        FeedForwardSource::Thread(learner) => run.beside(*learner).map(Some),
    }?;
    Ok(Tracked {
        load: run.estimator.as_ref().and_then(|e| e.load().copied()),
        driven: run.simulation.finish(),
        record,
        without_model: run.without_model,
    })
}

struct Run<'a> {
    simulation: Simulation<'a>,
    config: &'a TrackingConfig<'a>,
    reference: &'a Reference,
    /// Row (t, q, q̇, τ) of the last tick.
    row: Vec<f64>,
    begin: f64,
    without_model: u64,
    estimator: Option<PayloadEstimator<'a>>,
}

impl<'a> Run<'a> {
    /// Runs one tick; breaks at the end of the reference, or where the robot diverged.
    fn tick(&mut self, controller: &mut dyn Controller) -> ControlFlow<()> {
        let t = self.simulation.time();
        if t > self.reference.end() - self.begin {
            return ControlFlow::Break(());
        }
        let begin = self.begin;
        let mut shifted = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
            controller.torque(t + begin, q, qd, tau);
        };
        let outcome = self.simulation.tick(&mut shifted);
        let n = self.reference.dof();
        let measured = self.simulation.measured();
        self.row[0] = t;
        self.row[1..=n].copy_from_slice(&measured.q);
        self.row[1 + n..=2 * n].copy_from_slice(&measured.qd);
        self.row[1 + 2 * n..].copy_from_slice(self.simulation.torque());
        match outcome {
            LoopOutcome::Finished => ControlFlow::Continue(()),
            LoopOutcome::Diverged { .. } => ControlFlow::Break(()),
        }
    }

    /// Runs with this model, or with feedback only, until `after` returns true because of a new model, or to the end.
    fn drive(
        &mut self,
        model: Option<&dyn Model>,
        after: &mut dyn FnMut(&[f64]) -> bool,
    ) -> Result<()> {
        let (config, reference) = (self.config, self.reference);
        let Some(model) = model else {
            let mut pd = Pd::new(config.gains.clone(), reference)?;
            while self.tick(&mut pd).is_continue() {
                self.without_model += 1;
                if after(&self.row) {
                    break;
                }
            }
            return Ok(());
        };
        let lead = config.control.lead();
        let mut controller = FeedForward::new(model, &config.gains, reference, lead)?;
        while !self.estimates() {
            if self.tick(&mut controller).is_break() || after(&self.row) {
                self.without_model += controller.dropped();
                return Ok(());
            }
        }
        self.carry(controller, after)
    }

    /// Whether an estimator of the load is present and its time has come.
    fn estimates(&self) -> bool {
        let from = self.config.payload.map_or(0.0, |source| source.from);
        self.estimator.is_some() && self.simulation.time() >= from
    }

    /// Runs with simultaneous estimation of the load. A learned model gets the torques without those of the load.
    fn carry(&mut self, forward: FeedForward, after: &mut dyn FnMut(&[f64]) -> bool) -> Result<()> {
        let Some(mut estimator) = self.estimator.take() else {
            return Ok(());
        };
        let first = 1 + 2 * self.reference.dof();
        let absorbed = self.config.payload.is_some_and(|source| source.absorbed);
        let mut controller = PayloadFeedForward::new(forward, &mut estimator)?;
        while self.tick(&mut controller).is_continue() {
            controller.set_acting(self.simulation.torque());
            if !absorbed {
                controller.unload(&mut self.row[first..]);
            }
            if after(&self.row) {
                break;
            }
        }
        self.without_model += controller.dropped();
        self.estimator = Some(estimator);
        Ok(())
    }

    fn is_over(&self) -> bool {
        let diverged = self.simulation.so_far().outcome.is_diverged();
        diverged || self.simulation.time() > self.reference.end() - self.begin
    }

    fn lock_step(&mut self, learner: OnlineLearner, steps: f64, hand_overs: f64) -> Result<Record> {
        let rate = self.config.control.rate;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !(positive(steps) && positive(hand_overs)) {
            return Err(Error::argument(
                "steps and hand-overs a second",
                format!("{steps} and {hand_overs}"),
                "finite and above 0",
            ));
        }
        let every = (rate / hand_overs).round().max(1.0) as usize;
        let each = (steps * every as f64 / rate).round().max(1.0) as usize;
        let (mut learner, mut ticks, mut failure) = (learner, 0usize, None);
        let mut model: Option<Learned> = None;
        while !self.is_over() {
            let mut next = None;
            let mut after = |row: &[f64]| {
                ticks += 1;
                let result = learner.observe(row).and_then(|()| {
                    if ticks.is_multiple_of(every) {
                        learner.train(each)?;
                        next = learner.hand_over();
                    }
                    Ok(())
                });
                failure = result.err();
                failure.is_some() || next.is_some()
            };
            self.drive(model.as_ref().map(|model| model as &dyn Model), &mut after)?;
            if let Some(failure) = failure {
                return Err(failure);
            }
            model = next.or(model);
        }
        Ok(learner.record())
    }

    /// Runs the learner on its thread and the loop in real time.
    fn beside(&mut self, learner: OnlineLearner) -> Result<Record> {
        let thread = spawn(learner)?;
        let (period, clock) = (self.config.control.period(), Instant::now());
        let mut model: Option<Arc<Learned>> = None;
        let mut ticks = 0u32;
        while !self.is_over() {
            let mut after = |row: &[f64]| {
                thread.push(row);
                ticks += 1;
                let due = Duration::from_secs_f64(f64::from(ticks) * period);
                std::thread::sleep(due.saturating_sub(clock.elapsed()));
                thread.has_new()
            };
            self.drive(
                model.as_deref().map(|model| model as &dyn Model),
                &mut after,
            )?;
            model = thread.take().or(model);
        }
        thread.finish()
    }
}
