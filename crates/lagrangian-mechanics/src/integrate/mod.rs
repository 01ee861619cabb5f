//! Integrators: one method per file, each using only the function that it integrates.
//!
//! Five roles. A first-order method solves x' = f(t, x) ([`Rk4`], [`Dopri5`], [`Dop853`]); a second-order one
//! solves q'' = f(t, q, q') and treats positions and velocities differently ([`StormerVerlet`],
//! [`ImplicitMidpoint`]); a partitioned one does so for a flow in (q, z) with any q', such as Hamilton's equations
//! ([`GeneralisedLeapfrog`], [`Midpoint`]: the same two methods where q' = z). A fourth role uses the Lagrangian, and
//! discretises its action ([`Variational`]). A fifth uses mass matrix, forces and friction separately, and treats dry friction as a set of
//! forces ([`Moreau`]). Methods with a fixed step make one step at a time and [`fixed`] drives
//! them; methods that choose their step are an [`EmbeddedPair`] that [`adaptive`] drives. Nothing allocates per step,
//! and every loop is bounded by [`Control::max_steps`].

pub mod adaptive;
mod dop853;
mod dop853_coefficients;
mod dopri5;
pub mod fixed;
mod fixed_point;
mod generalised_leapfrog;
mod implicit_midpoint;
mod midpoint;
pub mod moreau;
mod rk4;
mod stormer_verlet;
mod variational;

pub use adaptive::EmbeddedPair;
pub use dop853::Dop853;
pub use dopri5::Dopri5;
pub use generalised_leapfrog::GeneralisedLeapfrog;
pub use implicit_midpoint::ImplicitMidpoint;
pub use midpoint::Midpoint;
pub use moreau::{Frictional, Moreau};
pub use rk4::Rk4;
pub use stormer_verlet::StormerVerlet;
pub use variational::{Mechanics, Rule, Variational};

use serde::{Deserialize, Serialize};

use crate::dynamics::Projection;
use lagrangian_motion::settings::{Named, named};
use lagrangian_motion::{Error, Result, Stop};

/// The right-hand side of x' = f(t, x): (t, x, x').
pub type FirstOrder<'a> = dyn FnMut(f64, &[f64], &mut [f64]) + 'a;

/// The right-hand side of q'' = f(t, q, q'): (t, q, q', q'').
pub type SecondOrder<'a> = dyn FnMut(f64, &[f64], &[f64], &mut [f64]) + 'a;

/// The right-hand side of (q, z)' = f(t, q, z): (t, q, z, q', z').
pub type Flow<'a> = dyn FnMut(f64, &[f64], &[f64], &mut [f64], &mut [f64]) + 'a;

/// Receives the solution: (index of the sample time, state at that time).
pub type Sink<'a> = dyn FnMut(usize, &[f64]) + 'a;

/// The outcome of a step; an error is the reason why the solution cannot be continued.
pub type Stepped = std::result::Result<(), Failure>;

/// A solution to be computed: the initial state, the times and the accuracy.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// The state at the first of the times.
    pub x0: &'a [f64],
    /// The times of the samples, increasing.
    pub times: &'a [f64],
    /// Accuracy and maximum cost.
    pub control: &'a Control,
    /// Projection of the state after each step; `None` where the motion has no constraints to keep.
    pub projection: Option<&'a dyn Projection>,
}

impl<'a> Span<'a> {
    /// The span of these.
    #[must_use]
    pub fn new(x0: &'a [f64], times: &'a [f64], control: &'a Control) -> Self {
        Self {
            x0,
            times,
            control,
            projection: None,
        }
    }

    /// The span with a projection of the state after each step.
    #[must_use]
    pub fn keeping(self, projection: Option<&'a dyn Projection>) -> Self {
        Self { projection, ..self }
    }
}

/// An integration method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// See [`Rk4`].
    Rk4,
    /// See [`Dopri5`].
    Dopri5,
    /// See [`Dop853`].
    #[default]
    Dop853,
    /// See [`StormerVerlet`].
    StormerVerlet,
    /// See [`ImplicitMidpoint`].
    ImplicitMidpoint,
    /// See [`Variational`], by the midpoint rule.
    VariationalMidpoint,
    /// See [`Variational`], by the trapezoidal rule.
    VariationalTrapezoidal,
    /// See [`Moreau`].
    Moreau,
}

