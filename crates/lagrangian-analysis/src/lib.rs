//! Analysis of a known or learned Lagrangian beyond its motions.
//!
//! # The problem
//!
//! A learned Lagrangian that predicts well can also be analysed: the paths that make its action stationary, the
//! quantities that it conserves, the time for which its motions can be predicted. A question before learning is
//! whether the recorded motions have a Lagrangian.
//!
//! | module | question | answer |
//! |---|---|---|
//! | [`action`] | which paths between two ends make the action stationary, and are they minima? | [`stationary_paths`](action::stationary_paths), with Morse index and conjugate points |
//! | [`conserved`](mod@conserved) | which symmetries does L have, and what do they conserve? | [`conserved`](conserved::conserved()): charges and their drift |
//! | [`chaos`] | how long can a motion be predicted? | [`largest_lyapunov_exponent`](chaos::largest_lyapunov_exponent), [`valid_times`](chaos::valid_times) |
//! | [`existence`] | do recorded motions have a Lagrangian at all? | [`survey`](existence::survey()): a verdict with its reasons |
//!
//! # Notation
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | q, q̇, τ | coordinates, velocities, applied forces | `[n]` |
//! | L, H, p, M | Lagrangian, energy, momentum, mass matrix, as in [`lagrangian`] | |
//! | S = ∫ L dt | action of a path | J·s |
//! | ξ(q) = A q + b | direction of a symmetry | `[n]` |
//! | f(q, q̇, τ) | accelerations of a model | `[n]` |
//!
//! The numbers of equations refer to `docs/theory.md`.
//!
//! # The data flow
//!
//! ```text
//! trajectories ──► existence ──► is a Lagrangian worth learning?
//!      │
//!      └─► lagrangian::fit ──► model ──► action · conserved · chaos
//! ```
//!
//! # What a planet conserves
//!
//! ```
//! use lagrangian::{RolloutOptions, rollout};
//! use lagrangian::mechanics::Applied;
//! use lagrangian::rollout::{free, times};
//! use lagrangian_analysis::conserved::{ConservedOptions, Physics, candidates, conserved};
//!
//! let planet = lagrangian::analytic::by_name("kepler", &[])?;
//! let orbit = rollout(&*planet, &[1.0, 0.0], &[0.0, 1.2], &times(10.0, 0.05)?, &free, &RolloutOptions::default())?;
//! // The two coordinates are those of one point in the plane.
//! let symmetries = candidates(planet.coordinates(), &[vec![0, 1]])?;
//! let physics = Physics { model: &*planet, lagrangian: planet.lagrangian(), applied: Applied::default() };
//! let found = conserved(&physics, &symmetries, &[orbit.trajectory], &ConservedOptions::default())?;
//! let conserved: Vec<&str> = found.quantities.iter().filter(|q| q.symmetric).map(|q| q.name.as_str()).collect();
//! assert_eq!(conserved, ["energy", "angular momentum"]);
//! # Ok::<(), lagrangian::Error>(())
//! ```

pub mod action;
pub mod chaos;
pub mod conserved;
pub mod existence;
