//! The evaluator of a model in a loop, and the one outcome of every evaluation.

use super::Balance;
use crate::forces::Applied;

/// Outcome of an evaluation at a batch of states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Evaluation {
    /// All values are finite, and every mass matrix that was inverted is regular.
    Regular,
    /// All values are finite. At some states the mass matrix is singular: there the acceleration is the least-norm
    /// solution.
    Singular {
        /// The number of these states.
        states: usize,
    },
    /// The model is not defined at a state: its values there are not finite.
    NotFinite {
        /// The index of the first of these states.
        state: usize,
        /// The number of states with a singular mass matrix.
        singular: usize,
    },
    /// The model does not have this quantity, as a plain network has no mass matrix; nothing was written.
    Unsupported,
}

impl Evaluation {
    /// Outcome of an evaluation that wrote rows of `width` values and found `singular` singular mass matrices.
    pub fn of(values: &[f64], width: usize, singular: usize) -> Self {
        match values.iter().position(|x| !x.is_finite()) {
            Some(at) => Self::NotFinite {
                state: at / width.max(1),
                singular,
            },
            None if singular > 0 => Self::Singular { states: singular },
            None => Self::Regular,
        }
    }

    /// Whether the model has the quantity.
    #[must_use]
    pub fn is_supported(self) -> bool {
        self != Self::Unsupported
    }

    /// Whether values were written and all of them are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        matches!(self, Self::Regular | Self::Singular { .. })
    }

    /// The number of states at which the mass matrix is singular.
    #[must_use]
    pub fn singular(self) -> usize {
        match self {
            Self::Singular { states } => states,
            Self::NotFinite { singular, .. } => singular,
            Self::Regular | Self::Unsupported => 0,
        }
    }
}

/// Evaluates one model at batches of `m` states; every array is `[m, n]`, in SI units, unless said otherwise.
///
/// M and c contain no friction; inverse dynamics contain it. Where the model has inputs instead of forces, τ are
/// these inputs.
pub trait Evaluator: Send {
    /// Forward dynamics: writes q̈ of states (q, q̇) under forces τ.
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation;

    /// Inverse dynamics: writes the τ that yields q̈.
    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        let _ = (q, qd, qdd, tau);
        Evaluation::Unsupported
    }

    /// Writes the mass matrix M = ∂²L/∂q̇∂q̇, `[m, n, n]`.
    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        let _ = (q, qd, mass);
        Evaluation::Unsupported
    }

    /// Writes the bias c = (∂p/∂q) q̇ − ∂L/∂q: Coriolis, centrifugal and conservative forces.
    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        let _ = (q, qd, bias);
        Evaluation::Unsupported
    }

    /// Writes the momentum p = ∂L/∂q̇.
    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        let _ = (q, qd, p);
        Evaluation::Unsupported
    }

    /// Writes the energy H = p·q̇ − L, J, `[m]`.
    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        let _ = (q, qd, energy);
        Evaluation::Unsupported
    }

    /// Writes the Lagrangian L = p·q̇ − H, J, `[m]`.
    fn lagrangian(&mut self, q: &[f64], qd: &[f64], values: &mut [f64]) -> Evaluation {
        let mut p = vec![0.0; qd.len()];
        let outcome = self.momentum(q, qd, &mut p);
        if !outcome.is_supported() {
            return outcome;
        }
        let outcome = self.energy(q, qd, values);
        let n = qd.len() / values.len().max(1);
        let rows = p.chunks_exact(n.max(1)).zip(qd.chunks_exact(n.max(1)));
        for (value, (p, qd)) in values.iter_mut().zip(rows) {
            *value = p.iter().zip(qd).map(|(p, qd)| p * qd).sum::<f64>() - *value;
        }
        outcome
    }

    /// Friction and inputs of the model, which give the part of τ due to friction; empty for a model that does not separate
    /// them.
    fn applied(&self) -> Applied<'_> {
        Applied::default()
    }

    /// Writes the balance of forces with dry friction as a set of forces, at one state under the inputs `tau`, all `[n]`.
    fn balance(&mut self, q: &[f64], qd: &[f64], tau: &[f64], balance: &mut Balance) -> Evaluation {
        balance.fill(self, [q, qd, tau])
    }

    /// Flow of a model that does not move in (q, q̇) with dq/dt = q̇; `None` where forward dynamics are sufficient.
    fn phase_flow(&mut self) -> Option<&mut dyn PhaseFlow> {
        None
    }
}

/// Evaluates the flow of a model that moves in states (q, z), where z are the momenta p(q, q̇) of a Hamiltonian, or q̇ where
/// dq/dt is another velocity. Every array is `[m, n]`.
pub trait PhaseFlow {
    /// Writes the z of states (q, q̇); not finite where z does not exist, as where H is not convex in p.
    fn phase(&mut self, q: &[f64], qd: &[f64], z: &mut [f64]) -> Evaluation {
        let _ = q;
        z.copy_from_slice(qd);
        Evaluation::Regular
    }

    /// Writes the velocities q̇ of states (q, z): z itself, or ∂H/∂p.
    fn velocity(&mut self, q: &[f64], z: &[f64], qd: &mut [f64]) -> Evaluation {
        let _ = q;
        qd.copy_from_slice(z);
        Evaluation::Regular
    }

    /// Writes dq/dt and dz/dt of states (q, z) under forces τ.
    fn flow(
        &mut self,
        q: &[f64],
        z: &[f64],
        tau: &[f64],
        dq: &mut [f64],
        dz: &mut [f64],
    ) -> Evaluation;
}
