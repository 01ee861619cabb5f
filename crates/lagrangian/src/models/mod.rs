//! Families of models: all code of a family is in its folder, and one row of [`FAMILIES`] registers it.
//!
//! | file of a family | content |
//! |---|---|
//! | `mod.rs` | its configuration and the model itself |
//! | `family.rs` | its losses and data, its preparation for training, its saved form |
//! | `learner.rs` | its residuals and their derivatives |

pub(crate) mod cartesian;
pub(crate) mod chain;
pub(crate) mod correlation;
pub(crate) mod delan;
mod family;
pub(crate) mod formula;
pub(crate) mod hnn;
pub(crate) mod lattice;
mod learned;
pub(crate) mod lnn;
pub(crate) mod mlp;
mod named;
mod network;
pub(crate) mod neural_ode;
pub(crate) mod passes;
pub(crate) mod rigid;
pub(crate) mod servo;
pub(crate) mod settings;
mod setup;
#[cfg(test)]
mod tests;
pub(crate) mod vin;
mod weights;

pub use crate::dataset::Momenta;
pub use cartesian::{CartesianConfig, PointTerm, Points, Radial, RadialLaw};
pub use chain::ChainConfig;
pub(crate) use chain::joints;
pub use delan::{Delan, DelanConfig, Inertia, Trunks};
pub(crate) use family::Residuals;
pub use family::{
    Abilities, Candidate, Configuration, Entry, Family, Plan, Solution, Solve, Training,
};
pub(crate) use formula::{Drift, contradiction, drifts};
pub use formula::{Evidence, Formula, FormulaConfig, LawVerdict, Term};
pub use hnn::{Hnn, HnnConfig, HnnStructure};
pub use lattice::{LatticeConfig, LatticeEnds};
pub use learned::{
    Description, FittedModel, Learned, LearnedLagrangian, Linkage, ModelParts, Stored, WrittenLaw,
};
pub use lnn::{Form, Lnn, LnnConfig};
pub use mlp::{Direction, Mlp, MlpConfig, MlpScaling};
pub use named::Parameter;
pub use network::{Network, NetworkShape, Parts};
pub use neural_ode::{NeuralOdeConfig, Order};
pub use rigid::chain::{Identified, Rigid, identify};
pub use rigid::robot::{IdentifiedRobot, Recursive};
pub use rigid::{Angles, RigidChain, RigidConfig};
pub use servo::{Friction, Servo, ServoConfig};

/// All families, in the order in which they are offered.
pub const FAMILIES: &[Entry] = &[
    lnn::family::ENTRY,
    delan::family::ENTRY,
    vin::ENTRY,
    hnn::family::ENTRY,
    mlp::family::ENTRY,
    neural_ode::ENTRY,
    rigid::ENTRY,
    chain::family::ENTRY,
    servo::family::ENTRY,
    formula::family::ENTRY,
    cartesian::family::ENTRY,
    lattice::family::ENTRY,
];
