//! A nominal model in training: its forces join the balance, and a network learns what they omit.

use super::learner::{At, Work};
use crate::dataset::Dataset;
use crate::mechanics::dynamics::Model;
use crate::mechanics::lagrangian::Lagrangian;
use crate::rigid::RigidBodies;
use crate::train::Samples;
use crate::trajectory::Signals;
use nets::simd::Real;

impl<T: Real> Work<T> {
    /// Evaluates the nominal model, where there is one, at the states of the block.
    pub(crate) fn evaluate_nominal(&mut self, nominal: Option<&RigidBodies>) {
        self.mechanics.has_nominal = nominal.is_some();
        if let Some(nominal) = nominal {
            nominal
                .jets()
                .jet(&self.states.q, &self.states.qd, &mut self.mechanics.nominal);
        }
    }

    /// The contribution of the nominal model to the left side of the balance of coordinate `i` of sample `s`: its bias, and
    /// its inertia at the recorded acceleration.
    pub(crate) fn nominal_force(&self, s: usize, i: usize, at: At) -> f64 {
        if !self.mechanics.has_nominal {
            return 0.0;
        }
        let (n, k) = (self.mechanics.jet.n(), s * self.mechanics.jet.n() + i);
        let bias = self.mechanics.nominal.momentum_drift[k] - self.mechanics.nominal.dl_dq[k];
        match at {
            At::Recorded => {
                let mass = &self.mechanics.nominal.mass_matrix[k * n..][..n];
                let qdd = &self.states.qdd[s * n..][..n];
                bias + mass.iter().zip(qdd).map(|(m, a)| m * a).sum::<f64>()
            }
            At::Rest | At::Predicted(_) => bias,
        }
    }

    /// Adds the nominal mass matrix to that of sample `s`.
    pub(crate) fn add_nominal_mass(&mut self, s: usize) {
        if self.mechanics.has_nominal {
            let n = self.mechanics.jet.n();
            let entries = s * n * n..(s + 1) * n * n;
            let own = &mut self.mechanics.jet.mass_matrix[entries.clone()];
            let known = &self.mechanics.nominal.mass_matrix[entries];
            own.iter_mut().zip(known).for_each(|(m, k)| *m += k);
        }
    }
}

/// The samples with the errors of a nominal model for forces and accelerations, from which a network takes its scales.
pub(crate) fn remainder(nominal: &RigidBodies, dataset: &Dataset) -> Dataset {
    let left = |samples: &Samples| {
        let mut left = samples.clone();
        let Signals {
            q, qd, qdd, tau, ..
        } = &samples.signals;
        let mut evaluator = nominal.evaluator();
        let (mut needed, mut found) = (vec![0.0; tau.len()], vec![0.0; qdd.len()]);
        let _ = evaluator.inverse_dynamics(q, qd, qdd, &mut needed);
        let _ = evaluator.forward_dynamics(q, qd, tau, &mut found);
        left.tau.iter_mut().zip(needed).for_each(|(t, n)| *t -= n);
        left.qdd.iter_mut().zip(found).for_each(|(a, f)| *a -= f);
        left
    };
    Dataset {
        coordinates: dataset.coordinates.clone(),
        train: left(&dataset.train),
        validation: left(&dataset.validation),
        // The nominal model errs in its forces even where none were recorded.
        forced: true,
        train_times: dataset.train_times.clone(),
        validation_times: dataset.validation_times.clone(),
    }
}
