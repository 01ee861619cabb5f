//! The Euler–Lagrange equation, written once: M q̈ + c = τ − d(q, q̇) (theory.md, equations 4 to 8).
//!
//! From d/dt ∂L/∂q̇ − ∂L/∂q = τ − d with p = ∂L/∂q̇: M = ∂²L/∂q̇∂q̇ and c = (∂p/∂q) q̇ − ∂L/∂q. Along every motion
//! the energy H = p·q̇ − L changes by the power of the forces, dH/dt = (τ − d)·q̇.
//!
//! ```
//! use lagrangian::{Dissipation, Mechanical, Model};
//! use lagrangian::analytic::by_name;
//!
//! let pendulum = by_name("pendulum", &[("length", 2.0)])?;
//! let damped = Mechanical::dissipative(pendulum.lagrangian(), Dissipation::viscous(vec![0.4]))?;
//! let mut acceleration = [0.0];
//! let singular = damped.evaluator().forward_dynamics(&[0.0], &[3.0], &[0.0], &mut acceleration);
//! // q̈ = −b q̇ / (m l²) at the bottom.
//! assert!(singular == 0 && (acceleration[0] + 0.3).abs() < 1e-15);
//! # Ok::<(), lagrangian::Error>(())
//! ```

mod query;

use crate::mechanics::forces::{Actuation, Dissipation};
use crate::mechanics::lagrangian::{Jet, Jets, Lagrangian};
use crate::mechanics::solve::{Regularity, SymmetricSolver};
use crate::{Coordinates, Result};

pub use query::{Dynamics, Evaluation, Quantities};

/// Anything that predicts motion: a Lagrangian with its dissipation, or a plain network.
pub trait Model: Send + Sync {
    /// The coordinates of its state.
    fn coordinates(&self) -> &Coordinates;

    /// Whether it has forward dynamics, so that it can be rolled out: all but an inverse plain network.
    fn moves(&self) -> bool {
        true
    }

    /// Something that evaluates it, with its own scratch memory; one per thread.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;

    /// Its Lagrangian with friction and inputs, for methods that need more than accelerations; `None` for a model
    /// that has none.
    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        None
    }

    /// Its mass matrix, bias, gravity, momentum, energy, and forward and inverse dynamics, with checks of all arrays; one
    /// per thread. [`Quantities`] has the same as new arrays.
    fn dynamics(&self) -> Dynamics<'_> {
        Dynamics::new(self)
    }
}

/// Evaluates one model at batches of `m` states; every array is `[m, n]` unless said otherwise.
pub trait Evaluator {
    /// Forward dynamics: writes q̈ for states (q, q̇) under forces τ (SI units). Returns at how many states
    /// the mass matrix was singular, so that a truncated pseudo-inverse was used. NaN where the model has none, see
    /// [`Model::moves`].
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize;

    /// Inverse dynamics: writes the τ that yields q̈. `false` where the model has none (a plain forward
    /// network).
    fn inverse_dynamics(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) -> bool;

    /// Writes the part of inverse dynamics that friction makes, `[m, n]`; 0 where the model has none.
    fn friction(&mut self, qd: &[f64], tau: &mut [f64]) {
        let _ = qd;
        tau.fill(0.0);
    }

    /// Writes the part of inverse dynamics that neither state nor acceleration changes, `[m, n]`, where the model
    /// tells it from gravity; 0 elsewhere.
    fn offset(&mut self, tau: &mut [f64]) {
        tau.fill(0.0);
    }

    /// Energy H = p·q̇ − L, J, `[m]`. `false` where the model has none.
    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> bool;

    /// Whether the model moves in (q, q̇) with dq/dt = q̇, so that forward dynamics say all: everything but a model
    /// that has a flow of its own, in (q, p) or with another dq/dt.
    fn second_order(&self) -> bool {
        true
    }

    /// Writes z, the second half of the state (q, z) that the model moves in: q̇, or the momenta p(q, q̇) of a
    /// Hamiltonian. `false` where there is no such z, as where H is not convex in p.
    fn phase(&mut self, q: &[f64], qd: &[f64], z: &mut [f64]) -> bool {
        let _ = q;
        z.copy_from_slice(qd);
        true
    }

