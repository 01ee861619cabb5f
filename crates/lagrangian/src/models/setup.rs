//! The part of a fit that all families share: the loss and its weights, the forces beside the model, and the nominal model.

use std::borrow::Cow;
use std::sync::Arc;

use super::family::Residuals;
use super::learned::{Learned, LearnedLagrangian};
use crate::dataset::Dataset;
use crate::train::{
    CHORDS, ForceTerms, Forces, LearnerShape, Loss, MAX_DOF, NetworkShape, PositionsLearner,
    TrainingTask, Work, remainder,
};
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_motion::solve::Regularity;
use lagrangian_motion::{Error, Result};
use nets::simd::Real;

/// The part of a fit that does not depend on the network.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    /// The loss; under the rollout loss, that of the warm start.
    pub(crate) loss: Loss,
    /// The weight of each residual of a sample, `[m]`.
    pub(crate) weights: Vec<f64>,
    /// Unit weights, for rates.
    pub(crate) ones: Vec<f64>,
    /// The forces that are learned beside the model, and their units.
    pub(crate) terms: ForceTerms,
    pub(crate) forces: Forces,
    /// The nominal model.
    pub(crate) nominal: Option<RigidBodies>,
}

impl Setup {
    /// The setup for these data, and the data of the network, from which the forces of the nominal model are subtracted.
    pub(crate) fn new<'d>(
        dataset: &'d Dataset,
        task: &TrainingTask,
    ) -> Result<(Self, Cow<'d, Dataset>)> {
        Error::check_dof(dataset.coordinates.dof(), MAX_DOF)?;
        let nominal = task.nominal(dataset)?;
        let dataset = match &nominal {
            Some(nominal) => Cow::Owned(remainder(nominal, dataset)),
            None => Cow::Borrowed(dataset),
        };
        let loss = match task.loss {
            Loss::ROLLOUT => Loss::ACCELERATION,
            loss => loss,
        };
        let speeds = dataset.scaling().qd_scale;
        let (tau, qdd) = (dataset.force_scale(), dataset.acceleration_scale());
        let setup = Self {
            loss,
            weights: loss.weights(&dataset),
            ones: vec![1.0; 2 * MAX_DOF],
            terms: task.forces,
            forces: Forces::new(task.forces, tau, speeds, qdd),
            nominal,
        };
        Ok((setup, dataset))
    }

    /// A learner of such residuals.
    pub(crate) fn learner<'a, S>(&'a self, shape: &'a S, of: Residuals) -> NetworkLearner<'a, S> {
        let (loss, weights) = match of {
            Residuals::OfLoss => (self.loss, &self.weights[..]),
            Residuals::OfRates => (Loss::ACCELERATION, &self.ones[..self.weights.len()]),
        };
        NetworkLearner {
            shape,
            loss,
            weights,
            forces: self.forces.clone(),
            nominal: self.nominal.as_ref(),
            phase: of == Residuals::OfRates,
        }
    }

    /// The learner of a Lagrangian network from positions alone, for such a loss; momenta depend on the velocity alone if
    /// `constant`.
    pub(crate) fn positions<'a, F>(
        &'a self,
        family: &'a F,
        constant: bool,
    ) -> Option<PositionsLearner<'a, F>> {
        Some(PositionsLearner {
            family,
            loss: self.loss,
            rule: self.loss.rule()?,
            constant,
            weights: &self.weights,
            forces: self.forces.clone(),
            chords: CHORDS,
        })
    }

    /// The Lagrangian with the trained forces, added to the nominal model where it exists.
    pub(crate) fn learned(
        &self,
        lagrangian: impl LearnedLagrangian + Clone,
        extra: &[f64],
    ) -> Result<Learned> {
        self.damped(lagrangian, self.forces.dissipation(extra), extra)
    }

    /// The model of a Lagrangian with this friction.
    pub(crate) fn damped(
        &self,
        lagrangian: impl LearnedLagrangian + Clone,
        friction: Option<Dissipation>,
        extra: &[f64],
    ) -> Result<Learned> {
        let actuation = self.forces.actuation(self.terms, extra)?;
        match &self.nominal {
            None => Ok(Mechanical::with_forces(lagrangian, friction, actuation)?.into()),
            Some(nominal) => {
                let rest: Arc<dyn LearnedLagrangian> = Arc::new(lagrangian);
                let rest = Mechanical::with_forces(rest, friction, actuation)?;
                Learned::with_nominal(nominal.clone(), rest)
            }
        }
    }
}

