//! Motions of a mechanical system, with the types that all other crates of `lagrangian` share.
//!
//! | module | holds |
//! |---|---|
//! | [`Trajectory`] | time stamps with the [`Signals`] q, q̇, q̈, τ, p, ṗ at them |
//! | [`Coordinates`] | the names of the coordinates, and which are angles, lengths or parameters |
//! | [`Constraint`] | a relation between coordinates that a motion keeps |
//! | [`Samples`] | states with their accelerations and forces, apart from time |
//! | [`solve`] | M x = b for the small systems of a state |
//! | [`settings`] | settings as data: names, meaning, values |
//! | [`Error`] | the errors of all crates |
//!
//! This crate contains no files, forces, integrators or networks.

#![forbid(unsafe_code)]

mod constraint;
mod coordinates;
pub mod error;
pub mod noise;
pub mod parallel;
mod samples;
pub mod settings;
mod shown;
mod signals;
pub mod solve;
mod state;
pub mod statistics;
mod stop;
mod trajectory;

pub use constraint::Constraint;
pub use coordinates::{Coordinate, Coordinates, Topology};
pub use error::{Error, Result, brief, counted};
pub use samples::Samples;
pub use shown::{is_hidden, shown, shown_json, shown_lines};
pub use signals::{Signal, Signals};
pub use state::State;
pub use stop::Stop;
pub use trajectory::Trajectory;
