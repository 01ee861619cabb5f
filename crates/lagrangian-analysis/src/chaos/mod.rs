//! The limits of prediction: Lyapunov exponents, and valid prediction times in units of them.

mod lyapunov;
mod predictability;

pub use lyapunov::{Lyapunov, largest_lyapunov_exponent};
pub use predictability::{ValidTimes, lyapunov_times, restarted, valid_times};