/// A network of this shape in training; each family computes its residuals and their derivatives.
#[derive(Debug)]
pub(crate) struct NetworkLearner<'a, S> {
    pub(crate) shape: &'a S,
    pub(crate) loss: Loss,
    /// The weight of each residual, `[m]`.
    pub(crate) weights: &'a [f64],
    pub(crate) forces: Forces,
    /// The nominal model, where there is one.
    pub(crate) nominal: Option<&'a RigidBodies>,
    /// Whether states of a network in phase space are (q, p), as in a rollout, and not those of a recording.
    pub(crate) phase: bool,
}

impl<S: NetworkShape> NetworkLearner<'_, S> {
    /// The properties of a learner of this number of raw outputs, each along a direction of its own, and of residuals.
    pub(crate) fn shape_of(&self, outputs: usize, residuals: usize) -> LearnerShape<'_> {
        let dof = self.shape.dof();
        LearnerShape {
            net: self.shape.net(),
            dof,
            directions: outputs,
            outputs,
            residuals,
            points: 1,
            phase: false,
            loss: self.loss,
            weights: &self.weights[..dof],
            forces: Some(&self.forces),
        }
    }

    /// r = w (M⁻¹ (τ − d − c) − q̈), D = −w M⁻¹ E, with S in units of the energy E (theory.md, equation 15).
    pub(crate) fn residual_of_jet<T: Real>(&self, s: usize, work: &mut Work<T>, energy: f64) {
        let n = self.shape.dof();
        let mass = &work.mechanics.jet.mass_matrix[s * n * n..][..n * n];
        let row = s * n..s * n + n;
        let inverse = &mut work.linear.d[s * n * n..][..n * n];
        let regularity = work.mechanics.solver.invert(mass, inverse);
        inverse.iter_mut().for_each(|d| *d *= -energy);
        let mut regular = matches!(regularity, Regularity::Definite | Regularity::Indefinite);
        for i in row.clone() {
            let force = work.mechanics.jet.dl_dq[i]
                - work.mechanics.jet.momentum_drift[i]
                - work.mechanics.scratch[n + i - s * n];
            work.mechanics.scratch[i - s * n] = force;
        }
        for (i, at) in row.clone().enumerate() {
            let inverse = &work.linear.d[at * n..][..n];
            let qdd = -inverse
                .iter()
                .zip(&work.mechanics.scratch[..n])
                .map(|(m, f)| m * f)
                .sum::<f64>()
                / energy;
            work.linear.along[at] = qdd;
            work.linear.residual[at] = self.weights[i] * (qdd - work.states.qdd[at]);
            regular &= qdd.is_finite() && qdd.abs() < 1e30;
        }
        for (i, at) in row.clone().enumerate() {
            let inverse = &mut work.linear.d[at * n..][..n];
            inverse.iter_mut().for_each(|d| *d *= self.weights[i]);
        }
        if !regular {
            work.omit(s);
        }
    }
}

impl Loss {
    /// The weights of a sample's residuals, `[m]`: one over the root mean square of their signal, 0 for
    /// parameters.
    fn weights(self, dataset: &Dataset) -> Vec<f64> {
        let (qdd, tau) = (dataset.acceleration_scale(), dataset.force_scale());
        let scales = match self {
            Self::TORQUE_ACCELERATION => [tau, qdd].concat(),
            Self::TORQUE_POWER => {
                let power = dataset.power_scale();
                [tau, vec![power]].concat()
            }
            _ if self.needs_forces() => tau,
            _ => qdd,
        };
        let n = dataset.coordinates.dof();
        let mut weights: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
        for i in dataset.coordinates.parameters() {
            let own = weights.chunks_exact_mut(n).map(|set| &mut set[i]);
            own.for_each(|w| *w = 0.0);
        }
        weights
    }
}
