//! Errors of single samples.

use serde::Serialize;

use super::parts;
use lagrangian_mechanics::dynamics::Model;
use lagrangian_motion::Samples;
use lagrangian_motion::Signal;
use lagrangian_motion::statistics::variances;
use lagrangian_motion::{Signals, Stop, Trajectory};

/// Errors of one signal over all samples, by coordinate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalError {
    /// Mean squared error, `[n]`, in the square of the signal's unit.
    pub mse: Vec<f64>,
    /// Mean squared error divided by the variance of the signal, `[n]`: 1 is as good as predicting the mean. Not finite for
    /// a signal that is constant, but that of an acceleration counts at least as the square of the one with which the velocity crosses its
    /// deviation within a motion.
    pub nmse: Vec<f64>,
    /// Mean squared error of all coordinates together: the sum of `mse`, as results of `characters` are given.
    pub mse_sum: f64,
    /// Mean of `nmse` over the coordinates.
    pub nmse_mean: f64,
}

/// The part of the largest variance that is rounding.
const ROUNDING: f64 = 1e-20;

impl SignalError {
    /// The errors from mean squared errors and the variances of the true signals, both `[n]`.
    #[must_use]
    pub fn new(mut mse: Vec<f64>, variance: &[f64]) -> Self {
        // What is held at rest errs by rounding alone.
        let largest = variance.iter().copied().fold(0.0, f64::max);
        let rests = |(e, v): &(&mut f64, &f64)| e.max(**v) <= ROUNDING * largest;
        let still = mse.iter_mut().zip(variance).filter(rests);
        still.for_each(|(e, _)| *e = 0.0);
        let variance = variance
            .iter()
            .map(|v| if *v <= ROUNDING * largest { 0.0 } else { *v });
        let nmse = mse.iter().zip(variance).map(|(e, v)| e / v).collect();
        Self::of_parts(mse, nmse)
    }

    fn of_parts(mse: Vec<f64>, nmse: Vec<f64>) -> Self {
        // 0/0: a parameter, which is not predicted. What a model predicts as NaN counts.
        let is_still = |x: f64, e: f64| x.is_nan() && e <= 0.0;
        let known = nmse.iter().zip(&mse).filter(|(x, e)| !is_still(**x, **e));
        let known: Vec<f64> = known.map(|(x, _)| *x).collect();
        Self {
            mse_sum: mse.iter().sum(),
            nmse_mean: known.iter().sum::<f64>() / known.len() as f64,
            mse,
            nmse,
        }
    }

    /// The part of the variance that is not explained, over all coordinates. Either all of them count alike, or all squares, whichever
    /// is less: the noise of a joint without a drive is no reason against a model, nor are small joints beside a well explained one.
    #[must_use]
    pub fn unexplained(&self) -> f64 {
        let variance = |(mse, nmse): (&f64, &f64)| mse / nmse;
        let variances = self.mse.iter().zip(&self.nmse).map(variance);
        let all = variances.filter(|v| v.is_finite()).sum::<f64>();
        self.nmse_mean.min(self.mse_sum / all)
    }

    /// The errors without these parts of the variances, `[n]` or none, which something else explains.
    pub(super) fn without(&self, parts: &[f64]) -> Self {
        if parts.is_empty() || self.nmse_mean.is_nan() {
            return self.clone();
        }
        let (mut mse, mut nmse) = (self.mse.clone(), self.nmse.clone());
        for ((mse, nmse), part) in mse.iter_mut().zip(&mut nmse).zip(parts) {
            let variance = *mse / *nmse;
            if part.is_finite() && variance.is_finite() {
                *nmse -= part.min(*nmse);
                *mse -= (part * variance).min(*mse);
            }
        }
        Self::of_parts(mse, nmse)
    }

    /// The errors of some of the coordinates alone.
    #[must_use]
    pub fn of(&self, coordinates: &[usize]) -> Self {
        let pick = |all: &[f64]| -> Vec<f64> { coordinates.iter().map(|&i| all[i]).collect() };
        Self::of_parts(pick(&self.mse), pick(&self.nmse))
    }
}

/// Adds the errors of τ at every sample, where the model has inverse dynamics.
pub(super) fn add_torques(model: &dyn Model, t: &Trajectory, stop: Stop, torque: &mut Errors) {
    let (Some(qdd), Some(tau)) = (t.values(Signal::Qdd), t.values(Signal::Tau)) else {
        return;
    };
    let mut evaluator = model.evaluator();
    for part in parts(tau.len(), t.dof(), stop) {
        let (q, qd, qdd) = (&t.q[part.clone()], &t.qd[part.clone()], &qdd[part.clone()]);
        let mut predicted = vec![0.0; part.len()];
        let outcome = evaluator.inverse_dynamics(q, qd, qdd, &mut predicted);
        if outcome.is_supported() {
            torque.add(&tau[part], &predicted);
        }
    }
}

/// The accelerations of a model at states `q`, `qd` under forces `tau`, `[m, n]` each; not finite where it has none in one of them.
pub(crate) fn accelerations_at(model: &dyn Model, [q, qd, tau]: [&[f64]; 3]) -> Vec<f64> {
    let mut qdd = vec![0.0; q.len()];
    let evaluation = model.evaluator().forward_dynamics(q, qd, tau, &mut qdd);
    if evaluation.singular() > 0 {
        qdd.fill(f64::INFINITY);
    }
    qdd
}

/// The errors of the torques that a model predicts at some samples; `None` where it has no inverse dynamics.
#[must_use]
pub fn torque_error(model: &dyn Model, samples: &Samples) -> Option<SignalError> {
    let mut predicted = vec![0.0; samples.tau.len()];
    let Signals {
        q, qd, qdd, tau, ..
    } = &samples.signals;
    let outcome = model
        .evaluator()
        .inverse_dynamics(q, qd, qdd, &mut predicted);
    let mut errors = Errors::new(samples.n);
    errors.add(tau, &predicted);
    errors.finish().filter(|_| outcome.is_supported())
}

/// Squared errors, `[n]`, and the true signal that they belong to, `[m, n]`.
pub(crate) struct Errors {
    squared: Vec<f64>,
    truth: Vec<f64>,
}

impl Errors {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            squared: vec![0.0; n],
            truth: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, truth: &[f64], predicted: &[f64]) {
        let n = self.squared.len();
        for (k, (x, y)) in truth.iter().zip(predicted).enumerate() {
            self.squared[k % n] += (x - y).powi(2);
        }
        self.truth.extend_from_slice(truth);
    }

    pub(crate) fn finish(self) -> Option<SignalError> {
        self.finish_with(&[])
    }

    /// The errors, where variances count as these at least, `[n]` or none.
    pub(crate) fn finish_with(self, least: &[f64]) -> Option<SignalError> {
        let n = self.squared.len();
        if self.truth.is_empty() {
            return None;
        }
        let count = (self.truth.len() / n) as f64;
        let mse: Vec<f64> = self.squared.iter().map(|s| s / count).collect();
        let mut variances = variances(&self.truth, n);
        let pairs = variances.iter_mut().zip(least);
        pairs.for_each(|(own, least)| *own = own.max(*least));
        Some(SignalError::new(mse, &variances))
    }
}
