//! Comparisons of papers that can be repeated, measured through the public interface of `lagrangian`.
//!
//! An experiment is a folder: what is measured, who is compared, and what was published. [`main`] gives each the same
//! seeds, budgets, grid of results and page.
//!
//! ```text
//! cargo run --release -p experiments -- list
//! cargo run --release -p experiments -- letters --seeds 3
//! ```

mod action;
mod alarms;
mod chains;
mod chart;
mod data;
mod driver;
mod ensembles;
mod estimator;
mod families;
mod features;
mod hamiltonian;
mod harness;
mod is_lagrangian;
mod laws;
pub mod letters;
mod magnetic;
mod mistakes;
mod noisy;
mod plausibility;
mod real;
mod relativistic;
mod robots;
mod servo;
mod swing_up;
mod table;
mod tracking;
mod vin;
mod wave;

pub use harness::main;
