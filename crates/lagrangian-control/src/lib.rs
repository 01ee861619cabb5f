//! Controllers for robots through the models of [`lagrangian`], a simulated control loop to try them in, and models
//! that are learned while a robot moves.
//!
//! # The problem
//!
//! A robot is to follow a motion `q_d(t)`. Feedback alone lags behind it, because it acts only after an error has
//! arisen. A model of the robot predicts the torque that the motion needs, M̂ `q̈_d` + ĉ, and feedback corrects the errors of
//! the model.
//!
//! # Notation
//!
//! | symbol | meaning |
//! |---|---|
//! | `q_d`, `q̇_d`, `q̈_d` | the desired motion, a [`Reference`] |
//! | e = `q_d` − q | tracking error |
//! | `K_p`, `K_d` | [`Gains`], diagonal |
//! | M̂, ĉ | mass matrix and bias of the controller's model, which may differ from those of the robot |
//!
//! The numbers of equations refer to `docs/theory.md` (50 to 59d). Arrays are `[n]` in SI units. No controller allocates
//! memory after its first tick, so each of them can run at a kilohertz.
//!
//! # The data flow
//!
//! ```text
//!               Reference ──► Controller ──► limits, delays ──► robot (a Model) ──► sensors ─┐
//!                                ▲   ▲                                                      │
//!          online: new models ───┘   └──────────────────────────────────────────────────────┘
//! ```
//!
//! [`follow`] runs this loop from the first sample of a reference to its last. [`Simulation`] runs it tick by tick.
//! [`online`] learns a model from the measurements of the loop while it runs; [`payload`] estimates the load of the robot.
//!
//! # Following a motion with the torque that a model predicts
//!
//! ```
//! use lagrangian::{RolloutOptions, rollout};
//! use lagrangian::rollout::{sines, times};
//! use lagrangian_control::{ControlLaw, Gains, LoopConfig, Reference, follow};
//!
//! // A motion that the arm can make, as samples of q and q̇.
//! let arm = lagrangian::analytic::by_name("two-link-arm", &[])?;
//! let drive = sines(2, 1.0, 0);
//! let motion = rollout(&*arm, &[0.3, 0.5], &[0.0; 2], &times(2.0, 0.01)?, &drive, &RolloutOptions::default())?;
//! let reference = Reference::new(motion.trajectory)?;
//!
//! let gains = Gains::uniform(2, 20.0, 2.0);
//! let config = LoopConfig::default();
//! let feedback = follow(&*arm, None, &reference, ControlLaw::Feedback(&gains), &config)?;
//! let model = follow(&*arm, None, &reference, ControlLaw::FeedForward(&*arm, &gains), &config)?;
//! for (with, without) in model.following.rmse.iter().zip(&feedback.following.rmse) {
//!     assert!(with < &(0.1 * without));
//! }
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod computed_torque;
mod feed_forward;
mod following;
mod gains;
mod gravity_compensation;
mod latency;
mod loop_config;
pub mod online;
pub mod payload;
mod pd;
mod reference;
mod sensors;
mod simulated;
mod simulation;

pub use computed_torque::ComputedTorque;
pub use feed_forward::FeedForward;
pub use following::{ControlLaw, Followed, Following, follow};
pub use gains::{Gains, inertia_along, largest_torques};
pub use gravity_compensation::GravityCompensation;
pub use latency::{Latency, LatencyBin, Quantiles};
pub use loop_config::LoopConfig;
pub use pd::Pd;
pub use reference::{Desired, Reference};
pub use sensors::{Sensors, VelocitySource};
pub use simulated::{Driven, LoopOutcome};
pub use simulation::{RobotChange, Simulation};

/// Computes the torques of a robot from the measured state.
pub trait Controller {
    /// Writes τ for time `t` and the measured state (q, q̇); all arrays are `[n]`, SI units.
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]);
}

impl<F: FnMut(f64, &[f64], &[f64], &mut [f64])> Controller for F {
    fn torque(&mut self, t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self(t, q, qd, tau);
    }
}

#[cfg(test)]
mod tests;
