//! Forces beside a Lagrangian or a Hamiltonian: friction d(q̇), and the map from inputs to forces.

mod actuation;
mod dissipation;

pub use actuation::Actuation;
pub use dissipation::{Dissipation, Stribeck};
