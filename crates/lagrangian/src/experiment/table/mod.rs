//! What a family of models can learn, property by property, each measured and none assumed.
//!
//! A [`Lesson`] is a known system in a chart with chunks of its motions to learn from and states to judge by; all
//! families get the same. The measurements ask a model for its motion and its energy alone.

mod lesson;
mod measure;
mod task;

pub use lesson::{Hidden, Lesson, Reads, Size};
pub use measure::{
    Drift, StepErrors, acceleration_error, call_seconds, energy_drift, flow_acceleration_error,
    step_errors,
};
pub use task::{SAMPLES, Task};
