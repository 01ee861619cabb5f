//! The equations of a model as expressions, from which all its other quantities follow.

use super::{Function, Graph, Id, Value};
use crate::forces::Applied;
use crate::lagrangian::Lagrangian;
use lagrangian_motion::{Coordinates, Error, Result};

/// Names of the inputs of the expressions.
pub mod input {
    /// The coordinates q, `[n]`.
    pub const Q: &str = "q";
    /// The velocities q̇, `[n]`.
    pub const QD: &str = "qd";
    /// The accelerations q̈, `[n]`.
    pub const QDD: &str = "qdd";
    /// The inputs that replace forces, τ, `[n]`.
    pub const TAU: &str = "tau";
    /// The momenta p, `[n]`.
    pub const P: &str = "p";
    /// Forces, `[n]`.
    pub const FORCE: &str = "force";
    /// A direction, `[n]`.
    pub const DIRECTION: &str = "direction";
}

/// The equations of a model.
#[derive(Debug)]
pub enum Equations {
    /// Equations of mechanics, M q̈ + c = F.
    Mechanics(Mechanics),
    /// Hamilton's equations, in (q, p).
    Hamiltonian(Hamiltonian),
    /// Equations of a plain network.
    Plain(Plain),
    /// Equations of first order, in (q, v) with any v.
    Flow(Flow),
}

impl Equations {
    /// The graph of all expressions.
    #[must_use]
    pub fn graph(&self) -> &Graph {
        match self {
            Self::Mechanics(own) => &own.graph,
            Self::Hamiltonian(own) => &own.graph,
            Self::Plain(own) => &own.graph,
            Self::Flow(own) => &own.graph,
        }
    }
}

/// A state and its acceleration, as inputs of a graph.
#[derive(Debug, Clone, Copy)]
pub struct Moving<'g> {
    /// q, `[n]`.
    pub q: Value<'g>,
    /// q̇, `[n]`.
    pub qd: Value<'g>,
    /// q̈, `[n]`.
    pub qdd: Value<'g>,
}

impl<'g> Moving<'g> {
    fn of(graph: &'g Graph, n: usize) -> Self {
        Self {
            q: graph.input(input::Q, n),
            qd: graph.input(input::QD, n),
            qdd: graph.input(input::QDD, n),
        }
    }
}

/// The terms of a Lagrangian as expressions of a state and its acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Expressed<'g> {
    /// L, one number.
    pub lagrangian: Value<'g>,
    /// p = ∂L/∂q̇, `[n]`.
    pub momentum: Value<'g>,
    /// M q̈ + c = dp/dt − ∂L/∂q, `[n]`.
    pub forces: Value<'g>,
}

impl<'g> Expressed<'g> {
    /// Terms of L, an expression of q and q̇.
    pub fn of(lagrangian: Value<'g>, at: &Moving<'g>) -> Self {
        let momentum = lagrangian.gradient(at.qd);
        let rate = momentum.along(&[(at.q, at.qd), (at.qd, at.qdd)]);
        Self {
            lagrangian,
            momentum,
            forces: rate - lagrangian.gradient(at.q),
        }
    }

    /// Terms of a sum whose second part is weighted by `trust`.
    pub(crate) fn plus(self, other: Self, trust: Value<'g>) -> Self {
        let sum = |a: Value<'g>, b: Value<'g>| a + trust * b;
        Self {
            lagrangian: sum(self.lagrangian, other.lagrangian),
            momentum: sum(self.momentum, other.momentum),
            forces: sum(self.forces, other.forces),
        }
    }
}

/// Equations of a mechanical system, M q̈ + c = F(q̇, τ). All vectors are `[n]` expressions of the inputs in [`input`],
/// without activations, so that every language can compute them.
#[derive(Debug)]
pub struct Mechanics {
    /// The graph of all expressions.
    pub graph: Graph,
    /// The coordinates that never move: M is the identity there, and no force acts.
    pub held: Vec<usize>,
    /// L of (q, q̇), J, one number.
    pub lagrangian: Id,
    /// H = p·q̇ − L of (q, q̇), J, one number.
    pub energy: Id,
    /// p of (q, q̇).
    pub momentum: Id,
    /// c of (q, q̇).
    pub bias: Id,
    /// Column of M of (q, q̇) along the direction.
    pub mass: Id,
    /// Friction d of q̇ without a load.
    pub friction: Id,
    /// Force F of (q̇, τ): the force of the inputs less friction.
    pub exerted: Id,
    /// Change of F along the direction, of q̇ and of τ.
    pub exerted_along: [Id; 2],
    /// Change of M q̈ + c of (q, q̇, q̈) along the direction, of q and of q̇.
    pub forces_along: [Id; 2],
    /// Inputs τ of (q, q̇, q̈).
    pub needed: Id,
    /// Change of these inputs along the direction, of q, of q̇ and of q̈.
    pub needed_along: [Id; 3],
}

