//! A robot that follows a reference with a feed-forward that may be learned on the way.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{OnlineLearner, Record, spawn};
use crate::{Controller, Driven, FeedForward, Gains, LoopConfig, Pd, Reference, Simulation};
use lagrangian::dynamics::Model;
use lagrangian::train::Learned;
use lagrangian::{Error, Result, State};

/// Where the torque of the feed-forward comes from.
pub enum Feed<'a> {
    /// Nowhere: feedback alone.
    None,
    /// A model that stays as it is.
    Model(&'a dyn Model),
    /// A model that is learned in lock step with the motion: so many steps a second, and a hand-over so often.
    LockStep {
        /// The learner.
        learner: Box<OnlineLearner>,
        /// Training steps in a second of motion.
        steps: f64,
        /// Hand-overs in a second of motion.
        hand_overs: f64,
    },
    /// A model that is learned on a thread of its own, while the loop keeps real time.
    Thread(Box<OnlineLearner>),
}

/// A robot, and what changes on its way.
pub struct TrackingConfig<'a> {
    /// The robot.
    pub robot: &'a dyn Model,
    /// What takes its place from an instant on, s.
    pub change: Option<(f64, &'a dyn Model)>,
    /// Gains of the feedback.
    pub gains: Gains,
    /// The loop.
    pub control: LoopConfig,
}

/// What came of it.
pub struct Tracked {
    /// The motion.
    pub driven: Driven,
    /// What the learner did, where there was one.
    pub record: Option<Record>,
    /// Ticks without feed-forward: before the first model, or where one was not finite.
    pub without: u64,
}

/// Follows `reference` from its first sample to its last.
///
/// # Errors
/// As [`Simulation::new`], [`FeedForward::new`] and the learner's own.
pub fn track(config: &TrackingConfig, reference: &Reference, feed: Feed) -> Result<Tracked> {
    let n = reference.dof();
    if config.robot.coordinates().dof() != n {
        return Err(Error::Shape {
            what: "reference".into(),
            found: n,
            expected: config.robot.coordinates().dof(),
            remedy: "give a column of q and qd for each coordinate of the robot".into(),
        });
    }
    let samples = reference.samples();
    let start = State::new(samples.q[..n].to_vec(), samples.qd[..n].to_vec());
    let mut run = Run {
        simulation: Simulation::new(config.robot, &start, config.control.clone())?,
        config,
        reference,
        changed: false,
        row: vec![0.0; super::Differentiator::width(n)],
        begin: reference.start(),
        without: 0,
    };
    let record = match feed {
        Feed::None => run.alone().map(|()| None),
        Feed::Model(model) => run.with(model, &mut |_| false).map(|()| None),
        Feed::LockStep {
            learner,
            steps,
            hand_overs,
        } => run.lock_step(*learner, steps, hand_overs).map(Some),
        Feed::Thread(learner) => run.beside(*learner).map(Some),
    }?;
    Ok(Tracked {
        driven: run.simulation.finish(),
        record,
        without: run.without,
    })
}

struct Run<'a> {
    simulation: Simulation<'a>,
    config: &'a TrackingConfig<'a>,
    reference: &'a Reference,
    changed: bool,
    /// (t, q, q̇, τ) of the last tick.
    row: Vec<f64>,
    begin: f64,
    without: u64,
}

impl<'a> Run<'a> {
    /// One tick; `false` at the end.
    fn tick(&mut self, controller: &mut dyn Controller) -> bool {
        let t = self.simulation.time();
        if t > self.reference.end() - self.begin {
            return false;
        }
        if let Some((at, robot)) = self.config.change
            && !self.changed
            && t >= at
        {
            self.simulation.change_robot(robot);
            self.changed = true;
        }
        let begin = self.begin;
        let mut shifted = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
            controller.torque(t + begin, q, qd, tau);
        };
        let goes_on = self.simulation.tick(&mut shifted);
        let n = self.reference.dof();
        let measured = self.simulation.measured();
        self.row[0] = t;
        self.row[1..=n].copy_from_slice(&measured.q);
        self.row[1 + n..=2 * n].copy_from_slice(&measured.qd);
        self.row[1 + 2 * n..].copy_from_slice(self.simulation.torque());
        goes_on
    }

    fn alone(&mut self) -> Result<()> {
        let mut pd = Pd::new(self.config.gains.clone(), self.reference)?;
        while self.tick(&mut pd) {
            self.without += 1;
        }
        Ok(())
    }

    /// With this model until `after` says that there is another, or to the end.
    fn with(&mut self, model: &dyn Model, after: &mut dyn FnMut(&[f64]) -> bool) -> Result<()> {
        let (config, reference) = (self.config, self.reference);
        let lead = config.control.lead();
        let mut controller = FeedForward::new(model, &config.gains, reference, lead)?;
        while self.tick(&mut controller) {
            if after(&self.row) {
                break;
            }
        }
        self.without += controller.dropped();
        Ok(())
    }

    fn is_over(&self) -> bool {
        let ended = self.simulation.so_far().ending != crate::Ending::Finished;
        ended || self.simulation.time() > self.reference.end() - self.begin
    }

    fn lock_step(&mut self, learner: OnlineLearner, steps: f64, hand_overs: f64) -> Result<Record> {
        let rate = self.config.control.rate;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !(positive(steps) && positive(hand_overs)) {
            return Err(Error::Argument {
                name: "steps and hand-overs a second",
                value: format!("{steps} and {hand_overs}"),
                must: "finite and above 0",
            });
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
            match &model {
                Some(model) => self.with(model, &mut after)?,
                None => self.until_first(&mut after)?,
            }
            if let Some(failure) = failure {
                return Err(failure);
            }
            model = next.or(model);
        }
        Ok(learner.record())
    }

    fn until_first(&mut self, after: &mut dyn FnMut(&[f64]) -> bool) -> Result<()> {
        let mut pd = Pd::new(self.config.gains.clone(), self.reference)?;
        while self.tick(&mut pd) {
            self.without += 1;
            if after(&self.row) {
                break;
            }
        }
        Ok(())
    }

    /// The learner beside the loop, the loop in real time.
    fn beside(&mut self, learner: OnlineLearner) -> Result<Record> {
        let mut thread = spawn(learner)?;
        let (period, clock) = (self.config.control.period(), Instant::now());
        let mut model: Option<Arc<Learned>> = None;
        let mut ticks = 0u32;
        while !self.is_over() {
            let mut after = |row: &[f64]| {
                thread.rows.push(row);
                ticks += 1;
                let due = Duration::from_secs_f64(f64::from(ticks) * period);
                std::thread::sleep(due.saturating_sub(clock.elapsed()));
                thread.models.news()
            };
            match &model {
                Some(model) => self.with(&**model, &mut after)?,
                None => self.until_first(&mut after)?,
            }
            model = thread.models.take().or(model);
        }
        thread.finish()
    }
}
