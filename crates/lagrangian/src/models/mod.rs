//! Families of models: everything of a family stands in its folder.

pub mod delan;
pub mod hnn;
mod learned;
pub mod lnn;
pub mod mlp;
pub mod neural_ode;
pub mod rigid_chain;
pub mod robot;

pub(crate) use learned::Template;
pub use learned::{Family, Learned};