impl Mechanics {
    /// Equations of a Lagrangian under these forces.
    ///
    /// # Errors
    /// [`Error::Setting`] for a Lagrangian without expressions.
    pub fn of(graph: Graph, lagrangian: &dyn Lagrangian, applied: &Applied<'_>) -> Result<Self> {
        check(applied)?;
        let coordinates = lagrangian.coordinates();
        let n = coordinates.dof();
        let at = Moving::of(&graph, n);
        let (tau, direction) = (graph.input(input::TAU, n), graph.input(input::DIRECTION, n));
        let terms = lagrangian
            .expressed(&at)
            .ok_or_else(|| without("this Lagrangian"))?;
        let (momentum, forces) = (
            hold(coordinates, terms.momentum),
            hold(coordinates, terms.forces),
        );
        let rest = graph.constant(&vec![0.0; n]);
        let exerted = hold(coordinates, applied.exerted_by(at.qd, tau));
        let needed = hold(coordinates, applied.needed_for(at.qd, forces));
        let friction = hold(coordinates, applied.friction(at.qd));
        let bias = forces.with_input(at.qdd, rest);
        let along = |of: Value<'_>, by: Value<'_>| plain(of.along(&[(by, direction)]));
        // A held coordinate takes no part in the inertia of the others.
        let moved = hold(coordinates, direction);
        let mass = plain(forces.along(&[(at.qdd, moved)]));
        let ids = Self {
            held: coordinates.parameters().collect(),
            lagrangian: plain(terms.lagrangian),
            energy: plain(momentum.dot(at.qd) - terms.lagrangian),
            momentum: plain(momentum),
            bias: plain(bias),
            mass,
            friction: plain(friction),
            exerted: plain(exerted),
            exerted_along: [along(exerted, at.qd), along(exerted, tau)],
            forces_along: [along(forces, at.q), along(forces, at.qd)],
            needed: plain(needed),
            needed_along: [
                along(needed, at.q),
                along(needed, at.qd),
                plain(needed.along(&[(at.qdd, moved)])),
            ],
            graph: Graph::new(),
        };
        Ok(Self { graph, ..ids })
    }
}

/// Hamilton's equations, q̇ = ∂H/∂p and ṗ = −∂H/∂q + F(q̇, τ). All vectors are `[n]` expressions of the inputs in [`input`].
#[derive(Debug)]
pub struct Hamiltonian {
    /// The graph of all expressions.
    pub graph: Graph,
    /// H of (q, p), J, one number.
    pub energy: Id,
    /// ∂H/∂p of (q, p).
    pub velocity: Id,
    /// Column of ∂²H/∂p∂p of (q, p) along the direction, the inverse of M.
    pub inverse_mass: Id,
    /// ∂H/∂q of (q, p).
    pub slope: Id,
    /// (∂²H/∂p∂q) q̇ of (q, p, q̇), the part of q̈ that comes from the change of q.
    pub drift: Id,
    /// Friction d of q̇ without a load.
    pub friction: Id,
    /// Force F of (q̇, τ): the force of the inputs less friction.
    pub exerted: Id,
    /// Inputs τ of (q̇, force).
    pub needed: Id,
}

impl Hamiltonian {
    /// Equations of the H that `write` writes as an expression of q and p, of `n` coordinates, under these forces.
    ///
    /// # Errors
    /// An error for a force without an expression.
    pub fn of(
        graph: Graph,
        n: usize,
        applied: &Applied<'_>,
        write: impl for<'g> Fn(Value<'g>, Value<'g>) -> Value<'g>,
    ) -> Result<Self> {
        check(applied)?;
        let of = |name| graph.input(name, n);
        let (q, p, qd, direction) = (
            of(input::Q),
            of(input::P),
            of(input::QD),
            of(input::DIRECTION),
        );
        let energy = write(q, p);
        let velocity = energy.gradient(p);
        let ids = Self {
            energy: plain(energy),
            velocity: plain(velocity),
            inverse_mass: plain(velocity.along(&[(p, direction)])),
            slope: plain(energy.gradient(q)),
            drift: plain(velocity.along(&[(q, qd)])),
            friction: plain(applied.friction(qd)),
            exerted: plain(applied.exerted_by(qd, of(input::TAU))),
            needed: plain(applied.needed_for(qd, of(input::FORCE))),
            graph: Graph::new(),
        };
        Ok(Self { graph, ..ids })
    }
}

