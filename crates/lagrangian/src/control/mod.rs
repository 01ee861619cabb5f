//! Control: functions (t, q, q̇) → τ, and the robot that they drive.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q_d`, `q̇_d`, `q̈_d` | the motion that is wanted, a [`Reference`] |
//! | e = `q_d` − q | tracking error |
//! | `K_p`, `K_d` | [`Gains`], diagonal |
//! | M̂, ĉ | mass matrix and bias of the model that the controller has, which need not be those of the robot |
//!
//! A controller allocates nothing once it is warm: every one may run at a kilohertz (theory.md, equations 50 to 59).

mod computed_torque;
mod feed_forward;
mod gravity_compensation;
mod latency;
mod lqr;
mod pd;
mod reference;
mod sensors;
mod simulation;
mod swing_up;

pub use computed_torque::ComputedTorque;
pub use feed_forward::FeedForward;
pub use gravity_compensation::GravityCompensation;
pub use latency::{Latency, Quantiles};
pub use lqr::{Linearisation, Lqr};
pub use pd::Pd;
pub use reference::{Desired, Reference};
pub use sensors::{Sensors, VelocitySource};
pub use simulation::{Driven, Ending, LoopConfig, Simulation};
pub use swing_up::{Machine, SwingUp, SwingUpConfig};

use crate::{Error, Result};

/// Decides the torques of a robot from what its sensors say.
pub trait Controller {
    /// Writes τ for time `t` and the measured state (q, q̇); all arrays are `[n]`, SI units.
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]);
}

impl<F: FnMut(f64, &[f64], &[f64], &mut [f64])> Controller for F {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self(t, q, qd, tau);
    }
}

/// Gains of a proportional-derivative law: the forces for a unit of error.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gains {
    /// `K_p`, N·m/rad (N/m), `[n]`.
    pub kp: Vec<f64>,
    /// `K_d`, N·m·s/rad (N·s/m), `[n]`.
    pub kd: Vec<f64>,
}

impl Gains {
    /// The same two gains for each of `n` coordinates.
    #[must_use]
    pub fn uniform(n: usize, kp: f64, kd: f64) -> Self {
        Self {
            kp: vec![kp; n],
            kd: vec![kd; n],
        }
    }

    /// Checks that there are `n` of each, finite and not negative.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::Argument`].
    pub fn validate(&self, n: usize) -> Result<()> {
        for (name, list) in [("kp", &self.kp), ("kd", &self.kd)] {
            if list.len() != n {
                return Err(Error::Shape {
                    what: name.into(),
                    found: list.len(),
                    expected: n,
                    remedy: "give one gain for each coordinate".into(),
                });
            }
            if let Some(gain) = list
                .iter()
                .find(|gain| !(gain.is_finite() && **gain >= 0.0))
            {
                return Err(Error::Argument {
                    name,
                    value: gain.to_string(),
                    must: "finite, and 0 or above: a negative gain drives the robot away",
                });
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

#[cfg(test)]
mod tests;