    /// Writes the velocities q̇ of the states (q, z): z itself, or ∂H/∂p.
    fn velocity(&mut self, q: &[f64], z: &[f64], qd: &mut [f64]) {
        let _ = q;
        qd.copy_from_slice(z);
    }

    /// Writes dq/dt and dz/dt of the states (q, z) under forces τ; returns at how many states the mass matrix was
    /// singular.
    fn flow(&mut self, q: &[f64], z: &[f64], tau: &[f64], dq: &mut [f64], dz: &mut [f64]) -> usize {
        dq.copy_from_slice(z);
        self.forward_dynamics(q, z, tau, dz)
    }
}

/// Bias c = (∂p/∂q) q̇ − ∂L/∂q of the Euler–Lagrange equation M q̈ + c = τ − d, `[m, n]`.
pub fn bias(jet: &Jet, bias: &mut [f64]) {
    for (c, (drift, force)) in bias
        .iter_mut()
        .zip(jet.momentum_drift.iter().zip(&jet.dl_dq))
    {
        *c = drift - force;
    }
}

/// Inverse dynamics τ = M q̈ + c, without dissipation; `qdd` and `tau` are `[m, n]`.
pub fn inverse(jet: &Jet, n: usize, qdd: &[f64], tau: &mut [f64]) {
    bias(jet, tau);
    let states = jet.mass_matrix.chunks_exact((n * n).max(1));
    let signals = qdd
        .chunks_exact(n.max(1))
        .zip(tau.chunks_exact_mut(n.max(1)));
    for (mass, (qdd, tau)) in states.zip(signals) {
        for (row, tau) in mass.chunks_exact(n).zip(tau) {
            *tau += row.iter().zip(qdd).map(|(m, a)| m * a).sum::<f64>();
        }
    }
}

/// Forward dynamics q̈ = M⁻¹ (f − c) for the forces f = τ − d in `force` (which it overwrites with f − c);
/// returns at how many of the `m` states M was singular.
pub fn forward(
    jet: &Jet,
    solver: &mut SymmetricSolver,
    force: &mut [f64],
    qdd: &mut [f64],
) -> usize {
    let n = solver.n().max(1);
    for (f, (drift, dl_dq)) in force
        .iter_mut()
        .zip(jet.momentum_drift.iter().zip(&jet.dl_dq))
    {
        *f += dl_dq - drift;
    }
    let states = jet.mass_matrix.chunks_exact(n * n);
    let signals = force.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
    let singular = |(mass, (force, qdd)): (&[f64], (&[f64], &mut [f64]))| {
        usize::from(solver.solve(mass, force, qdd) == Regularity::Singular)
    };
    states.zip(signals).map(singular).sum()
}

/// Energy H = p·q̇ − L, J, `[m]`; `qd` is `[m, n]`.
pub fn energy(jet: &Jet, n: usize, qd: &[f64], energy: &mut [f64]) {
    let states = jet
        .momentum
        .chunks_exact(n.max(1))
        .zip(qd.chunks_exact(n.max(1)));
    for ((h, l), (p, qd)) in energy.iter_mut().zip(&jet.lagrangian).zip(states) {
        *h = p.iter().zip(qd).map(|(p, v)| p * v).sum::<f64>() - l;
    }
}

/// What a variational method needs of a Lagrangian at a state (q, v), `[n]`, `[n]` and `[n, n]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Slopes {
    /// p = ∂L/∂v.
    pub momentum: Vec<f64>,
    /// ∂L/∂q + τ − d, all that changes p.
    pub force: Vec<f64>,
    /// M = ∂²L/∂v∂v.
    pub mass_matrix: Vec<f64>,
}

impl Slopes {
    /// Zeros, for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            momentum: vec![0.0; n],
            force: vec![0.0; n],
            mass_matrix: vec![0.0; n * n],
        }
    }
}

/// The momenta p = ∂L/∂q̇ of states (q, q̇), `[m, n]`.
#[must_use]
pub fn momenta(lagrangian: &dyn Lagrangian, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let mut jet = Jet::default();
    lagrangian.jets().jet(q, qd, &mut jet);
    jet.momentum
}

