//! Forces beside a Lagrangian or a Hamiltonian: friction d(q̇), friction of gears, drives, and the map from inputs to forces.

mod actuation;
mod applied;
mod dissipation;
mod drive;
mod dry;
mod gear;
mod scalar;

pub use actuation::Actuation;
pub use applied::Applied;
pub use dissipation::{Directional, Dissipation, Stribeck};
pub use drive::{Command, Drive};
pub use dry::DrySolver;
pub use gear::{GearFriction, Load};
pub use scalar::{Scalar, Sensitive};
