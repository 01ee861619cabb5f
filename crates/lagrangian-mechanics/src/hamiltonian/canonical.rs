//! Hamilton's equations, written once: q̇ = ∂H/∂p, ṗ = −∂H/∂q + τ − d(q̇) (theory.md, equation 87).

use super::legendre::Velocity;
use super::newton::Newton;
use super::{Hamiltonian, HamiltonianJet, LagrangianOf};
use crate::dynamics::{EulerLagrange, Evaluation, Evaluator, Mechanical, Model, PhaseFlow};
use crate::forces::{Actuation, Applied, Dissipation};
use crate::lagrangian::Lagrangian;
use lagrangian_motion::{Coordinates, Result};

/// Model of a Hamiltonian, with optional dissipation and inputs. It moves in (q, p), and is a model of
/// (q, q̇) like any other by its Legendre transform.
///
/// A Hamiltonian that is not [`Hamiltonian::canonical`] moves in (q, q̇), and has no inverse dynamics.
#[derive(Debug, Clone)]
pub struct Canonical<H>(Mechanical<LagrangianOf<H>>);

impl<H: Hamiltonian> Canonical<H> {
    /// A model without dissipation: H is conserved where no force acts.
    #[must_use]
    pub fn conservative(hamiltonian: H) -> Self {
        Self(Mechanical::conservative(LagrangianOf::new(hamiltonian)))
    }

    /// A model with these forces in addition to those of H.
    ///
    /// # Errors
    /// As [`Mechanical::dissipative`] and [`Mechanical::driven`].
    pub fn with(
        hamiltonian: H,
        dissipation: Option<Dissipation>,
        actuation: Option<Actuation>,
    ) -> Result<Self> {
        Mechanical::with_forces(LagrangianOf::new(hamiltonian), dissipation, actuation).map(Self)
    }

    /// The Hamiltonian.
    #[must_use]
    pub fn hamiltonian(&self) -> &H {
        self.0.lagrangian.hamiltonian()
    }

    /// The model as a Lagrangian with its forces.
    #[must_use]
    pub fn mechanical(&self) -> &Mechanical<LagrangianOf<H>> {
        &self.0
    }
}

impl<H: Hamiltonian> Model for Canonical<H> {
    fn coordinates(&self) -> &Coordinates {
        self.0.lagrangian.coordinates()
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        let canonical = self.hamiltonian().canonical();
        canonical.then(|| self.0.mechanics()).flatten()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        let hamiltonian = self.hamiltonian();
        let n = hamiltonian.coordinates().dof();
        let applied = self.0.applied();
        Box::new(Hamilton {
            source: Velocity {
                jets: hamiltonian.jets(),
                jet: HamiltonianJet::default(),
            },
            canonical: hamiltonian.canonical(),
            applied,
            motion: self.0.motion(),
            newton: Newton::new(n),
            scratch: Vec::new(),
        })
    }
}

struct Hamilton<'a> {
    source: Velocity<'a>,
    canonical: bool,
    applied: Applied<'a>,
    /// Forward and inverse dynamics by the Legendre transform.
    motion: EulerLagrange<'a>,
    newton: Newton,
    scratch: Vec<f64>,
}

impl Hamilton<'_> {
    /// Evaluation by the Lagrangian, where it exists.
    fn legendre(&mut self, ask: impl FnOnce(&mut EulerLagrange<'_>) -> Evaluation) -> Evaluation {
        match self.canonical {
            true => ask(&mut self.motion),
            false => Evaluation::Unsupported,
        }
    }
}

impl Evaluator for Hamilton<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        if self.canonical {
            return self.motion.forward_dynamics(q, qd, tau, qdd);
        }
        let mut velocity = vec![0.0; qd.len()];
        self.flow(q, qd, tau, &mut velocity, qdd)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        self.legendre(|motion| motion.inverse_dynamics(q, qd, qdd, tau))
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        self.legendre(|motion| motion.mass_matrix(q, qd, mass))
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        self.legendre(|motion| motion.bias(q, qd, bias))
    }

    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        self.legendre(|motion| motion.momentum(q, qd, p))
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        let mut z = vec![0.0; qd.len()];
        let _ = self.phase(q, qd, &mut z); // where z does not exist, the energy is not finite either
        self.source.jets.value(q, &z, energy)
    }

    fn applied(&self) -> Applied<'_> {
        self.applied
    }

    fn phase_flow(&mut self) -> Option<&mut dyn PhaseFlow> {
        Some(self)
    }
}

impl PhaseFlow for Hamilton<'_> {
    fn phase(&mut self, q: &[f64], qd: &[f64], z: &mut [f64]) -> Evaluation {
        if self.canonical {
            self.newton.solve(&mut self.source, q, qd, z);
        } else {
            z.copy_from_slice(qd);
        }
        Evaluation::of(z, self.newton.n(), 0)
    }

    fn velocity(&mut self, q: &[f64], z: &[f64], qd: &mut [f64]) -> Evaluation {
        if self.canonical {
            self.scratch.resize(z.len(), 0.0);
            self.source.jets.slopes(q, z, &mut self.scratch, qd);
        } else {
            qd.copy_from_slice(z);
        }
        Evaluation::of(qd, self.newton.n(), 0)
    }

    fn flow(
        &mut self,
        q: &[f64],
        z: &[f64],
        tau: &[f64],
        dq: &mut [f64],
        dz: &mut [f64],
    ) -> Evaluation {
        self.source.jets.slopes(q, z, dz, dq);
        let force = &mut self.scratch;
        force.resize(tau.len(), 0.0);
        self.applied.exerted(dq, tau, force);
        dz.iter_mut().zip(&*force).for_each(|(dz, f)| *dz = f - *dz);
        Evaluation::of(dz, self.newton.n(), 0)
    }
}
