//! The accelerations at the samples of a rollout that its integrator has evaluated: the first slopes of steps that begin
//! at a sample.

/// Accelerations of the first samples, as far as each sample was evaluated.
#[derive(Debug, Default)]
pub(super) struct SampledAccelerations {
    /// Last sample (q, q̇), and whether its acceleration is still due.
    state: Vec<f64>,
    due: bool,
    /// Whether an earlier sample has no acceleration.
    broken: bool,
    qdd: Vec<f64>,
    force: Vec<f64>,
}

impl SampledAccelerations {
    /// Notes that a sample was taken.
    pub(super) fn sampled(&mut self, state: &[f64]) {
        self.broken |= self.due;
        self.due = true;
        self.state.clear();
        self.state.extend_from_slice(state);
    }

    /// Notes the acceleration of a state under a force.
    pub(super) fn evaluated(&mut self, q: &[f64], qd: &[f64], force: &[f64], qdd: &[f64]) {
        if !self.due || self.broken {
            return;
        }
        // If any evaluation is at the sample, it is the first one after it.
        self.due = false;
        let own = self.state.iter().zip(q.iter().chain(qd));
        if own.fold(true, |same, (a, b)| same & (a.to_bits() == b.to_bits())) {
            self.found(force, qdd);
        } else {
            self.broken = true;
        }
    }

    /// Stores the acceleration of the next sample under a force.
    pub(super) fn found(&mut self, force: &[f64], qdd: &[f64]) {
        self.qdd.extend_from_slice(qdd);
        self.force.extend_from_slice(force);
    }

    /// Accelerations of the first samples under these forces, `[m, n]`.
    pub(super) fn under(&self, forces: &[f64]) -> &[f64] {
        let pairs = self.force.iter().zip(forces);
        match pairs.clone().all(|(a, b)| a.to_bits() == b.to_bits()) {
            true => &self.qdd[..pairs.len()],
            false => &[],
        }
    }
}