/// Evaluates a Lagrangian's motion, with dissipation if there is any; allocates nothing once warm.
pub struct EulerLagrange<'a> {
    coordinates: &'a Coordinates,
    jets: Box<dyn Jets + 'a>,
    dissipation: Option<&'a Dissipation>,
    actuation: Option<&'a Actuation>,
    jet: Jet,
    force: Vec<f64>,
    friction: Vec<f64>,
    solver: SymmetricSolver,
}

impl<'a> EulerLagrange<'a> {
    /// For this Lagrangian and its dissipation, which must have coefficients for each of its coordinates.
    #[must_use]
    pub fn new(lagrangian: &'a dyn Lagrangian, dissipation: Option<&'a Dissipation>) -> Self {
        Self {
            coordinates: lagrangian.coordinates(),
            jets: lagrangian.jets(),
            dissipation,
            actuation: None,
            jet: Jet::default(),
            force: Vec::new(),
            friction: Vec::new(),
            solver: SymmetricSolver::new(lagrangian.coordinates().dof()),
        }
    }

    /// With inputs in the place of forces, which must be those of its coordinates.
    #[must_use]
    pub fn driven(self, actuation: Option<&'a Actuation>) -> Self {
        Self { actuation, ..self }
    }

    /// Evaluates L and holds what never moves.
    fn evaluate(&mut self, q: &[f64], qd: &[f64]) {
        self.jets.jet(q, qd, &mut self.jet);
        for row in 0..self.jet.lagrangian.len() {
            self.jet.hold(self.coordinates, row);
        }
    }

    /// Nothing acts on a parameter.
    fn release(coordinates: &Coordinates, force: &mut [f64]) {
        for i in coordinates.parameters() {
            let column = force.iter_mut().skip(i).step_by(coordinates.dof());
            column.for_each(|f| *f = 0.0);
        }
    }

    /// Writes momentum, ∂L/∂q + τ − d and mass matrix at one state under the forces `tau`.
    pub fn slopes(&mut self, q: &[f64], qd: &[f64], tau: &[f64], slopes: &mut Slopes) {
        self.evaluate(q, qd);
        self.sum_forces(qd, tau);
        slopes.momentum.copy_from_slice(&self.jet.momentum);
        slopes.mass_matrix.copy_from_slice(&self.jet.mass_matrix);
        for (i, force) in slopes.force.iter_mut().enumerate() {
            *force = self.jet.dl_dq[i] + self.force[i];
        }
    }

    /// τ − d into `force`.
    fn sum_forces(&mut self, qd: &[f64], tau: &[f64]) {
        self.force.resize(qd.len(), 0.0);
        match self.actuation {
            Some(actuation) => actuation.forces(tau, &mut self.force),
            None => self.force.copy_from_slice(tau),
        }
        if let Some(dissipation) = self.dissipation {
            self.friction.resize(qd.len(), 0.0);
            dissipation.force(qd, &mut self.friction);
            let pairs = self.force.iter_mut().zip(&self.friction);
            pairs.for_each(|(f, d)| *f -= d);
        }
        Self::release(self.coordinates, &mut self.force);
    }

    /// The derivatives of L at the states evaluated last.
    #[must_use]
    pub fn jet(&self) -> &Jet {
        &self.jet
    }
}

