//! Mechanics: what moves, and by which equations. Nothing here knows a network, an integrator or a file.
//!
//! | module | equation |
//! |---|---|
//! | [`lagrangian`] | the trait of L(q, q̇) and its derivatives, scaled Lagrangians and sums of them |
//! | [`analytic`] | known Lagrangians, a system in a file |
//! | [`forces`] | friction d(q̇), and the map from inputs to forces |
//! | [`dynamics`] | the Euler–Lagrange equation M q̈ + c = τ − d, written once, and what it says of single states |
//! | [`hamiltonian`] | the trait of H(q, p), Hamilton's equations, the Legendre transform in both directions |
//! | [`solve`] | M x = b for the small systems of a state |

pub mod analytic;
pub mod dynamics;
pub mod forces;
pub mod hamiltonian;
pub mod lagrangian;
pub mod solve;
