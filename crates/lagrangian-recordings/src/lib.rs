//! Recordings of motions: file formats, estimates of signals that were not measured, and checks of the
//! quality of the data.
//!
//! ```text
//! file ─► Format ─► Layout ─► Recording ─► Estimate ─► Trajectory
//!                                 └──► check ─► findings
//! ```

#![forbid(unsafe_code)]

pub mod check;
mod columns;
pub mod constraints;
mod contents;
pub mod csv;
mod delay;
pub mod derivatives;
mod dialect;
mod drive;
mod encoding;
mod even;
mod format;
mod layout;
pub mod local_polynomial;
pub mod low_pass;
#[cfg(not(target_family = "wasm"))]
mod matrices;
#[cfg(not(target_family = "wasm"))]
mod npy;
#[cfg(not(target_family = "wasm"))]
mod npz;
mod polar;
mod programs;
mod recording;
mod rows;
mod sample;
#[cfg(not(target_family = "wasm"))]
mod shared;
mod si;
mod simulated;
mod spline;
mod stamps;
mod stops;
mod table;
mod unit;
pub mod window;

pub use columns::{Columns, Renamed};
pub use derivatives::{Estimate, EstimateOptions, Source, are_smooth};
pub use drive::{Constant, DriveLayout};
pub use format::{Format, PackageFormat};
pub use layout::Layout;
pub use local_polynomial::longest_piece;
pub use polar::Polar;
pub use recording::{Readings, Recording};
pub use sample::{Sampled, Sampling, TimeStep, thin};
pub use simulated::{Links, Simulated};
pub use stops::{Stop, between_stops, stops};
pub use table::Table;
