//! Eleven systems of which it is known whether a Lagrangian exists.

mod fields;
mod systems;

pub use fields::{Law, active_particle, curl_force, van_der_pol};
pub use systems::{System, noisy};
