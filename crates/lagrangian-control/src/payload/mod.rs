//! A payload that is estimated while the robot carries it.
//!
//! A load in the hand of a robot has ten unknown numbers: mass, first and second moments. They enter the torque
//! linearly, whatever the model of the robot itself, so that recursive least squares finds the relevant ones in
//! hundredths of a second (theory.md, 59a to 59d).
//!
//! | file | content |
//! |---|---|
//! | `config.rs` | the settings |
//! | `filtered.rs` | residual torques of the model and regressor of a load, through equal low-passes |
//! | `estimator.rs` | the load from these, and the detection of changes |
//! | `feed_forward.rs` | the controller that carries the load |

mod config;
mod estimator;
mod feed_forward;
mod filtered;

pub use config::PayloadConfig;
pub use estimator::PayloadEstimator;
pub use feed_forward::PayloadFeedForward;

#[cfg(test)]
mod tests;
