//! A nominal model in training: its forces join the balance, and a network learns the forces that it omits.

use super::learner::{At, Work};
use crate::dataset::Dataset;
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::{Error, Result};
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

/// A joint determines the unit of its force where the nominal model explains this part of what friction and an offset do not.
const TELLING: f64 = 0.5;
/// Forces in the unit of the nominal model are within this factor of it, with room for a load that the model does not include.
const FACTOR: f64 = 4.0;
/// The largest number of samples that are compared.
const COMPARED: usize = 4000;

/// Refuses forces that are a multiple of those of the nominal model: they are in another unit, such as currents, or have the wrong sign.
pub(crate) fn check_unit(nominal: &RigidBodies, dataset: &Dataset) -> Result<()> {
    let gains = informative_gains(nominal, dataset);
    let wrong = |gain: f64| !(1.0 / FACTOR..=FACTOR).contains(&gain);
    let list: Vec<String> = gains
        .iter()
        .filter(|(_, gain)| wrong(*gain))
        .map(|(i, gain)| format!("{} {gain:.3}", dataset.coordinates.0[*i].name))
        .collect();
    let reversed = gains.iter().any(|(_, gain)| *gain < 0.0);
    if !reversed && 2 * list.len() < gains.len().max(1) {
        return Ok(());
    }
    let problem = format!(
        "the forces are not those of the nominal model but multiples of them: {}",
        list.join(", ")
    );
    let remedy = "record forces in N·m or N and with the signs of the description, or learn a gain of each joint (`forces` with gains)";
    Err(Error::setting(problem, remedy))
}

/// The gains from the forces of the nominal model to the recorded ones, of the joints that determine them.
fn informative_gains(nominal: &RigidBodies, dataset: &Dataset) -> Vec<(usize, f64)> {
    if !dataset.forced || dataset.train.qdd.is_empty() {
        return Vec::new();
    }
    let (n, samples) = (dataset.coordinates.dof(), dataset.train.spread(COMPARED));
    let mut needed = vec![0.0; samples.tau.len()];
    let (q, qd, qdd) = (&samples.q, &samples.qd, &samples.qdd);
    let outcome = nominal
        .evaluator()
        .inverse_dynamics(q, qd, qdd, &mut needed);
    let speeds = dataset.scaling().qd_scale;
    let gain = |i: usize| {
        let rows = (0..samples.len()).map(|s| s * n + i);
        let row = |k: usize| {
            let direction = (qd[k] / samples.smoothing(0.1 * speeds[i], qdd[k])).tanh();
            [needed[k], qd[k], direction, 1.0, samples.tau[k]]
        };
        gain(&rows.map(row).collect::<Vec<_>>()).map(|gain| (i, gain))
    };
    let finite = outcome.is_finite();
    (0..n).filter(|_| finite).filter_map(gain).collect()
}

/// The coefficient of the first column in a regression of the last one on all others; `None` where it explains too little.
fn gain(rows: &[[f64; 5]]) -> Option<f64> {
    let mut residual: Vec<[f64; 5]> = rows.to_vec();
    // Friction and offset are removed from both, column after column (Gram–Schmidt).
    for k in [3, 2, 1] {
        let size: f64 = residual.iter().map(|r| r[k] * r[k]).sum();
        for j in [0, 1, 2, 4].into_iter().filter(|j| *j < k || *j == 4) {
            let along: f64 = residual.iter().map(|r| r[k] * r[j]).sum::<f64>() / size.max(1e-300);
            residual.iter_mut().for_each(|r| r[j] -= along * r[k]);
        }
    }
    let sum = |j: usize, k: usize| residual.iter().map(|r| r[j] * r[k]).sum::<f64>();
    let (own, both, all) = (sum(0, 0), sum(0, 4), sum(4, 4));
    let telling = both * both > TELLING * own * all && own > 0.0;
    telling.then(|| both / own)
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
        train: left(&dataset.train),
        validation: left(&dataset.validation),
        // The nominal model errs in its forces even where none were recorded.
        forced: true,
        ..dataset.clone()
    }
}
