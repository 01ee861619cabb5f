//! Training: losses, optimisers, schedules, and the one loop.

pub mod adam;
pub mod checkpoint;
mod clock;
mod engine;
pub mod forces;
pub mod known;
mod learner;
pub mod loss;
pub mod natural;
pub mod network;
pub mod nominal;
pub mod observer;
mod order;
mod positions;
pub mod problem;
pub(crate) mod rollout;
pub mod run;
mod schedule;
mod shape;
pub(crate) mod shooting;
pub mod spec;
pub(crate) mod task;
#[cfg(test)]
pub(crate) mod tests;

pub use adam::{AdamConfig, Precision};
pub use checkpoint::Checkpoint;
pub(crate) use forces::{FORCE_NAMES, Forces};
pub use forces::{ForceTerms, Input};
pub use known::DataFacts;
pub(crate) use learner::{At, Learner, LearnerShape, MAX_DOF, Work};
pub use loss::{Loss, NamedLoss, Norm, Target, Weighting};
pub use natural::{DampingRule, Natural, NaturalConfig, Part, StepSize, System};
pub(crate) use nominal::remainder;
pub(crate) use observer::SharedObserver;
pub use observer::{Ending, Observer, Progress};
pub(crate) use positions::{CHORDS, Derivatives, PointFamily, PositionsLearner};
pub use problem::{
    Batch, Differentiable, GradientSize, LeastSquares, LossValue, ResidualSize, StepAt,
};
pub use rollout::{Observe, RolloutLoss, Start};
pub use schedule::cosine;
pub use shape::{NetworkShape, Parts};
pub use shooting::Shooting;
pub(crate) use spec::LOSS;
pub use spec::{AutoSetting, FitSpec};
pub use task::{Budget, Optimizer, TrainingTask};
