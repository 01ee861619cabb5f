//! Learns the mechanics of a physical system from its trajectories.

pub mod baseline;
pub mod chaos;
pub mod check;
pub mod dataset;
pub mod dynamics;
pub mod error;
pub mod experiment;
pub mod identify;
pub mod integrate;
pub mod lagrangian;
pub mod mlp;
pub mod report;
pub mod rollout;
pub mod saved;
pub mod score;
pub mod solve;
pub mod train;
pub mod trajectory;

pub use error::{Error, Result};
pub use trajectory::{Coordinate, Coordinates, State, Topology, Trajectory};
