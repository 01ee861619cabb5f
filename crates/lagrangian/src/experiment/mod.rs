//! Measurements that models are compared by, as plain data; the command's experiments are made of them.

pub mod chains;
mod chunks;
mod expressible;
pub mod hamiltonian;
mod hermite;
mod history;
mod laws;
pub mod letters;
mod long_rollouts;
pub mod magnetic;
pub mod noisy;
pub mod premises;
pub mod relativistic;
pub mod table;
mod torque;
pub mod vin;
pub mod wave;

pub use chunks::{Cut, chunks, with_momenta};
pub use expressible::beyond_delan;
pub use hermite::{with_corrected_accelerations, with_estimated_accelerations};
pub use history::{History, Moment, fit_with_history};
pub use laws::{Laws, laws};
pub use long_rollouts::{
    EnergyTest, energy_error, energy_test, random_starts, random_states, restarted,
};
pub use torque::{TorqueError, TorqueParts, torque_error};
