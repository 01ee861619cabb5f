//! Small feed-forward networks with exact derivatives: the value, the gradient by the inputs, second derivatives along
//! chosen directions, and the gradient of all of them by the weights.
//!
//! # The problem
//!
//! If a network represents an energy or a Lagrangian, a loss contains its second derivatives, and training needs the
//! gradient of those. Nested automatic differentiation is slow for this. Here a block of samples is evaluated forward over the
//! truncated algebra {1, ε′, εᵢ, εᵢε′} with ε′² = εᵢεⱼ = 0,
//!
//! ```text
//! x = x₀ + x′ ε′ + Σᵢ xᵢ εᵢ + Σᵢ xᵢ′ εᵢε′ ,
//! ```
//!
//! and backward by ordinary back-propagation over the same algebra. One reverse pass gives second derivatives exactly,
//!
//! ```text
//! ∂²L/∂s∂t = Σ_layers Σ_units σ″(z) y_a z_s z_t ,
//! ```
//!
//! with y the sensitivity of the output to the activations a = σ(z), and `z_s`, `z_t` the tangents of the pre-activations.
//! The equations are numbered in `docs/theory.md`, sections 5 to 7; the code cites the numbers.
//!
//! # Notation
//!
//! | symbol | code | meaning | shape |
//! |---|---|---|---|
//! | x | [`Pass::set_feature`] | features, the inputs of a network, in any unit | `[samples, features]` |
//! | v | [`Pass::set_velocity`] | velocities that gates multiply | `[samples, velocities]` |
//! | x₀, x′, xᵢ, xᵢ′ | [`component`] | value, tangent ′, tangent i and mixed second derivative of x | |
//! | z, a = σ(z) | [`Layer`], [`Activation`] | pre-activations and activations of a layer | `[samples, width]` |
//! | W, b | [`Packed`] | weights `[width, width of the source]` and biases `[width]` of a layer | |
//! | θ | | all weights and biases, in double precision | `[parameters]` |
//! | y | | sensitivities: derivatives of the output by z or a | `[samples, width]` |
//! | S, J = ∂S/∂θ | [`Terms`] | raw outputs of a sample and their Jacobian, kept as factors | |
//!
//! Activations and sensitivities are stored in panels of 64 bytes: LANES columns (16 in single, 8 in double precision), with a
//! row for each component of each sample, so that no matrix product copies its factors.
//!
//! # Data flow
//!
//! ```text
//! Build ─► Net ──┐
//!                ├─► Pass (blocks of samples), Chain (one state) ─► value, gradient, second derivatives
//! θ ─► Packed ───┘                  │
//!         ▲                         ├─► Gradient ─► Moments (steps of Adam)
//!         └──────── new θ ──────────┴─► Factors ─► tiles of J Jᵀ; J φ and Jᵀ x
//! ```
//!
//! # Example
//!
//! The value, gradient and second derivatives of y = tanh(x₀ + 2 x₁).
//!
//! ```
//! use lagrangian_nets::component::{VALUE, tangent};
//! use lagrangian_nets::{Activation, Build, Packed, Pass, Source};
//!
//! let mut build = Build::new(2, 0);
//! let hidden = build.dense(1, &[Source::Features], Some(Activation::Tanh));
//! build.dense(1, &[hidden], None);
//! let net = build.finish();
//! let parameters = [1.0, 2.0, 0.0, 1.0, 0.0]; // W and b of the hidden layer, then of the output
//! let packed = Packed::<f64>::of(&net, &parameters)?;
//!
//! // One sample, with direction i along feature i.
//! let mut pass = Pass::new(&net, 1, 2);
//! for (i, x) in [0.3, -0.1].into_iter().enumerate() {
//!     pass.set_feature(VALUE, 0, i, x);
//!     pass.set_feature(tangent(i), 0, i, 1.0);
//! }
//! pass.forward(&net, &packed, Some(2));
//! pass.reverse(&net, &packed, 2);
//!
//! let y = 0.1_f64.tanh();
//! let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
//! assert!(close(pass.output(&net, VALUE, 0, 0), y));
//! assert!(close(pass.feature_gradient(0, 1), 2.0 * (1.0 - y * y)));
//! let mixed = pass.second_derivative(0, 1, Some(0), 2); // ∂²y/∂x₁∂x₀
//! assert!(close(mixed, -4.0 * y * (1.0 - y * y)));
//! # Ok::<(), lagrangian_nets::Error>(())
//! ```

#![deny(unsafe_code)]

mod activation;
mod chain;
pub mod component;
mod error;
mod factors;
mod gram;
mod instant;
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
pub use instant::Instant;
pub use moments::Moments;
pub use net::{Build, Input, Kind, Layer, Net, Source, Weighted, normal};
pub use packed::{Gradient, Packed};
pub use pass::Pass;