/// Returns an error for forces that have no expression.
fn check(applied: &Applied<'_>) -> Result<()> {
    match applied
        .dissipation
        .is_some_and(|friction| friction.directional.is_some())
    {
        true => Err(without("friction by the direction of the power")),
        false => Ok(()),
    }
}

/// Equations of a plain network, which computes in one direction only.
#[derive(Debug)]
pub struct Plain {
    /// The graph of all expressions.
    pub graph: Graph,
    /// Whether the network computes τ of (q, q̇, q̈), rather than q̈ of (q, q̇, τ).
    pub inverse: bool,
    /// Output of the network, `[n]`.
    pub output: Id,
    /// Change of the output along the direction, of q, of q̇ and of the third input.
    pub along: [Id; 3],
}

impl Plain {
    /// Equations of a network that `write` writes as an expression of q, q̇ and the third input.
    pub fn of(
        graph: Graph,
        coordinates: &Coordinates,
        inverse: bool,
        write: impl for<'g> Fn(&Moving<'g>) -> Value<'g>,
    ) -> Self {
        let n = coordinates.dof();
        let third = graph.input(if inverse { input::QDD } else { input::TAU }, n);
        let at = Moving {
            qdd: third,
            ..Moving::of(&graph, n)
        };
        let direction = graph.input(input::DIRECTION, n);
        let output = hold(coordinates, write(&at));
        let along = [at.q, at.qd, third].map(|by| plain(output.along(&[(by, direction)])));
        let output = plain(output);
        Self {
            inverse,
            output,
            along,
            graph,
        }
    }
}

/// Equations of first order: q̇ and v̇ of (q, v, τ), where v need not be the velocity.
#[derive(Debug)]
pub struct Flow {
    /// The graph of both expressions.
    pub graph: Graph,
    /// Numbers of q̇ and v̇ of the inputs q, q̇ and τ, `[n]` each.
    pub rates: [Id; 2],
}

impl Flow {
    /// Equations under these forces, whose q̇ and v̇ without forces `write` writes as expressions of (q, v, τ).
    ///
    /// # Errors
    /// An error for a force without an expression.
    pub fn of(
        graph: Graph,
        coordinates: &Coordinates,
        applied: Option<&Applied<'_>>,
        write: impl for<'g> Fn([Value<'g>; 3]) -> [Value<'g>; 2],
    ) -> Result<Self> {
        let n = coordinates.dof();
        let at = [input::Q, input::QD, input::TAU].map(|name| graph.input(name, n));
        let [velocity, mut rate] = write(at);
        if let Some(applied) = applied {
            check(applied)?;
            rate = rate + applied.exerted_by(velocity, at[2]);
        }
        let rates = [velocity, rate].map(|rate| plain(hold(coordinates, rate)));
        Ok(Self { graph, rates })
    }
}

/// Number of the expression, rewritten in functions that every language has.
fn plain(value: Value<'_>) -> Id {
    value.plain().id()
}

/// The vector with 0 for the coordinates that never move.
fn hold<'g>(coordinates: &Coordinates, value: Value<'g>) -> Value<'g> {
    if coordinates.parameters().next().is_none() {
        return value;
    }
    let mask: Vec<f64> = (0..coordinates.dof())
        .map(|i| {
            if coordinates.is_parameter(i) {
                0.0
            } else {
                1.0
            }
        })
        .collect();
    value * value.graph().constant(&mask)
}

/// The error for a model without expressions.
pub fn without(what: &str) -> Error {
    Error::setting(
        format!("{what} has no equations that could be written down"),
        "take a model of the families lnn, delan, vin, hnn, rigid, chain, mlp or neural-ode, without directional and quadratic friction",
    )
}

impl<'g> Value<'g> {
    /// This vector with another in the place of an input.
    #[must_use]
    pub fn with_input(self, input: Self, other: Self) -> Self {
        self.graph().with(self, input, other)
    }

    /// √ of each number.
    #[must_use]
    pub fn sqrt(self) -> Self {
        self.map(Function::SquareRoot)
    }
}

/// Equations of a model with a Lagrangian under these forces.
///
/// # Errors
/// An error where the Lagrangian or a force has no expression.
pub fn of(graph: Graph, lagrangian: &dyn Lagrangian, applied: &Applied<'_>) -> Result<Equations> {
    let mechanics = Mechanics::of(graph, lagrangian, applied)?;
    Ok(Equations::Mechanics(mechanics))
}
