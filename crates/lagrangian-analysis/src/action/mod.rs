//! The action of paths, the stationary paths between two ends, and their classification as minima.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | N, h | segments of a path, h = T/N | |
//! | qₖ | nodes of the path, k = 0 … N; the ends q(0) and q(T) are fixed | `[N + 1, n]` |
//! | Lᵈ(q, q′) | h L((q + q′)/2, (q′ − q)/h), the midpoint discrete Lagrangian, of second order | |
//! | S | Σ Lᵈ(qₖ, qₖ₊₁) | |
//! | H | ∂²S/∂q∂q over the inner nodes, block tridiagonal | `[(N − 1) n]²` |
//!
//! Hamilton's principle: a motion makes S stationary among all paths with its ends, but not always least: beyond a
//! conjugate point some neighbouring paths have less action, and the dimension of their space is the Morse index (theory.md,
//! equations 73 to 77).
//!
//! ```
//! use lagrangian_analysis::action::{Boundary, SearchOptions, PathKind, stationary_paths};
//! use lagrangian::analytic::by_name;
//!
//! let oscillator = by_name("mass-spring", &[])?; // m = k = 1
//! let ends = Boundary::new(oscillator.coordinates(), &[1.0], &[0.0], 1.0)?;
//! let search = stationary_paths(oscillator.lagrangian(), &ends, &SearchOptions::default())?;
//! let path = &search.paths[0];
//! let closed_form = 0.5 * (1.0_f64).cos() / (1.0_f64).sin();
//! assert!((path.action - closed_form).abs() < 1e-5 && path.kind == PathKind::Minimum);
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod boundary;
mod discrete;
mod guess;
mod newton;
mod search;
mod second_variation;
mod stationary;
mod tridiagonal;

pub use boundary::Boundary;
pub use discrete::{DiscreteAction, Path};
pub use search::{Failure, Search, SearchOptions, stationary_path_from, stationary_paths};
pub use second_variation::SecondVariation;
pub use stationary::{PathKind, StationaryPath};

#[cfg(test)]
mod tests;