impl Method {
    /// All methods with their names.
    pub const TABLE: [(Self, Named); 8] = [
        (
            Self::Dop853,
            named("dop853", "Dormand–Prince 8(5,3), adaptive"),
        ),
        (
            Self::Dopri5,
            named("dopri5", "Dormand–Prince 5(4), adaptive"),
        ),
        (
            Self::Rk4,
            named("rk4", "The classical Runge–Kutta method, fixed step"),
        ),
        (
            Self::StormerVerlet,
            named("stormer-verlet", "Störmer–Verlet, symplectic, fixed step"),
        ),
        (
            Self::ImplicitMidpoint,
            named(
                "implicit-midpoint",
                "Implicit midpoint, symplectic, fixed step",
            ),
        ),
        (
            Self::VariationalMidpoint,
            named(
                "variational-midpoint",
                "Discrete action by the midpoint rule, symplectic for every Lagrangian, fixed step",
            ),
        ),
        (
            Self::VariationalTrapezoidal,
            named(
                "variational-trapezoidal",
                "The same by the trapezoidal rule: Störmer–Verlet where M is constant",
            ),
        ),
        (
            Self::Moreau,
            named(
                "moreau",
                "Moreau's time stepping: dry friction that holds exactly, for models with a mass matrix, fixed step",
            ),
        ),
    ];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        let line = Self::TABLE.iter().find(|(method, _)| *method == self);
        line.map_or("", |(_, named)| named.name)
    }

    /// Rule of a variational method, which needs a Lagrangian: [`Rule::solve`] instead of
    /// [`Method::solve`].
    #[must_use]
    pub fn rule(self) -> Option<Rule> {
        match self {
            Self::VariationalMidpoint => Some(Rule::Midpoint),
            Self::VariationalTrapezoidal => Some(Rule::Trapezoidal),
            _ => None,
        }
    }

    /// Order of convergence of the solution.
    #[must_use]
    pub fn order(self) -> u32 {
        match self {
            Self::Rk4 => 4,
            Self::Dopri5 => 5,
            Self::Dop853 => 8,
            Self::StormerVerlet
            | Self::ImplicitMidpoint
            | Self::VariationalMidpoint
            | Self::VariationalTrapezoidal
            | Self::Moreau => 2,
        }
    }

    /// Solves q'' = f(t, q, q') from x₀ = (q, q') and passes (q, q') at every one of the times to `sink`. A variational method, which needs a Lagrangian, and [`Moreau`], which needs a
    /// mass matrix, fail at the first step.
    pub fn solve(self, f: &mut SecondOrder<'_>, span: Span<'_>, sink: &mut Sink<'_>) -> Solution {
        let n = span.x0.len() / 2;
        let mut first_order = |t: f64, x: &[f64], dx: &mut [f64]| {
            let ((q, qd), (dq, dqd)) = (x.split_at(n), dx.split_at_mut(n));
            dq.copy_from_slice(qd);
            f(t, q, qd, dqd);
        };
        match self {
            Self::StormerVerlet => {
                let mut method = StormerVerlet::new(n);
                fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
            }
            Self::ImplicitMidpoint => {
                let mut method = ImplicitMidpoint::new(n);
                fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
            }
            _ => self.solve_first_order(&mut first_order, span, sink),
        }
    }

    /// Solves (q, z)' = f(t, q, z) from x₀ = (q, z) and passes (q, z) at every one of the times to `sink`; [`Method::solve`] is faster where q' = z. A variational method fails at the first step.
    pub fn solve_flow(self, f: &mut Flow<'_>, span: Span<'_>, sink: &mut Sink<'_>) -> Solution {
        let n = span.x0.len() / 2;
        let mut first_order = |t: f64, x: &[f64], dx: &mut [f64]| {
            let ((q, z), (dq, dz)) = (x.split_at(n), dx.split_at_mut(n));
            f(t, q, z, dq, dz);
        };
        match self {
            Self::StormerVerlet => {
                let mut method = GeneralisedLeapfrog::new(n);
                fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
            }
            _ => self.solve_first_order(&mut first_order, span, sink),
        }
    }

    /// Solves x' = f(t, x) by the methods for any flow; the others fail at the first step.
    fn solve_first_order(
        self,
        f: &mut FirstOrder<'_>,
        span: Span<'_>,
        sink: &mut Sink<'_>,
    ) -> Solution {
        match self {
            Self::Dopri5 => adaptive::solve::<Dopri5>(f, span, sink),
            Self::Dop853 => adaptive::solve::<Dop853>(f, span, sink),
            Self::Rk4 => {
                let mut method = Rk4::new(span.x0.len());
                fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
            }
            Self::ImplicitMidpoint => {
                let mut method = Midpoint::new(span.x0.len());
                fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
            }
            Self::StormerVerlet
            | Self::VariationalMidpoint
            | Self::VariationalTrapezoidal
            | Self::Moreau => {
                let fail = |_, _, _: &mut [f64]| Err(Failure::NotConverged);
                fixed::solve(fail, span, sink)
            }
        }
    }
}

