//! A nominal model in training: what is known of the system joins the balance before a network learns the rest.

use super::learner::{At, Work};
use crate::dataset::Dataset;
use crate::mechanics::dynamics::Model;
use crate::mechanics::lagrangian::Lagrangian;
use crate::rigid::RigidBodies;
use crate::train::Samples;
use crate::trajectory::Signals;
use nets::simd::Real;

impl<T: Real> Work<T> {
    /// Evaluates the nominal model at the states of the block; `None`: nothing is known.
    pub(crate) fn evaluate_nominal(&mut self, nominal: Option<&RigidBodies>) {
        self.mechanics.has_nominal = nominal.is_some();
        if let Some(nominal) = nominal {
            nominal
                .jets()
                .jet(&self.states.q, &self.states.qd, &mut self.mechanics.nominal);
        }
    }

    /// What the nominal model adds to the left side of the balance of coordinate `i` of sample `s`: its bias, and its
    /// inertia where the recorded acceleration is taken.
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

/// What a nominal model leaves: the forces and the accelerations that it errs by, from which a network takes its
/// scales.
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
        // Forces are left over even where none was recorded.
        forced: true,
        train_times: dataset.train_times.clone(),
        validation_times: dataset.validation_times.clone(),
    }
}
