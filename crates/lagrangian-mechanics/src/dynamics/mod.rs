//! The Euler–Lagrange equation, written once: M q̈ + c = τ − d(q, q̇) (theory.md, equations 4 to 8).
//!
//! From d/dt ∂L/∂q̇ − ∂L/∂q = τ − d with p = ∂L/∂q̇: M = ∂²L/∂q̇∂q̇ and c = (∂p/∂q) q̇ − ∂L/∂q. Along every motion
//! the energy H = p·q̇ − L changes by the power of the forces, dH/dt = (τ − d)·q̇.
//!
//! A [`Model`] answers at two levels, and both report one outcome, [`Evaluation`]. An [`Evaluator`] is for loops: it
//! writes to memory of the caller, allocates nothing once warm, and does not check the lengths of its arrays.
//! [`Quantities`] are for single questions: they check the lengths, return new arrays, and return an error for a quantity
//! that does not exist.
//!
//! ```
//! use lagrangian_mechanics::analytic::by_name;
//! use lagrangian_mechanics::{Dissipation, Evaluation, Mechanical, Model, Quantities};
//!
//! let pendulum = by_name("pendulum", &[("length", 2.0)])?;
//! let damped = Mechanical::dissipative(pendulum.lagrangian(), Dissipation::viscous(vec![0.4]))?;
//! // q̈ = −b q̇ / (m l²) at the bottom.
//! let acceleration = damped.forward_dynamics(&[0.0], &[3.0], &[0.0])?;
//! assert!((acceleration[0] + 0.3).abs() < 1e-15);
//!
//! let (mut evaluator, mut acceleration) = (damped.evaluator(), [0.0]);
//! let outcome = evaluator.forward_dynamics(&[0.0], &[3.0], &[0.0], &mut acceleration);
//! assert!(outcome == Evaluation::Regular && (acceleration[0] + 0.3).abs() < 1e-15);
//! # Ok::<(), lagrangian_motion::Error>(())
//! ```

mod balance;
mod equation;
mod euler_lagrange;
mod evaluator;
mod forced;
mod mechanical;
mod quantities;

use crate::Visited;
use crate::rollout::Rollout;
use lagrangian_motion::{Coordinates, Result, Trajectory};

pub use balance::Balance;
pub use equation::{bias, energy, forward, inverse, momenta};
pub use euler_lagrange::{EulerLagrange, Slopes};
pub use evaluator::{Evaluation, Evaluator, PhaseFlow};
pub(crate) use forced::Forced;
pub use mechanical::Mechanical;
pub use quantities::Quantities;

/// Anything that predicts motion: a Lagrangian or a Hamiltonian with its forces, or a plain network.
pub trait Model: Send + Sync {
    /// The coordinates of its state.
    fn coordinates(&self) -> &Coordinates;

    /// Whether the model has forward dynamics, so that it can be rolled out: all but a plain network of torques.
    fn moves(&self) -> bool {
        true
    }

    /// An evaluator of the model with its own scratch memory; one for each thread.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;

    /// Lagrangian with friction and inputs, for methods that need more than accelerations; `None` for a model
    /// without one.
    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        None
    }

    /// Nominal model that it was built on, and must not be worse than.
    fn nominal(&self) -> Option<&dyn Model> {
        None
    }

    /// Drives of a model that moves by commanded goals; `None` for a model that moves by forces.
    fn driven(&self) -> Option<&dyn Driven> {
        None
    }

    /// What integrates its motion.
    fn integration(&self) -> Integration<'_> {
        Integration::Plain
    }

    /// States that the data of the fit visited, where they are known.
    fn visited(&self) -> Option<&Visited> {
        None
    }
}

/// What integrates the motion of a model.
#[derive(Clone, Copy)]
#[allow(
    missing_debug_implementations,
    reason = "trait objects have nothing to show"
)]
pub enum Integration<'a> {
    /// Any method, from its forward dynamics.
    Plain,
    /// Any method, which returns to the states that keep the constraints of the model after each step.
    Projected(&'a dyn Projection),
    /// The model itself.
    Own(&'a dyn Plant),
}

impl<'a> Integration<'a> {
    /// The projection to states that keep constraints.
    #[must_use]
    pub fn projection(self) -> Option<&'a dyn Projection> {
        match self {
            Self::Projected(projection) => Some(projection),
            _ => None,
        }
    }

    /// The model as a plant that integrates itself.
    #[must_use]
    pub fn plant(self) -> Option<&'a dyn Plant> {
        match self {
            Self::Own(plant) => Some(plant),
            _ => None,
        }
    }
}

/// The nearest states that keep the constraints of a model between its coordinates, see [`crate::Constrained`].
pub trait Projection: Sync {
    /// Moves a state (q, q̇), `[2 n]`, to the nearest one that keeps the constraints; not finite where there is none.
    fn project(&self, state: &mut [f64]);
}

impl std::fmt::Debug for dyn Projection + '_ {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Projection")
    }
}

/// A model that integrates its own motion, as a simulator does.
pub trait Plant: Sync {
    /// Moves a state (q, q̇), `[2 n]`, for some seconds under constant τ; NaN where the motion is lost.
    fn advance(&self, state: &mut [f64], tau: &[f64], seconds: f64);
}

/// A model whose drives follow commanded goals.
pub trait Driven {
    /// Simulates a recording from its first state, by its goals alone, at its times.
    ///
    /// # Errors
    /// As [`Trajectory::validate`]; [`lagrangian_motion::Error::Shape`] for another number of coordinates, [`lagrangian_motion::Error::Setting`] where
    /// the recording has no goals.
    fn follow(&self, recording: &Trajectory) -> Result<Rollout>;
}
