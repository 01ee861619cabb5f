//! A payload that is estimated while the robot carries it.
//!
//! Of a robot with a load in its hand ten numbers are unknown: mass, first and second moments of the load. They enter the
//! torque linearly, whatever the model of the robot itself is, so that recursive least squares finds what matters of them in
//! hundredths of a second (theory.md, 59a to 59d).
//!
//! | file | what it does |
//! |---|---|
//! | `config.rs` | the settings |
//! | `filtered.rs` | what the model leaves of the torques, and the regressor of a load, through the same low-pass |
//! | `estimator.rs` | the load from these, and when it changes |
//! | `feed_forward.rs` | the controller that carries it |

mod config;
mod estimator;
mod feed_forward;
mod filtered;

pub use config::PayloadConfig;
pub use estimator::PayloadEstimator;
pub use feed_forward::PayloadFeedForward;

#[cfg(test)]
mod tests;
