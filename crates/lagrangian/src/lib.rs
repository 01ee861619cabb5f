//! Learns the mechanics of a physical system from its trajectories: data in, a Lagrangian out; then long stable
//! rollouts, conserved energy and inverse dynamics from it.
//!
//! # The problem
//!
//! A network that is fitted to accelerations predicts the next instant well and the next minute badly: nothing in it
//! represents energy. Here the network is the Lagrangian L(q, q̇) itself, one scalar function, and the motion follows
//! from it by the Euler–Lagrange equation,
//!
//! ```text
//! d/dt ∂L/∂q̇ − ∂L/∂q = τ − d ,     that is     M q̈ + c = τ − d .
//! ```
//!
//! Whatever the weights, the energy H = p·q̇ − L then changes only by the power of the forces, dH/dt = (τ − d)·q̇.
//!
//! # Notation
//!
//! One word for a thing, in code, on the command line and in files. Arrays are row-major, `[m, n]` for m states of n
//! degrees of freedom, in SI units; angles are unwrapped.
//!
//! | code | symbol | meaning | shape |
//! |---|---|---|---|
//! | `q`, `qd`, `qdd` | q, q̇, q̈ | generalised coordinates, velocities, accelerations | `[n]` |
//! | `tau` | τ | generalised forces: applied, not conservative | `[n]` |
//! | [`mechanics::Dissipation`] | d(q̇) | friction, viscous and smooth Coulomb | `[n]` |
//! | `p`, `momentum` | p = ∂L/∂q̇ | momentum | `[n]` |
//! | `mass_matrix` | M = ∂²L/∂q̇∂q̇ | | `[n, n]` |
//! | `bias` | c = (∂p/∂q) q̇ − ∂L/∂q | Coriolis, centrifugal and conservative forces | `[n]` |
//! | `energy` | H = p·q̇ − L | J | |
//! | `rollout` | | a predicted trajectory | |
//!
//! The equations are numbered in `docs/theory.md`; the code cites the numbers.
//!
//! # Data flow
//!
//! ```text
//! files ─► Trajectory ─► Dataset ─► fit(Family, Loss, Optimizer) ─► saved model ─► rollout · energy · torque ─► report
//!              ▲                                                                      │
//!              └────────────────── a rollout is a Trajectory too ────────────────────┘
//! ```
//!
//! [`Format::read`] reads files, [`check()`] examines them, [`Dataset`] divides and scales them, [`fit()`] trains a model
//! of a family ([`models`]), [`SavedModel`] stores it, [`rollout()`] predicts and [`score()`] compares. Test data come from an
//! analytic Lagrangian ([`analytic`]) that is rolled out: there is no separate simulator. The names that most programs
//! need are at the root of the library; each module holds the rest of its subject.
//!
//! # From motions to a Lagrangian
//!
//! ```
//! use lagrangian::rollout::{energy_error, free, times};
//! use lagrangian::{Budget, Dataset, FitConfig, LnnConfig, RolloutOptions, TrainingTask};
//! use lagrangian::{analytic, fit, rollout, split};
//!
//! // Ten motions of a pendulum; recordings come from files instead (`Format::read`).
//! let pendulum = analytic::by_name("pendulum", &[("length", 0.5)])?;
//! let options = RolloutOptions::default();
//! let mut motions = Vec::new();
//! for k in 0..10 {
//!     let (q0, qd0) = ([0.3 * f64::from(k)], [f64::from(k)]);
//!     motions.push(rollout(&*pendulum, &q0, &qd0, &times(4.0, 0.02)?, &free, &options)?.trajectory);
//! }
//! let (train, validation) = split(motions, 0.2, 0)?;
//! let data = Dataset::new(pendulum.coordinates().clone(), &train, &validation)?;
//!
//! // A Lagrangian, learned from them.
//! let network = LnnConfig { width: 16, ..LnnConfig::default() };
//! let task = TrainingTask { budget: Budget::Steps(200), batch: 64, ..TrainingTask::default() };
//! let config = FitConfig::new(network, task);
//! let learned = fit(&data, &config, None, &mut ())?.model;
//!
//! // A hundred seconds of its motion keep the true energy, from a start that it has not seen.
//! let motion = rollout(&learned, &[2.0], &[0.0], &times(100.0, 0.1)?, &free, &options)?;
//! let scale = 2.0 * 9.8 * 0.5; // J, from the lowest to the highest point
//! let error = energy_error(&*pendulum, &motion.trajectory, scale);
//! assert!(motion.outcome.is_finished() && error.iter().all(|percent| percent.abs() < 0.1));
//! # Ok::<(), lagrangian::Error>(())
//! ```

