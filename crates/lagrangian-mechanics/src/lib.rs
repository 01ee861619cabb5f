//! Mechanics: systems, forces and equations of motion, from Lagrangians to rollouts.
//!
//! | folder | equation |
//! |---|---|
//! | `lagrangian` | the trait of L(q, q̇) and its derivatives, scaled Lagrangians and sums of them |
//! | `analytic` | known Lagrangians, a system in a file |
//! | `forces` | friction d(q̇), smooth or as a set, and the map from inputs to forces |
//! | `dynamics` | the Euler–Lagrange equation M q̈ + c = τ − d, written once, and quantities of single states |
//! | `constrained` | models that keep relations between their coordinates |
//! | `lattice` | many sites that obey one law with their neighbours |
//! | `hamiltonian` | the trait of H(q, p), Hamilton's equations, the Legendre transform in both directions |
//! | `expression`, `rigid`, `integrate`, `rollout` | the equations as expressions, rigid bodies, integrators, predicted motions |

#![forbid(unsafe_code)]

pub mod analytic;
pub mod constrained;
pub mod dynamics;
pub mod expression;
pub mod forces;
pub mod hamiltonian;
pub mod integrate;
pub mod lagrangian;
pub mod lattice;
pub mod rigid;
pub mod rollout;
mod visited;

pub use constrained::Constrained;
pub use dynamics::{
    Balance, Driven, EulerLagrange, Evaluation, Evaluator, Integration, Mechanical, Model,
    PhaseFlow, Plant, Projection, Quantities, Slopes, bias, energy, forward, inverse, momenta,
};
pub use forces::{
    Actuation, Applied, Command, Directional, Dissipation, Drive, DrySolver, GearFriction, Load,
    Scalar, Sensitive, Stribeck,
};
pub use hamiltonian::{
    Canonical, Hamiltonian, HamiltonianJet, HamiltonianJets, HamiltonianOf, LagrangianOf,
};
pub use integrate::Method;
pub use lagrangian::{Curvature, Jet, Jets, Lagrangian, Scaling, SpeedChart, Sum};
pub use lagrangian_motion::solve::{
    Regularity, SymmetricSolver, diagonalise, dot, inverse_root, product,
};
pub use rigid::RobotConfig;
pub use rollout::{Outcome, Rollout, RolloutOptions, rollout};
pub use visited::{Axis, Beyond, Visited};
