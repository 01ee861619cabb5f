//! Gains of the feedback.

use serde::{Deserialize, Serialize};

use super::{Desired, Reference};
use lagrangian::{Error, Model, Result};

/// Gains of a proportional-derivative law: the force for a unit of error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// `K_p`, N·m/rad (N/m), `[n]`.
    pub kp: Vec<f64>,
    /// `K_d`, N·m·s/rad (N·s/m), `[n]`.
    pub kd: Vec<f64>,
}

/// Usual bandwidth of the feedback, rad/s: low, so that a model must do the work.
const BANDWIDTH: f64 = 5.0;
/// Acceleration by which an inertia is measured, rad/s² (m/s²).
const PUSH: f64 = 10.0;
/// Maximum number of samples of a reference over which inertias are averaged.
const INERTIA_SAMPLES: usize = 200;

impl Gains {
    /// Equal gains `kp` and `kd` for each of `n` coordinates.
    #[must_use]
    pub fn uniform(n: usize, kp: f64, kd: f64) -> Self {
        Self {
            kp: vec![kp; n],
            kd: vec![kd; n],
        }
    }

    /// The usual low gains for these inertias, critically damped at 5 rad/s.
    #[must_use]
    pub fn usual(inertia: &[f64]) -> Self {
        Self::critical(inertia, BANDWIDTH)
    }

    /// `K_p` = ω² m and `K_d` = 2 ω m for each inertia m, kg·m² (kg): critically damped at the bandwidth ω, rad/s.
    #[must_use]
    pub fn critical(inertia: &[f64], bandwidth: f64) -> Self {
        let each = |factor: f64| inertia.iter().map(|m| factor * m).collect();
        Self {
            kp: each(bandwidth * bandwidth),
            kd: each(2.0 * bandwidth),
        }
    }

    /// Converts gains of accelerations, s⁻² and s⁻¹, to gains of forces, for joints of these inertias.
    #[must_use]
    pub fn of_inertia(&self, inertia: &[f64]) -> Self {
        let scaled = |gains: &[f64]| gains.iter().zip(inertia).map(|(k, m)| k * m).collect();
        Self {
            kp: scaled(&self.kp),
            kd: scaled(&self.kd),
        }
    }

    /// These gains with `kp` and `kd` in their place where they are given: each not at all, one for all coordinates, or one for each.
    ///
    /// # Errors
    /// As [`Gains::validate`].
    pub fn replaced(mut self, kp: &[f64], kd: &[f64]) -> Result<Self> {
        let n = self.kp.len();
        for (own, given) in [(&mut self.kp, kp), (&mut self.kd, kd)] {
            match given {
                [] => {}
                [one] => own.fill(*one),
                _ => *own = given.to_vec(),
            }
        }
        self.validate(n).map(|()| self)
    }

    /// Checks that there are `n` of each gain, finite and not negative.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::Argument`].
    pub fn validate(&self, n: usize) -> Result<()> {
        for (name, list) in [("kp", &self.kp), ("kd", &self.kd)] {
            Error::check_shape(name, list.len(), n, "give one gain for each coordinate")?;
            if let Some(gain) = list
                .iter()
                .find(|gain| !(gain.is_finite() && **gain >= 0.0))
            {
                return Err(Error::argument(
                    name,
                    gain,
                    "finite, and 0 or above: a negative gain drives the robot away",
                ));
            }
        }
        Ok(())
    }

    /// Writes `K_p (q_d − q) + K_d (q̇_d − q̇)`.
    pub(crate) fn correction(&self, desired: &Desired, q: &[f64], qd: &[f64], out: &mut [f64]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = self.kp[i] * (desired.q[i] - q[i]) + self.kd[i] * (desired.qd[i] - qd[i]);
        }
    }
}

/// Inertia of each joint of `model` along a reference: the mean of `M_ii(q_d)`, kg·m² (kg), `[n]`.
///
/// # Errors
/// [`Error::Shape`] for a model of other degrees of freedom, [`Error::Argument`] for one without inverse dynamics.
pub fn inertia_along(model: &dyn Model, reference: &Reference) -> Result<Vec<f64>> {
    let n = reference.dof();
    same_dof(model, n)?;
    let samples = reference.samples();
    let step = samples.len().div_ceil(INERTIA_SAMPLES);
    let rows = || samples.q.chunks_exact(n).step_by(step);
    let mut evaluator = model.evaluator();
    // Beyond what dry friction holds, the slope of a torque over the acceleration is the inertia.
    let (rest, mut unit) = (vec![0.0; n], vec![0.0; n]);
    let (mut still, mut pushed) = (vec![0.0; n], vec![0.0; n]);
    let mut inertia = vec![0.0; n];
    for q in rows() {
        for i in 0..n {
            let mut push = |acceleration: f64, tau: &mut [f64]| {
                unit[i] = acceleration;
                let outcome = evaluator.inverse_dynamics(q, &rest, &unit, tau);
                unit[i] = 0.0;
                outcome
            };
            if !push(PUSH, &mut still).is_supported() {
                return Err(no_inverse());
            }
            let _ = push(2.0 * PUSH, &mut pushed);
            inertia[i] += (pushed[i] - still[i]) / PUSH / rows().len() as f64;
        }
    }
    Ok(inertia)
}

/// Largest torque of each coordinate, N·m (N), with which a model moves along the samples of a reference; a torque that is not
/// finite is omitted.
#[must_use]
pub fn largest_torques(model: &dyn Model, reference: &Reference) -> Vec<f64> {
    let (n, mut evaluator, mut desired) = (
        reference.dof(),
        model.evaluator(),
        Desired::new(reference.dof()),
    );
    let (mut tau, mut largest) = (vec![0.0; n], vec![0.0; n]);
    for &t in &reference.samples().t {
        reference.at(t, &mut desired);
        let outcome = evaluator.inverse_dynamics(&desired.q, &desired.qd, &desired.qdd, &mut tau);
        if outcome.is_finite() {
            let pairs = largest.iter_mut().zip(&tau);
            pairs.for_each(|(most, tau): (&mut f64, &f64)| *most = most.max(tau.abs()));
        }
    }
    largest
}

/// Checks that a model has `n` degrees of freedom.
pub(super) fn same_dof(model: &dyn Model, n: usize) -> Result<()> {
    let found = model.coordinates().dof();
    if found == n {
        return Ok(());
    }
    Err(Error::shape(
        "model",
        found,
        n,
        "give a reference and a model of the same coordinates",
    ))
}

/// Error for a model without inverse dynamics.
pub(super) fn no_inverse() -> Error {
    Error::argument(
        "model",
        "one without inverse dynamics",
        "a Lagrangian, or a plain network that was fitted to torques",
    )
}