#![forbid(unsafe_code)]

pub mod dataset;
mod distil;
pub mod ensemble;
pub mod fit;
pub mod models;
pub mod prepared;
pub mod saved;
pub mod score;
pub mod torque;
pub mod train;

/// Motions in memory and in files.
pub mod trajectory {
    pub use lagrangian_mechanics::{Axis, Beyond, Visited};
    pub use lagrangian_motion::{
        Constraint, Coordinate, Coordinates, Samples, Signal, Signals, State, Topology, Trajectory,
    };
    pub use lagrangian_recordings::{
        Columns, Constant, DriveLayout, Estimate, EstimateOptions, Format, Layout, Links,
        PackageFormat, Polar, Readings, Recording, Renamed, Sampled, Sampling, Simulated, Source,
        Table, TimeStep, csv, derivatives, longest_piece, stops, thin,
    };
}

/// Robots: trees of rigid bodies, their excitation and their identification.
pub mod rigid {
    pub use crate::models::rigid::robot::{
        Identification, IdentifiedRobot, IdentifyOptions, identify,
    };
    pub use lagrangian_mechanics::rigid::{
        Changes, EXAMPLES, Excitation, ExcitationConfig, GRAVITY, JointKind, JointLimits, LinkLoad,
        LoadParameters, LoadPrior, LoadSums, MAX_JOINTS, PartChange, Quantity, RigidBodies,
        RigidDynamics, RobotConfig, SearchProgress, Skeleton, example, excite, excite_joints,
        is_body,
    };
}

/// Mechanics: Lagrangians, Hamiltonians, forces, and the equations of motion.
pub mod mechanics {
    pub use lagrangian_mechanics::{
        Actuation, Applied, Balance, Canonical, Command, Constrained, Curvature, Directional,
        Dissipation, Drive, Driven, DrySolver, EulerLagrange, Evaluation, Evaluator, GearFriction,
        Hamiltonian, HamiltonianJet, HamiltonianJets, HamiltonianOf, Integration, Jet, Jets,
        Lagrangian, LagrangianOf, Load, Mechanical, Model, Outcome, PhaseFlow, Plant, Projection,
        Quantities, Regularity, Scalar, Scaling, Sensitive, Slopes, SpeedChart, Stribeck, Sum,
        SymmetricSolver, analytic, bias, diagonalise, dot, energy, forward, inverse, inverse_root,
        lattice, momenta, product,
    };
}

/// The check of recordings before a fit.
pub mod check {
    pub use lagrangian_recordings::check::{
        CHECKED, CheckOptions, CheckReport, Claim, IMPACTS, Item, ShownItem, Verdict, check,
        check_validation,
    };
}

/// Constraints between coordinates, found in positions.
pub mod constraints {
    pub use lagrangian_motion::Constraint;
    pub use lagrangian_recordings::constraints::{
        Found, Kind, Point, Structure, find, find_between, find_in,
    };
}

/// Words for people, without what a terminal or a page would obey.
pub mod text {
    pub use lagrangian_motion::{brief, counted, is_hidden, shown, shown_json, shown_lines};
}

pub use check::{CheckOptions, CheckReport, Verdict, check};
pub use dataset::{Dataset, PrepareOptions, split};
pub use distil::{Distilled, distil};
pub use fit::{Fit, FitConfig, fit};
pub use lagrangian_mechanics::{
    Evaluator, Model, Rollout, RolloutOptions, analytic, expression, integrate, rollout,
};
pub use lagrangian_motion::{
    Coordinates, Error, Result, Signals, State, Stop, Trajectory, settings,
};
pub use lagrangian_recordings::{Estimate, EstimateOptions, Format, Layout, Recording};
pub use models::{DelanConfig, Learned, LnnConfig};
pub use prepared::Prepared;
pub use saved::{Provenance, SavedModel};
pub use score::{Score, score};
pub use train::{Budget, Checkpoint, FitSpec, Loss, Observer, Optimizer, Progress, TrainingTask};

/// A check that the program of the page compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/rust.md")]
struct Page;
