//! Training: losses, optimisers, schedules, and `fit`.

mod adam;
mod batch;
mod checkpoint;
mod delan;
mod descent;
mod described;
mod fit;
mod forces;
mod hnn;
mod learned;
mod learner;
mod lnn;
mod natural;
mod nominal;
mod part;
mod plain;
mod positions;
mod rollout;
mod stepper;
#[cfg(test)]
mod tests;

pub use adam::AdamConfig;
pub use batch::Samples;
pub use checkpoint::Checkpoint;
pub use described::Parameter;
pub use fit::{Budget, Ending, Fit, FitConfig, Observer, Optimizer, Precision, Progress, fit};
pub use forces::{ForceTerms, Input};
pub use learned::{Family, Learned};
pub use learner::Loss;
pub use natural::NaturalConfig;
pub(crate) use natural::System;
pub use part::Part;
pub use rollout::{Gradients, Observe, RolloutLoss, Start};
pub use stepper::{StepLoss, Stepper};
