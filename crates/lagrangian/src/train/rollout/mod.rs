//! The rollout loss: k steps of an integrator from a recorded state compared with the recording, for every family whose
//! rates a network gives (theory.md, section 23).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | x = (q, q̇), of Hamiltonian networks (q, p) | state | 2n |
//! | f, F = ∂f/∂x | flow and its slope | 2n, 2n × 2n |
//! | Φ | one step of the method | |
//! | y | recorded states | 2n |
//! | w | weights of the coordinates of x | 2n |
//! | s | state that a segment starts from | 2n |
//! | λ | ∂loss/∂x along the segment | 2n |
//!
//! xⱼ₊₁ = Φ(xⱼ; θ), x₀ = s, rⱼ = w (xⱼ − yⱼ), angles on the circle. Every evaluation of f leaves its slope and the
//! factors of its own Jacobian; the chain between them is small algebra, so that both the gradient (backwards through
//! the steps) and J Jᵀ of whole segments follow from them.

mod config;
mod descend;
pub(crate) mod flow;
mod gauss_newton;
mod gradient;
mod kernel;
mod leapfrog;
pub(crate) mod linear;
mod midpoint;
mod newton;
pub(crate) mod rk4;
mod segments;
mod shoot;
pub(crate) mod step;
#[cfg(test)]
pub(crate) mod tests;
mod unit;

pub use config::{Observe, RolloutLoss, Start};
pub(crate) use descend::{RolloutDescent, RolloutProblems, RolloutValidation, SegmentOrder};
pub(crate) use segments::Recorded;
