//! Hamilton's equations, written once: q̇ = ∂H/∂p, ṗ = −∂H/∂q + τ − d(q̇) (theory.md, equation 87).

use super::legendre::Velocity;
use super::newton::Newton;
use super::{Hamiltonian, HamiltonianJet, HamiltonianJets, LagrangianOf};
use crate::mechanics::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use crate::mechanics::forces::{Actuation, Dissipation};
use crate::{Coordinates, Result};

/// The model of a Hamiltonian, with dissipation and inputs if there are any: it moves in (q, p), and is a model of
/// (q, q̇) like any other by its Legendre transform.
///
/// A Hamiltonian that is not [`Hamiltonian::canonical`] moves in (q, q̇), and has no inverse dynamics.
#[derive(Debug, Clone)]
pub struct Canonical<H>(Mechanical<LagrangianOf<H>>);

impl<H: Hamiltonian> Canonical<H> {
    /// Without dissipation: H is conserved where no force acts.
    #[must_use]
    pub fn conservative(hamiltonian: H) -> Self {
        Self(Mechanical::conservative(LagrangianOf::new(hamiltonian)))
    }

    /// With these forces beside those of H.
    ///
    /// # Errors
    /// As [`Mechanical::dissipative`] and [`Mechanical::driven`].
    pub fn with(
        hamiltonian: H,
        dissipation: Option<Dissipation>,
        actuation: Option<Actuation>,
    ) -> Result<Self> {
        let lagrangian = LagrangianOf::new(hamiltonian);
        let model = match dissipation {
            None => Mechanical::conservative(lagrangian),
            Some(dissipation) => Mechanical::dissipative(lagrangian, dissipation)?,
        };
        Ok(Self(match actuation {
            None => model,
            Some(actuation) => model.driven(actuation)?,
        }))
    }

    /// The Hamiltonian.
    #[must_use]
    pub fn hamiltonian(&self) -> &H {
        self.0.lagrangian.hamiltonian()
    }

    /// The same as a Lagrangian with its forces.
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
        let (dissipation, actuation) = (self.0.dissipation(), self.0.actuation());
        let motion = EulerLagrange::new(&self.0.lagrangian, dissipation).driven(actuation);
        Box::new(Hamilton {
            source: Velocity {
                jets: hamiltonian.jets(),
                jet: HamiltonianJet::default(),
            },
            canonical: hamiltonian.canonical(),
            dissipation,
            actuation,
            motion,
            newton: Newton::new(n),
            scratch: Vec::new(),
        })
    }
}

use crate::mechanics::lagrangian::Lagrangian;

struct Hamilton<'a> {
    source: Velocity<'a>,
    canonical: bool,
    dissipation: Option<&'a Dissipation>,
    actuation: Option<&'a Actuation>,
    /// Forward and inverse dynamics by the Legendre transform.
    motion: EulerLagrange<'a>,
    newton: Newton,
    scratch: Vec<f64>,
}

impl Hamilton<'_> {
    fn jets(&mut self) -> &mut dyn HamiltonianJets {
        &mut *self.source.jets
    }
}

impl Evaluator for Hamilton<'_> {
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize {
        if self.canonical {
            return self.motion.forward_dynamics(q, qd, tau, qdd);
        }
        let mut found = vec![0.0; qd.len()];
        self.flow(q, qd, tau, &mut found, qdd)
    }

    fn inverse_dynamics(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) -> bool {
        self.canonical && self.motion.inverse_dynamics(q, qd, qdd, tau)
    }

    fn friction(&mut self, qd: &[f64], tau: &mut [f64]) {
        self.motion.friction(qd, tau);
    }

    fn offset(&mut self, tau: &mut [f64]) {
        self.motion.offset(tau);
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> bool {
        let mut z = vec![0.0; qd.len()];
        self.phase(q, qd, &mut z);
        self.jets().value(q, &z, energy)
    }

    fn second_order(&self) -> bool {
        false
    }

    fn phase(&mut self, q: &[f64], qd: &[f64], z: &mut [f64]) -> bool {
        if self.canonical {
            return self.newton.solve(&mut self.source, q, qd, z) == 0;
        }
        z.copy_from_slice(qd);
        true
    }

    fn velocity(&mut self, q: &[f64], z: &[f64], qd: &mut [f64]) {
        if self.canonical {
            let mut dh_dq = std::mem::take(&mut self.scratch);
            dh_dq.resize(z.len(), 0.0);
            self.jets().slopes(q, z, &mut dh_dq, qd);
            self.scratch = dh_dq;
        } else {
            qd.copy_from_slice(z);
        }
    }

    fn flow(&mut self, q: &[f64], z: &[f64], tau: &[f64], dq: &mut [f64], dz: &mut [f64]) -> usize {
        self.source.jets.slopes(q, z, dz, dq);
        let force = &mut self.scratch;
        force.resize(tau.len(), 0.0);
        match self.actuation {
            Some(actuation) => actuation.forces(tau, force),
            None => force.copy_from_slice(tau),
        }
        dz.iter_mut().zip(&*force).for_each(|(dz, f)| *dz = f - *dz);
        if let Some(dissipation) = self.dissipation {
            dissipation.force(dq, force);
            dz.iter_mut().zip(&*force).for_each(|(dz, d)| *dz -= d);
        }
        0
    }
}
