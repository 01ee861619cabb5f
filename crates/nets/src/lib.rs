//! Networks and their derivatives: parameters, activations, initialisation, and the batched kernels.
//!
//! A network is a short list of layers (`Net`). A `Pass` carries a block of samples through it: forward over
//! the truncated algebra {1, ′, i, i′} (theory.md, section 5), backward as ordinary back-propagation over the same
//! algebra. From these come, without a nested tape, the value, the gradient, second derivatives along the
//! directions that are wanted, and the gradient of all of them by the weights.

#![deny(unsafe_code)]

mod activation;
mod chain;
mod error;
mod factors;
mod gram;
mod moments;
mod net;
mod oracle;
mod packed;
mod pass;
pub mod simd;
#[cfg(test)]
mod tests;

pub use activation::Activation;
pub use chain::Chain;
pub use error::{Error, Result};
pub use factors::Terms;
pub use gram::{Factors, TileScratch};
pub use moments::Moments;
pub use net::{Build, Kind, Layer, Net, Source, normal};
pub use packed::{Gradient, Packed};
pub use pass::Pass;
