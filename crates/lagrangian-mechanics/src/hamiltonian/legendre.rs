//! The Legendre transform in both directions: H(q, p) = p·q̇ − L at q̇ with ∂L/∂q̇ = p, and L(q, q̇) = p·q̇ − H at p with
//! ∂H/∂p = q̇ (theory.md, equations 88 and 89).

use super::newton::{Gradient, Newton};
use super::{Hamiltonian, HamiltonianJet, HamiltonianJets};
use crate::lagrangian::{Jet, Jets, Lagrangian};
use lagrangian_motion::Coordinates;
use lagrangian_motion::solve::{SymmetricSolver, dot};

/// Hamiltonian of a Lagrangian; velocities from momenta by Newton's method.
///
/// Where L is convex in q̇, each momentum has at most one velocity. If it has no velocity, or the search does not
/// find it, all derivatives are NaN.
///
/// ```
/// use lagrangian_mechanics::Hamiltonian;
/// use lagrangian_mechanics::analytic::by_name;
/// use lagrangian_mechanics::{Canonical, HamiltonianOf};
///
/// let pendulum = by_name("pendulum", &[("length", 2.0)])?;
/// let hamiltonian = HamiltonianOf::new(pendulum.lagrangian());
/// let (mut slope, mut velocity) = ([0.0], [0.0]);
/// hamiltonian.jets().slopes(&[0.3], &[1.0], &mut slope, &mut velocity);
/// assert!((velocity[0] - 0.25).abs() < 1e-15); // p / (m l²)
/// let moving = Canonical::conservative(hamiltonian); // a model like any other, in (q, p)
/// # let _ = moving;
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct HamiltonianOf<L>(L);

impl<L: Lagrangian> HamiltonianOf<L> {
    /// Hamiltonian of this Lagrangian.
    #[must_use]
    pub fn new(lagrangian: L) -> Self {
        Self(lagrangian)
    }
}

impl<L: Lagrangian> Hamiltonian for HamiltonianOf<L> {
    fn coordinates(&self) -> &Coordinates {
        self.0.coordinates()
    }

    fn jets(&self) -> Box<dyn HamiltonianJets + '_> {
        let n = self.0.coordinates().dof();
        Box::new(OfLagrangian {
            source: Momentum {
                jets: self.0.jets(),
                jet: Jet::default(),
            },
            newton: Newton::new(n),
            inverse: Inverse::new(n),
            qd: Vec::new(),
        })
    }
}

/// Lagrangian of a Hamiltonian; momenta from velocities by Newton's method. NaN where the momenta do not exist.
#[derive(Debug, Clone)]
pub struct LagrangianOf<H>(H);

impl<H: Hamiltonian> LagrangianOf<H> {
    /// Lagrangian of this Hamiltonian, which must be [`Hamiltonian::canonical`] to have one.
    #[must_use]
    pub fn new(hamiltonian: H) -> Self {
        Self(hamiltonian)
    }

    /// Underlying Hamiltonian.
    #[must_use]
    pub fn hamiltonian(&self) -> &H {
        &self.0
    }
}

impl<H: Hamiltonian> Lagrangian for LagrangianOf<H> {
    fn coordinates(&self) -> &Coordinates {
        self.0.coordinates()
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        let n = self.0.coordinates().dof();
        Box::new(OfHamiltonian {
            source: Velocity {
                jets: self.0.jets(),
                jet: HamiltonianJet::default(),
            },
            newton: Newton::new(n),
            inverse: Inverse::new(n),
            p: Vec::new(),
        })
    }
}

/// ∂L/∂q̇ and M, for Newton's method.
struct Momentum<'a> {
    jets: Box<dyn Jets + 'a>,
    jet: Jet,
}

impl Gradient for Momentum<'_> {
    fn at(&mut self, q: &[f64], qd: &[f64]) -> (&[f64], &[f64]) {
        self.jets.jet(q, qd, &mut self.jet);
        (&self.jet.momentum, &self.jet.mass_matrix)
    }
}

/// ∂H/∂p and ∂²H/∂p∂p, for Newton's method.
pub(super) struct Velocity<'a> {
    pub(super) jets: Box<dyn HamiltonianJets + 'a>,
    pub(super) jet: HamiltonianJet,
}