impl Rule {
    /// Solves the discrete Euler–Lagrange equation of `f` from x₀ = (q, q') and passes (q, q') at every one of the times to
    /// `sink`.
    pub fn solve(self, f: &mut Mechanics<'_>, span: Span<'_>, sink: &mut Sink<'_>) -> Solution {
        let mut method = Variational::new(span.x0.len() / 2, self);
        fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
    }
}

impl std::str::FromStr for Method {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let line = Self::TABLE.iter().find(|(_, known)| known.name == name);
        line.map(|(method, _)| *method)
            .ok_or_else(|| Error::UnknownName {
                kind: "integration method",
                name: name.into(),
                known: Self::TABLE.map(|(_, named)| named.name).join(", "),
            })
    }
}

/// Accuracy and maximum cost of a solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Longest step of the methods with a fixed step, s; each sample time is met exactly.
    pub step: f64,
    /// Relative tolerance on the error of one step, for the adaptive methods.
    pub rtol: f64,
    /// Absolute tolerance on the error of one step, in the units of each component.
    pub atol: f64,
    /// Maximum number of attempted steps.
    pub max_steps: u64,
    /// Ends the solution before its next step.
    pub stop: Stop,
}

impl Control {
    /// Checks that steps and tolerances are positive and finite.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first value that is not.
    pub fn validate(&self) -> Result<()> {
        let positive = [
            ("step", self.step),
            ("rtol", self.rtol),
            ("atol", self.atol),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::argument(name, value, "a finite number above 0"));
            }
        }
        match self.max_steps {
            0 => Err(Error::argument("max_steps", 0, "at least 1")),
            _ => Ok(()),
        }
    }
}

/// Ending and cost of an integration; the samples before its end have been passed to the sink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Ending of the integration.
    pub ending: Ending,
    /// Number of accepted steps.
    pub steps: u64,
    /// Number of steps rejected by the error estimate.
    pub rejected: u64,
}

/// Ending of an integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ending {
    /// The last sample time was reached.
    Finished,
    /// The step limit was reached at time `t`.
    StepLimit {
        /// Time reached, s.
        t: f64,
    },
    /// The solution was stopped from outside at time `t`.
    Stopped {
        /// Time reached, s.
        t: f64,
    },
    /// No finite continuation was found at time `t`.
    Failed {
        /// Time reached, s.
        t: f64,
        /// Reason of the failure.
        reason: Failure,
    },
}

/// Reason why a solution could not be continued.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// The state or its derivative became NaN or infinite.
    NotFinite,
    /// The error estimate required steps below rounding: a singularity, or tolerances below rounding.
    StepTooSmall,
    /// The equation of an implicit step was not solved: take a smaller step.
    NotConverged,
    /// The mass matrix is not positive definite: the effect of dry friction is not defined there.
    NotDefinite,
    /// The initial velocity has no momentum: H is not convex in p there.
    NoMomentum,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the state is no longer finite",
            Self::StepTooSmall => {
                "the step shrank below rounding: singular motion or tolerance too small"
            }
            Self::NotDefinite => {
                "the mass matrix is not positive definite, which dry friction needs: take another `method`"
            }
            Self::NotConverged => "the implicit step was not solved: take a smaller step",
            Self::NoMomentum => {
                "no momentum gives the initial velocity: start within what was learned, or fit `structure` mass"
            }
        })
    }
}

/// out = x + h Σₛ wₛ kₛ, with the slopes kₛ one after another in `k`; zero weights cost nothing.
fn combine(out: &mut [f64], x: &[f64], h: f64, weights: &[f64], k: &[f64]) {
    out.copy_from_slice(x);
    for (weight, slope) in weights.iter().zip(k.chunks_exact(x.len())) {
        if *weight != 0.0 {
            let factor = h * weight;
            out.iter_mut()
                .zip(slope)
                .for_each(|(out, slope)| *out += factor * slope);
        }
    }
}
