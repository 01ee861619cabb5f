//! The evaluator of a Lagrangian with its forces.

use super::{Evaluation, Evaluator, forward, inverse};
use crate::forces::{Actuation, Applied, Dissipation};
use crate::lagrangian::{Jet, Jets, Lagrangian};
use lagrangian_motion::Coordinates;
use lagrangian_motion::solve::SymmetricSolver;

/// Derivatives of a Lagrangian at a state (q, v) that a variational method needs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Slopes {
    /// The momentum p = ∂L/∂v, `[n]`.
    pub momentum: Vec<f64>,
    /// The rate of the momentum, ∂L/∂q + τ − d, `[n]`.
    pub force: Vec<f64>,
    /// The mass matrix M = ∂²L/∂v∂v, `[n, n]`.
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
/// Evaluates the motion of a Lagrangian with its forces; allocates nothing once warm.
pub struct EulerLagrange<'a> {
    coordinates: &'a Coordinates,
    jets: Box<dyn Jets + 'a>,
    applied: Applied<'a>,
    jet: Jet,
    force: Vec<f64>,
    solver: SymmetricSolver,
}

impl<'a> EulerLagrange<'a> {
    /// The evaluator of this Lagrangian and its dissipation, which must have coefficients for each coordinate.
    #[must_use]
    pub fn new(lagrangian: &'a dyn Lagrangian, dissipation: Option<&'a Dissipation>) -> Self {
        Self {
            coordinates: lagrangian.coordinates(),
            jets: lagrangian.jets(),
            applied: Applied {
                dissipation,
                actuation: None,
            },
            jet: Jet::default(),
            force: Vec::new(),
            solver: SymmetricSolver::new(lagrangian.coordinates().dof()),
        }
    }

    /// This evaluator with inputs instead of forces; the actuation must have the coordinates of the Lagrangian.
    #[must_use]
    pub fn driven(mut self, actuation: Option<&'a Actuation>) -> Self {
        self.applied.actuation = actuation;
        self
    }

    /// Evaluates L; coordinates that are parameters get the derivatives of coordinates that never move.
    fn evaluate(&mut self, q: &[f64], qd: &[f64]) {
        self.jets.jet(q, qd, &mut self.jet);
        for state in 0..self.jet.lagrangian.len() {
            self.jet.hold(self.coordinates, state);
        }
    }

    /// No force acts on a parameter.
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

    /// Writes τ − d to `force`.
    fn sum_forces(&mut self, qd: &[f64], tau: &[f64]) {
        self.force.resize(qd.len(), 0.0);
        self.applied.exerted(qd, tau, &mut self.force);
        Self::release(self.coordinates, &mut self.force);
    }

    /// The derivatives of L at the states evaluated last.
    #[must_use]
    pub fn jet(&self) -> &Jet {
        &self.jet
    }
}

impl Evaluator for EulerLagrange<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        self.evaluate(q, qd);
        self.sum_forces(qd, tau);
        forward(&self.jet, &mut self.solver, &mut self.force, qdd)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        self.evaluate(q, qd);
        inverse(&self.jet, self.solver.n(), qdd, tau);
        self.applied.needed(qd, tau);
        Self::release(self.coordinates, tau);
        Evaluation::of(tau, self.solver.n(), 0)
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        self.evaluate(q, qd);
        mass.copy_from_slice(&self.jet.mass_matrix);
        Evaluation::of(mass, self.solver.n().pow(2), 0)
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        self.evaluate(q, qd);
        super::bias(&self.jet, bias);
        Evaluation::of(bias, self.solver.n(), 0)
    }

    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        self.evaluate(q, qd);
        p.copy_from_slice(&self.jet.momentum);
        Evaluation::of(p, self.solver.n(), 0)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        self.evaluate(q, qd);
        super::energy(&self.jet, self.solver.n(), qd, energy);
        Evaluation::of(energy, 1, 0)
    }

    fn applied(&self) -> Applied<'_> {
        self.applied
    }
}