impl Evaluator for EulerLagrange<'_> {
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize {
        self.evaluate(q, qd);
        self.sum_forces(qd, tau);
        forward(&self.jet, &mut self.solver, &mut self.force, qdd)
    }

    fn inverse_dynamics(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) -> bool {
        self.evaluate(q, qd);
        inverse(&self.jet, self.solver.n(), qdd, tau);
        if let Some(dissipation) = self.dissipation {
            self.friction.resize(qd.len(), 0.0);
            dissipation.force(qd, &mut self.friction);
            tau.iter_mut()
                .zip(&self.friction)
                .for_each(|(tau, d)| *tau += d);
        }
        if let Some(actuation) = self.actuation {
            actuation.inputs(tau);
        }
        Self::release(self.coordinates, tau);
        true
    }

    fn friction(&mut self, qd: &[f64], tau: &mut [f64]) {
        let Some(dissipation) = self.dissipation else {
            tau.fill(0.0);
            return;
        };
        dissipation.force(qd, tau);
        if let Some(actuation) = self.actuation {
            actuation.inputs(tau);
            self.friction.resize(qd.len(), 0.0);
            self.friction.fill(0.0);
            actuation.inputs(&mut self.friction);
            tau.iter_mut()
                .zip(&self.friction)
                .for_each(|(tau, still)| *tau -= still);
        }
    }

    fn offset(&mut self, tau: &mut [f64]) {
        tau.fill(0.0);
        if let Some(actuation) = self.actuation {
            actuation.inputs(tau);
        }
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> bool {
        self.evaluate(q, qd);
        self::energy(&self.jet, self.solver.n(), qd, energy);
        true
    }
}

/// The model of a Lagrangian, with dissipation if there is any: what moves by the Euler–Lagrange equation.
#[derive(Debug, Clone)]
pub struct Mechanical<L> {
    /// The Lagrangian.
    pub lagrangian: L,
    dissipation: Option<Dissipation>,
    actuation: Option<Actuation>,
}

impl<L: Lagrangian> Mechanical<L> {
    /// Without dissipation: energy is conserved where no force acts.
    #[must_use]
    pub fn conservative(lagrangian: L) -> Self {
        Self {
            lagrangian,
            dissipation: None,
            actuation: None,
        }
    }

    /// With dissipation.
    ///
    /// # Errors
    /// As [`Dissipation::validate`].
    pub fn dissipative(lagrangian: L, dissipation: Dissipation) -> Result<Self> {
        dissipation.validate(lagrangian.coordinates().dof())?;
        Ok(Self {
            lagrangian,
            dissipation: Some(dissipation),
            actuation: None,
        })
    }

    /// With inputs in the place of forces.
    ///
    /// # Errors
    /// [`Error::Shape`](crate::Error::Shape) where they are not those of its coordinates.
    pub fn driven(self, actuation: Actuation) -> Result<Self> {
        let n = self.lagrangian.coordinates().dof();
        crate::Error::check_shape(
            "actuation",
            actuation.dof(),
            n,
            "give a row of the input matrix and an offset for each coordinate",
        )?;
        let actuation = Some(actuation);
        Ok(Self { actuation, ..self })
    }

    /// The same friction and inputs with a Lagrangian made from this one.
    ///
    /// # Errors
    /// That of `make`; [`Error::Shape`](crate::Error::Shape) for another number of coordinates.
    pub fn with<M: Lagrangian>(self, make: impl FnOnce(L) -> Result<M>) -> Result<Mechanical<M>> {
        Mechanical::with_forces(make(self.lagrangian)?, self.dissipation, self.actuation)
    }

    /// With whatever forces there are beside those of the Lagrangian.
    ///
    /// # Errors
    /// As [`Mechanical::dissipative`] and [`Mechanical::driven`].
    pub fn with_forces(
        lagrangian: L,
        dissipation: Option<Dissipation>,
        actuation: Option<Actuation>,
    ) -> Result<Self> {
        let model = match dissipation {
            None => Self::conservative(lagrangian),
            Some(dissipation) => Self::dissipative(lagrangian, dissipation)?,
        };
        match actuation {
            None => Ok(model),
            Some(actuation) => model.driven(actuation),
        }
    }

    fn motion(&self) -> EulerLagrange<'_> {
        let motion = EulerLagrange::new(&self.lagrangian, self.dissipation.as_ref());
        motion.driven(self.actuation.as_ref())
    }

    /// How its forces come from inputs, where they are not the inputs themselves.
    #[must_use]
    pub fn actuation(&self) -> Option<&Actuation> {
        self.actuation.as_ref()
    }

    /// Its dissipation, where it has any.
    #[must_use]
    pub fn dissipation(&self) -> Option<&Dissipation> {
        self.dissipation.as_ref()
    }
}

impl<L: Lagrangian> Model for Mechanical<L> {
    fn coordinates(&self) -> &Coordinates {
        self.lagrangian.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.motion())
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        Some(self.motion())
    }
}
