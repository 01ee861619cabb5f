//! Learns the mechanics of a physical system from its trajectories.

pub mod dynamics;
pub mod error;
pub mod lagrangian;
pub mod report;
pub mod trajectory;

pub use error::{Error, Result};
pub use trajectory::{Coordinate, Coordinates, Topology, Trajectory};
