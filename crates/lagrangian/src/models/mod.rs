//! Families of models: everything of a family stands in its folder, and one row of [`FAMILIES`] registers it.
//!
//! | file of a family | what it holds |
//! |---|---|
//! | `mod.rs` | its configuration and the model itself |
//! | `family.rs` | what it can be fitted to, how it is prepared for training, how it is saved |
//! | `learner.rs` | its residuals and their derivatives |

pub mod delan;
mod family;
pub mod features;
pub mod hnn;
mod learned;
pub mod lnn;
pub mod mlp;
mod named;
pub mod neural_ode;
pub mod rigid;
mod settings;
mod setup;
pub mod vin;

pub use family::{Abilities, Entry, Family, Plan, Solution, Solve, Training};
pub(crate) use family::{Residuals, Trainable};
pub use hnn::Momenta;
pub(crate) use learned::WEIGHTS;
pub use learned::{Description, FittedForces, FittedModel, Learned, LearnedLagrangian, Stored};
pub use lnn::LnnConfig;
pub use named::Parameter;

/// All families, in the order in which they are offered.
pub const FAMILIES: &[Entry] = &[
    lnn::family::ENTRY,
    delan::family::ENTRY,
    vin::ENTRY,
    hnn::family::ENTRY,
    mlp::family::ENTRY,
    neural_ode::family::ENTRY,
    rigid::ENTRY,
    features::family::ENTRY,
];
