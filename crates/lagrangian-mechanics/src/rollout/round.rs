//! Evaluations that several rollouts request at one time, as one batch.

use super::{Force, SampledAccelerations};
use crate::dynamics::{Evaluation, Evaluator, Model};

/// A batch of states, a row each, and their rates.
pub(super) struct Round<'a> {
    pub(super) evaluator: Box<dyn Evaluator + 'a>,
    n: usize,
    q: Vec<f64>,
    /// Velocities, or another second state of the model.
    z: Vec<f64>,
    qd: Vec<f64>,
    force: Vec<f64>,
    dq: Vec<f64>,
    dz: Vec<f64>,
    alone: [Vec<f64>; 2],
    /// Number of singular mass matrices of each row.
    singular: Vec<u64>,
}

impl<'a> Round<'a> {
    pub(super) fn new(model: &'a dyn Model) -> Self {
        let n = model.coordinates().dof();
        let [q, z, qd, force, dq, dz] = [const { Vec::new() }; 6];
        Self {
            evaluator: model.evaluator(),
            n,
            q,
            z,
            qd,
            force,
            dq,
            dz,
            alone: [vec![0.0; n], vec![0.0; n]],
            singular: Vec::new(),
        }
    }

    /// Clears the batch.
    pub(super) fn clear(&mut self) {
        self.q.clear();
        self.z.clear();
    }

    /// Adds the state x = (q, z) as the next row.
    pub(super) fn add(&mut self, x: &[f64]) {
        self.q.extend_from_slice(&x[..self.n]);
        self.z.extend_from_slice(&x[self.n..]);
    }

    /// Evaluates the rates of all rows, under the forces at the time of each.
    pub(super) fn evaluate(&mut self, tau: &Force<'_>, time: impl Fn(usize) -> f64) {
        let n = self.n;
        for signal in [&mut self.qd, &mut self.force, &mut self.dq, &mut self.dz] {
            signal.resize(self.q.len(), 0.0);
        }
        match self.evaluator.phase_flow() {
            None => self.qd.copy_from_slice(&self.z),
            Some(phase) => {
                let _ = phase.velocity(&self.q, &self.z, &mut self.qd);
            }
        }
        for (row, force) in self.force.chunks_exact_mut(n).enumerate() {
            let (q, qd) = (&self.q[row * n..][..n], &self.qd[row * n..][..n]);
            tau(time(row), q, qd, force);
        }
        self.singular.clear();
        self.singular.resize(self.q.len() / n, 0);
        let evaluator = &mut *self.evaluator;
        let states = [&self.q[..], &self.z, &self.force];
        if rates(evaluator, states, &mut self.dq, &mut self.dz).singular() > 0 {
            let [dq, dz] = &mut self.alone;
            // Rare enough to evaluate each row again to find the singular ones.
            for (row, singular) in self.singular.iter_mut().enumerate() {
                let state = states.map(|signal| &signal[row * n..][..n]);
                *singular = rates(evaluator, state, dq, dz).singular() as u64;
            }
        }
    }

    /// Gives each row its acceleration, if evaluated.
    pub(super) fn record_accelerations(&mut self, known: &mut [SampledAccelerations]) {
        if self.evaluator.phase_flow().is_some() {
            return;
        }
        let n = self.n;
        for (row, known) in known.iter_mut().enumerate() {
            let row = row * n..(row + 1) * n;
            let (q, qd) = (&self.q[row.clone()], &self.qd[row.clone()]);
            known.evaluated(q, qd, &self.force[row.clone()], &self.dz[row]);
        }
    }

    /// Writes the rates (q̇, ż) of a row; returns its number of singular mass matrices.
    pub(super) fn read(&self, row: usize, slope: &mut [f64]) -> u64 {
        let n = self.n;
        slope[..n].copy_from_slice(&self.dq[row * n..][..n]);
        slope[n..].copy_from_slice(&self.dz[row * n..][..n]);
        self.singular[row]
    }
}

/// Writes dq/dt and dz/dt of the states [q, z] under the forces τ, all `[m, n]`.
fn rates(
    evaluator: &mut dyn Evaluator,
    [q, z, tau]: [&[f64]; 3],
    dq: &mut [f64],
    dz: &mut [f64],
) -> Evaluation {
    match evaluator.phase_flow() {
        Some(phase) => phase.flow(q, z, tau, dq, dz),
        None => {
            dq.copy_from_slice(z);
            evaluator.forward_dynamics(q, z, tau, dz)
        }
    }
}
