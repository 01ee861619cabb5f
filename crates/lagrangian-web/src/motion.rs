//! Motions of systems and models, in the form that the page draws.

use lagrangian::integrate::Method;
use lagrangian::mechanics::Dissipation;
use lagrangian::rollout::{Outcome, Rollout, RolloutOptions, times, with_friction};
use lagrangian::{Model, rollout};
use lagrangian_run::energies;
use serde::{Deserialize, Serialize};

use crate::error::{Result, bounded};
use crate::limits;
use crate::request::By;
use crate::system::{Axis, Named, axes};

/// A requested motion.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Prediction {
    /// The system or model that moves.
    pub(crate) by: By,
    /// The coordinates at the start, `[n]`.
    pub(crate) q0: Vec<f64>,
    /// The velocities at the start, `[n]`.
    pub(crate) qd0: Vec<f64>,
    /// The duration, s.
    pub(crate) duration: f64,
    /// The time between two samples, s.
    #[serde(default = "sixtieth")]
    pub(crate) interval: f64,
    /// The coefficient of viscous friction of each coordinate.
    #[serde(default)]
    pub(crate) friction: f64,
    /// The system whose energy is shown, if it differs from the one that moves.
    #[serde(default)]
    pub(crate) energy_of: Option<Named>,
}

fn sixtieth() -> f64 {
    1.0 / 60.0
}

/// A motion.
#[derive(Debug, Serialize)]
pub(crate) struct Motion {
    /// The coordinates.
    coordinates: Vec<Axis>,
    /// Times, s.
    t: Vec<f64>,
    /// q, `[len, n]`.
    q: Vec<f64>,
    /// q̇, `[len, n]`.
    qd: Vec<f64>,
    /// H, J; empty for a model without one.
    energy: Vec<f64>,
    /// ∫ L dt from the start, J s; empty for a model without a Lagrangian.
    action: Vec<f64>,
    /// The time and reason of an early end, if there was one.
    ended: Option<String>,
}

/// Options that are fast, and accurate enough that errors of the integrator are invisible.
pub(crate) fn options() -> RolloutOptions {
    RolloutOptions {
        method: Method::Dopri5,
        rtol: 1e-9,
        atol: 1e-9,
        max_steps: limits::INTEGRATED,
        ..RolloutOptions::default()
    }
}

impl Prediction {
    /// The motion of `model`; the energy is that of the model `energy`, or its own.
    pub(crate) fn of(&self, model: &dyn Model, energy: Option<&dyn Model>) -> Result<Motion> {
        let samples = self.duration / self.interval;
        let remedy = "ask for a shorter duration or a longer interval";
        bounded(
            "the number of samples",
            samples,
            limits::PREDICTED as f64,
            remedy,
        )?;
        let times = times(self.duration, self.interval)?;
        let n = model.coordinates().dof();
        let none = lagrangian::rollout::sines(n, 0.0, 0);
        let friction = Dissipation::viscous(vec![self.friction; n]);
        let force = with_friction(&none, &friction);
        let rollout = rollout(model, &self.q0, &self.qd0, &times, &force, &options())?;
        Ok(Motion::new(model, energy.unwrap_or(model), rollout))
    }
}

impl Motion {
    fn new(model: &dyn Model, energetic: &dyn Model, rollout: Rollout) -> Self {
        let ended = ended(&rollout.outcome);
        let trajectory = rollout.trajectory;
        let (q, qd) = (&trajectory.q, &trajectory.qd);
        let mut values = vec![0.0; trajectory.len()];
        if !model
            .evaluator()
            .lagrangian(q, qd, &mut values)
            .is_supported()
        {
            values.clear();
        }
        Self {
            coordinates: axes(model.coordinates()),
            action: integral(&trajectory.t, &values),
            energy: energies(energetic, &trajectory).unwrap_or_default(),
            ended,
            q: trajectory.signals.q,
            qd: trajectory.signals.qd,
            t: trajectory.t,
        }
    }
}

/// The integral of values from the first time to each, by the trapezium rule.
fn integral(t: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let pairs = t.windows(2).zip(values.windows(2));
    let rest = pairs.map(|(t, v)| {
        sum += 0.5 * (t[1] - t[0]) * (v[0] + v[1]);
        sum
    });
    let first = values.first().map(|_| 0.0);
    first.into_iter().chain(rest).collect()
}

fn ended(outcome: &Outcome) -> Option<String> {
    match outcome {
        Outcome::Finished => None,
        Outcome::Diverged { t, .. } => Some(format!(
            "the motion has no finite continuation after {t:.3} s: begin from another state"
        )),
        Outcome::StepLimit { t } | Outcome::Stopped { t } => Some(format!(
            "the motion needs too many steps after {t:.3} s: begin from another state"
        )),
    }
}
