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
mod following;
mod gains;
mod gravity_compensation;
mod latency;
mod lqr;
pub mod online;
mod pd;
mod reference;
mod sensors;
mod simulation;
mod swing_up;

pub use computed_torque::ComputedTorque;
pub use feed_forward::FeedForward;
pub use following::{Followed, Following, Law, follow};
pub use gains::{Gains, inertia_along};
pub use gravity_compensation::GravityCompensation;
pub use latency::{Latency, Quantiles};
pub use lqr::{Linearisation, Lqr};
pub use pd::Pd;
pub use reference::{Desired, Reference};
pub use sensors::{Sensors, VelocitySource};
pub use simulation::{Driven, Ending, LoopConfig, Simulation};
pub use swing_up::{Machine, SwingUp, SwingUpConfig};

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

#[cfg(test)]
mod tests;
