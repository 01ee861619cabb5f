//! Feedback together with the torque that a model predicts along the reference.

use super::gains::{no_inverse, same_dof};
use super::{Controller, Desired, Gains, Pd, Reference};
use lagrangian::mechanics::Evaluation;
use lagrangian::{Evaluator, Model, Result};

/// The farthest, rad (m), that the model is evaluated from the measured position.
const LEASH: f64 = 0.1;

/// τ = `M̂(q_ℓ) q̈_d + ĉ(q_ℓ, q̇_d) + K_p (q_d − q) + K_d (q̇_d − q̇)`, theory.md (51), with `q_ℓ` = `q_d` within 0.1 rad (m) of q.
///
/// While the robot follows, the inverse dynamics are those of the reference: sensor noise never enters the model. A robot that
/// was carried off is held by a leash: farther than 0.1 rad (m) from the measured position the model is evaluated at that distance,
/// since the gravity at the reference, where the robot is not, can hold it away against feedback of low gain. At ticks where the
/// model is not finite, only feedback acts, and [`FeedForward::dropped`] counts them.
pub struct FeedForward<'a> {
    pd: Pd<'a>,
    evaluator: Box<dyn Evaluator + 'a>,
    lead: f64,
    correction: Vec<f64>,
    /// Correction that is added to the acceleration of the reference.
    pub(crate) acceleration: Vec<f64>,
    dropped: u64,
}

impl<'a> FeedForward<'a> {
    /// A controller with these gains and this model along this reference. `lead`, s, is the mean time from the
    /// measurement to the action of its torque: half a tick, and the delay of the drive.
    ///
    /// # Errors
    /// As [`Gains::validate`]; [`lagrangian::Error::Shape`] for a model of other degrees of freedom, [`lagrangian::Error::Argument`] for one
    /// without inverse dynamics.
    pub fn new(
        model: &'a dyn Model,
        gains: &Gains,
        reference: &'a Reference,
        lead: f64,
    ) -> Result<Self> {
        let (n, pd) = (reference.dof(), Pd::new(gains.clone(), reference)?);
        same_dof(model, n)?;
        let mut new = Self {
            pd,
            evaluator: model.evaluator(),
            lead,
            correction: vec![0.0; n],
            acceleration: vec![0.0; n],
            dropped: 0,
        };
        // Warms up the evaluator, so that the first tick allocates nothing.
        let mut tau = vec![0.0; n];
        let start = &reference.samples().q[..n];
        let outcome = new.feed_forward(reference.start(), start, &mut tau);
        if outcome.is_supported() {
            return Ok(new);
        }
        Err(no_inverse())
    }

    /// Number of ticks at which the model was not finite, so that only feedback acted.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Degrees of freedom.
    pub(crate) fn dof(&self) -> usize {
        self.correction.len()
    }

    /// Reference of the motion.
    pub(crate) fn reference(&self) -> &'a Reference {
        self.pd.reference
    }

    /// Evaluator of the model at any state.
    pub(crate) fn evaluator(&mut self) -> &mut (dyn Evaluator + 'a) {
        &mut *self.evaluator
    }

    /// Writes the motion whose torque is that of a tick at `t`: the reference at the time of its action, on the leash of the measured
    /// `q`, with the correction of its acceleration.
    pub(crate) fn ahead(&self, t: f64, q: &[f64], desired: &mut Desired) {
        self.pd.reference.at(t + self.lead, desired);
        let pairs = desired.q.iter_mut().zip(q);
        pairs.for_each(|(wanted, q)| *wanted = wanted.max(q - LEASH).min(q + LEASH));
        let added = desired.qdd.iter_mut().zip(&self.acceleration);
        added.for_each(|(a, x)| *a += x);
    }

    fn feed_forward(&mut self, t: f64, measured: &[f64], tau: &mut [f64]) -> Evaluation {
        let mut desired = std::mem::take(&mut self.pd.desired);
        self.ahead(t, measured, &mut desired);
        let Desired { q, qd, qdd } = &desired;
        let outcome = self.evaluator.inverse_dynamics(q, qd, qdd, tau);
        self.pd.desired = desired;
        outcome
    }
}

impl Controller for FeedForward<'_> {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        if !self.feed_forward(t, q, tau).is_finite() {
            tau.fill(0.0);
            self.dropped += 1;
        }
        self.pd.torque(t, q, qd, &mut self.correction);
        let pairs = tau.iter_mut().zip(&self.correction);
        pairs.for_each(|(tau, x)| *tau += x);
    }
}