impl Gradient for Velocity<'_> {
    fn at(&mut self, q: &[f64], p: &[f64]) -> (&[f64], &[f64]) {
        self.jets.jet(q, p, &mut self.jet);
        (&self.jet.velocity, &self.jet.inverse_mass)
    }
}

struct OfLagrangian<'a> {
    source: Momentum<'a>,
    newton: Newton,
    inverse: Inverse,
    qd: Vec<f64>,
}

impl HamiltonianJets for OfLagrangian<'_> {
    fn slopes(&mut self, q: &[f64], p: &[f64], dh_dq: &mut [f64], velocity: &mut [f64]) {
        self.newton.solve(&mut self.source, q, p, velocity);
        let (jets, jet) = (&mut self.source.jets, &mut self.source.jet);
        jets.jet(q, velocity, jet);
        dh_dq.iter_mut().zip(&jet.dl_dq).for_each(|(h, l)| *h = -l);
    }

    fn jet(&mut self, q: &[f64], p: &[f64], out: &mut HamiltonianJet) {
        let n = self.inverse.solver.n();
        self.qd.resize(p.len(), 0.0);
        self.newton.solve(&mut self.source, q, p, &mut self.qd);
        let (jets, jet) = (&mut self.source.jets, &mut self.source.jet);
        jets.jet(q, &self.qd, jet);
        out.resize(p.len() / n, n);
        out.velocity.copy_from_slice(&self.qd);
        for s in 0..p.len() / n {
            let (row, square) = (s * n..(s + 1) * n, s * n * n..(s + 1) * n * n);
            out.hamiltonian[s] = dot(&p[row.clone()], &self.qd[row.clone()]) - jet.lagrangian[s];
            for i in row.clone() {
                out.dh_dq[i] = -jet.dl_dq[i];
            }
            // The velocity stays that of p: M dq̇ + (∂p/∂q) dq = 0.
            let drift = (
                &jet.momentum_drift[row.clone()],
                &mut out.velocity_drift[row],
            );
            let inverse = &mut out.inverse_mass[square.clone()];
            self.inverse
                .of(&jet.mass_matrix[square], inverse, drift.0, drift.1);
        }
    }
}

struct OfHamiltonian<'a> {
    source: Velocity<'a>,
    newton: Newton,
    inverse: Inverse,
    p: Vec<f64>,
}

impl Jets for OfHamiltonian<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], out: &mut Jet) {
        let n = self.inverse.solver.n();
        self.p.resize(qd.len(), 0.0);
        self.newton.solve(&mut self.source, q, qd, &mut self.p);
        let (jets, jet) = (&mut self.source.jets, &mut self.source.jet);
        jets.jet(q, &self.p, jet);
        out.resize(qd.len() / n, n);
        out.momentum.copy_from_slice(&self.p);
        for s in 0..qd.len() / n {
            let (row, square) = (s * n..(s + 1) * n, s * n * n..(s + 1) * n * n);
            out.lagrangian[s] = dot(&self.p[row.clone()], &qd[row.clone()]) - jet.hamiltonian[s];
            for i in row.clone() {
                out.dl_dq[i] = -jet.dh_dq[i];
            }
            let drift = (
                &jet.velocity_drift[row.clone()],
                &mut out.momentum_drift[row],
            );
            let mass = &mut out.mass_matrix[square.clone()];
            self.inverse
                .of(&jet.inverse_mass[square], mass, drift.0, drift.1);
        }
    }
}

/// Converts the second derivatives of one function to those of the other by inversion.
struct Inverse {
    solver: SymmetricSolver,
    unit: Vec<f64>,
    column: Vec<f64>,
}

impl Inverse {
    fn new(n: usize) -> Self {
        Self {
            solver: SymmetricSolver::new(n),
            unit: vec![0.0; n],
            column: vec![0.0; n],
        }
    }

    /// Writes A⁻¹, symmetric, and −A⁻¹ x.
    fn of(&mut self, a: &[f64], inverse: &mut [f64], x: &[f64], out: &mut [f64]) {
        let n = self.solver.n();
        for i in 0..n {
            self.unit.fill(0.0);
            self.unit[i] = 1.0;
            let _ = self.solver.solve(a, &self.unit, &mut self.column);
            for j in 0..=i {
                inverse[i * n + j] = self.column[j];
                inverse[j * n + i] = self.column[j];
            }
        }
        let _ = self.solver.solve(a, x, out);
        out.iter_mut().for_each(|x| *x = -*x);
    }
}
