//! How long a motion can be predicted at all: Lyapunov exponents, and valid prediction times in units of them.

mod lyapunov;
mod predictability;

pub use lyapunov::{Lyapunov, Motion, largest_lyapunov_exponent};
pub use predictability::{Predictability, ValidTimes, predictability, restarted, valid_times};
