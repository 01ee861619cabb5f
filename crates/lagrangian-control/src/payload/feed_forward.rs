//! Feed-forward with a load that is estimated during the motion.

use super::PayloadEstimator;
use crate::{Controller, Desired, FeedForward};
use lagrangian::{Error, Result, State};

/// [`FeedForward`] with the torque of the load that an estimator finds meanwhile (theory.md, 59d).
///
/// For a short time after a change of the load, the acceleration of the reference is that of
/// [`ComputedTorque`](crate::ComputedTorque), so that the error of the unknown load does not depend on feedback of low gain.
///
/// ```
/// use lagrangian::rigid::{self, RigidBodies};
/// use lagrangian::{Signals, State, Trajectory};
/// use lagrangian_control::payload::{PayloadConfig, PayloadEstimator, PayloadFeedForward};
/// use lagrangian_control::{FeedForward, Gains, LoopConfig, Reference, Simulation};
///
/// let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap_or_default())?;
/// let loaded = arm.clone().with_payload("link_7", 2.0, [0.0, 0.0, 0.08])?;
///
/// // It is to hold still, and does not know what it has in its hand.
/// let q = vec![0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0];
/// let still = Signals { q: q.repeat(2), qd: vec![0.0; 14], ..Signals::default() };
/// let reference = Reference::new(Trajectory::new("still", vec![0.0, 1.0], still))?;
/// let (gains, control) = (Gains::uniform(7, 20.0, 2.0), LoopConfig::default());
///
/// let mut estimator = PayloadEstimator::new(&arm, "link_7", PayloadConfig::default())?;
/// let forward = FeedForward::new(&arm, &gains, &reference, control.lead())?;
/// let mut controller = PayloadFeedForward::new(forward, &mut estimator)?;
/// let mut simulation = Simulation::new(&loaded, &State::new(q, vec![0.0; 7]), control)?;
/// simulation.run(&mut controller, 0.5);
///
/// let mass = estimator.load().map_or(0.0, |load| load[0]);
/// assert!((mass - 2.0).abs() < 0.02);
/// # Ok::<(), lagrangian::Error>(())
/// ```
pub struct PayloadFeedForward<'f, 'a, 'e> {
    forward: FeedForward<'f>,
    estimator: &'e mut PayloadEstimator<'a>,
    desired: Desired,
    measured: State,
}

impl<'f, 'a, 'e> PayloadFeedForward<'f, 'a, 'e> {
    /// A feed-forward whose model is that of the robot alone, and the estimator of its load, which keeps its estimate.
    ///
    /// # Errors
    /// [`Error::Shape`] for an estimator of another number of joints.
    pub fn new(forward: FeedForward<'f>, estimator: &'e mut PayloadEstimator<'a>) -> Result<Self> {
        let (n, found) = (forward.dof(), estimator.dof());
        let remedy = "give the kinematics of the robot that follows the reference";
        Error::check_shape("joints of the estimator", found, n, remedy)?;
        Ok(Self {
            forward,
            estimator,
            desired: Desired::new(n),
            measured: State::new(vec![0.0; n], vec![0.0; n]),
        })
    }

    /// Sets the torque that acts until the next tick, `[n]`, if it differs from the output of the controller: after limits and
    /// delays.
    pub fn set_acting(&mut self, tau: &[f64]) {
        self.estimator.set_acting(tau);
    }

    /// Subtracts the torque of the load over the last tick from `tau`, `[n]`; a model of the robot alone can learn from the
    /// remainder.
    pub fn unload(&mut self, tau: &mut [f64]) {
        self.estimator.unload(tau);
    }

    /// Number of ticks at which the model was not finite, so that only feedback acted.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.forward.dropped()
    }

    fn set_acceleration(&mut self, t: f64) {
        let (kp, kd) = self.estimator.catch_up();
        let (desired, measured) = (&mut self.desired, &self.measured);
        self.forward.reference().at(t, desired);
        for (i, acceleration) in self.forward.acceleration.iter_mut().enumerate() {
            let (e, v) = (desired.q[i] - measured.q[i], desired.qd[i] - measured.qd[i]);
            let wanted = kp * e + kd * v;
            *acceleration = if wanted.is_finite() { wanted } else { 0.0 };
        }
    }
}

impl Controller for PayloadFeedForward<'_, '_, '_> {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self.measured.q.copy_from_slice(q);
        self.measured.qd.copy_from_slice(qd);
        let base = self.forward.evaluator();
        self.estimator.observe_acting(base, t, &self.measured);
        self.set_acceleration(t);
        self.forward.torque(t, q, qd, tau);
        self.forward.ahead(t, q, &mut self.desired);
        let Desired { q, qd, qdd } = &self.desired;
        self.estimator.add_torque(q, qd, qdd, tau);
        self.estimator.set_acting(tau);
    }
}
