//! Training: losses, optimisers, schedules, and `fit`.

mod adam;
mod allowed;
mod batch;
mod checkpoint;
mod damping;
mod delan;
mod descent;
mod described;
mod engine;
mod fit;
mod forces;
mod hnn;
mod learned;
mod learner;
mod lnn;
mod natural;
mod nominal;
mod observer;
mod order;
mod part;
mod plain;
mod positions;
mod rollout;
mod run;
mod schedule;
mod stepper;
#[cfg(test)]
mod tests;

pub use adam::AdamConfig;
pub use batch::Samples;
pub use checkpoint::Checkpoint;
pub use damping::DampingRule;
pub use described::Parameter;
pub use fit::{Budget, Fit, FitConfig, Optimizer, Precision, fit};
pub use forces::{ForceTerms, Input};
pub use learned::{Family, Learned};
pub use learner::Loss;
pub use natural::NaturalConfig;
pub(crate) use natural::System;
pub use observer::{Ending, Observer, Progress};
pub use part::Part;
pub use rollout::{Gradients, Observe, RolloutLoss, Start};
pub(crate) use schedule::cosine;
pub use stepper::{StepLoss, Stepper};
