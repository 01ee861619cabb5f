//! Learns the mechanics of a physical system from its trajectories.

pub mod error;
pub mod saved;
pub mod trajectory;
pub mod lagrangian;
pub mod dynamics;

pub use error::{Error, Result};
pub use trajectory::{Coordinate, Coordinates, Topology, Trajectory};
