//! Training: losses, optimisers, schedules, and `fit`.

mod adam;
mod allowed;
mod checkpoint;
mod choice;
mod clock;
mod engine;
mod fit;
mod forces;
mod forward;
mod learner;
mod loss;
mod natural;
mod network;
mod nominal;
mod observer;
mod order;
mod positions;
mod problem;
pub(crate) mod rollout;
mod run;
mod schedule;
mod selection;
mod settings;
mod stepper;
#[cfg(test)]
pub(crate) mod tests;

pub use crate::models::Parameter;
pub use crate::models::{Family, Learned};
pub use adam::AdamConfig;
pub use checkpoint::Checkpoint;
pub(crate) use choice::LOSS;
pub use choice::{Choice, Chosen, Known, Request};
pub use fit::{Budget, Fit, FitConfig, Optimizer, Precision, fit};
pub(crate) use forces::{FORCE_NAMES, Forces};
pub use forces::{ForceTerms, Input};
pub(crate) use learner::{At, Facts, Learner, MAX_DOF, Work};
pub use loss::{Loss, NamedLoss, Norm, Target, Weighting};
pub use natural::{DampingRule, Natural, NaturalConfig, Part, StepSize, System};
pub(crate) use nominal::remainder;
pub use observer::{Ending, Observer, Progress};
pub(crate) use positions::{CHORDS, Derivatives, PointFamily, PositionsLearner};
pub use problem::{
    Batch, Differentiable, GradientSize, LeastSquares, LossValue, ResidualSize, StepAt,
};
pub use rollout::{Observe, RolloutLoss, Start};
pub use schedule::cosine;
pub use selection::{Contestant, Selection, select};
pub use settings::{DampingName, OptimizerName, ROLLOUT_SETTINGS, SETTINGS, TrainingSettings};
pub use stepper::{StepLoss, Stepper};
