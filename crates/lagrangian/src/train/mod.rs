//! Training: losses, optimisers, schedules, and `fit`.

mod adam;
mod batch;
mod checkpoint;
mod damping;
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

pub(crate) use adam::Adam;
pub use adam::AdamConfig;
pub use batch::Samples;
pub(crate) use batch::{Batches, Value, value};
pub use checkpoint::Checkpoint;
pub use damping::DampingRule;
pub use described::Parameter;
pub use fit::{Budget, Ending, Fit, FitConfig, Observer, Optimizer, Precision, Progress, fit};
pub(crate) use fit::{Order, cosine, grown};
pub use forces::{ForceTerms, Input};
pub use learned::{Family, Learned};
pub use learner::Loss;
pub(crate) use learner::{Learner, Work};
pub use natural::NaturalConfig;
pub(crate) use natural::{Natural, System};
pub use part::Part;
pub use rollout::{Gradients, Observe, RolloutLoss, Start};
pub use stepper::{StepLoss, Stepper};
