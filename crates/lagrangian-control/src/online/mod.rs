//! Online learning: a model that is trained while the robot moves.
//!
//! ```text
//! control loop ──(q, q̇, τ)──► rows ──► [`Differentiator`] ──► [`Replay`] ──► steps ──► guard ──► newest ──► control loop
//! ```
//!
//! The loop neither waits nor locks: it writes into a queue that drops the oldest row, and takes the newest
//! model. [`OnlineLearner`] does the rest: on a separate thread ([`spawn`]), or in lock step with the motion, with a
//! fixed number of steps a second, if a run must be repeatable (theory.md, equations 50 to 59).

mod config;
mod differentiator;
mod guard;
mod learner;
mod record;
mod regression;
mod replay;
mod rows;
mod thread;
mod tracking;
mod watch;

pub use config::{ChangeConfig, Falling, OnlineConfig};
pub use differentiator::{Differentiator, Sample};
pub use guard::Guard;
pub use learner::OnlineLearner;
pub use record::{Event, EventKind, Record};
pub use replay::{Replay, ReplayConfig};
pub use thread::{OnlineThread, spawn};
pub use tracking::{FeedForwardSource, PayloadSource, Tracked, TrackingConfig, track};

#[cfg(test)]
mod tests;
