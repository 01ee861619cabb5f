//! Derivatives of an analytic Lagrangian by dual and hyper-dual numbers: exact to rounding.
//!
//! A hyper-dual number a + b ε₁ + c ε₂ + d ε₁ε₂ carries two directions t₁, t₂ through L; its last component is
//! then the second derivative along both (Fike and Alonso 2011).

use num_dual::{Dual64, DualNum, HyperDual64};
use rand::Rng;

use super::{AnalyticModel, System};
use crate::dynamics::{EulerLagrange, Evaluator, Model};
use crate::lagrangian::{Curvature, Jet, Jets, Lagrangian};
use lagrangian_motion::{Coordinates, State};

/// An analytic system as a [`Lagrangian`] and, free of dissipation, as a [`Model`].
#[derive(Debug, Clone)]
pub struct Analytic<S> {
    system: S,
    coordinates: Coordinates,
}

impl<S: System> Analytic<S> {
    /// The model of a system.
    #[must_use]
    pub fn new(system: S) -> Self {
        Self {
            coordinates: system.coordinates(),
            system,
        }
    }

    /// The system with the parameters of its table.
    #[must_use]
    pub fn standard() -> Self {
        Self::new(S::new(
            &S::PARAMETERS.iter().map(|p| p.value).collect::<Vec<_>>(),
        ))
    }

    /// The system itself.
    #[must_use]
    pub fn system(&self) -> &S {
        &self.system
    }
}

/// A Lagrangian that is written once over a generic scalar.
pub trait ClosedForm: Sync {
    /// L(q, q̇), J, over any scalar.
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D;
}

/// A Lagrangian that takes dual and hyper-dual numbers, from which its derivatives follow.
pub trait OverDuals: Sync {
    /// L(q, q̇), J, with its slope along one direction.
    fn with_slope(&self, q: &[Dual64], qd: &[Dual64]) -> Dual64;

    /// L(q, q̇), J, with its slopes along two directions and the second derivative along both.
    fn with_curvature(&self, q: &[HyperDual64], qd: &[HyperDual64]) -> HyperDual64;
}

impl<S: ClosedForm> OverDuals for S {
    fn with_slope(&self, q: &[Dual64], qd: &[Dual64]) -> Dual64 {
        self.value(q, qd)
    }

    fn with_curvature(&self, q: &[HyperDual64], qd: &[HyperDual64]) -> HyperDual64 {
        self.value(q, qd)
    }
}

impl<S: System> ClosedForm for S {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        self.lagrangian(q, qd)
    }
}

impl<S: System> Lagrangian for Analytic<S> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DualJets::new(&self.system, self.coordinates.dof()))
    }
}

impl<S: System> Model for Analytic<S> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(EulerLagrange::new(self, None))
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        Some(EulerLagrange::new(self, None))
    }
}

impl<S: System> AnalyticModel for Analytic<S> {
    fn name(&self) -> &str {
        S::NAME
    }

    fn lagrangian(&self) -> &dyn Lagrangian {
        self
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        self.system.sample_state(rng)
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        self.system.sample_start(rng)
    }
}

/// Derivatives of a Lagrangian in closed form; holds the state (q, q̇) as dual and as hyper-dual numbers, `[2 n]` each.
pub struct DualJets<'a, S> {
    system: &'a S,
    first: Vec<Dual64>,
    second: Vec<HyperDual64>,
}

impl<S: OverDuals> Jets for DualJets<'_, S> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let n = self.first.len() / 2;
        let m = q.len() / n;
        jet.resize(m, n);
        for k in 0..m {
            let state = k * n..(k + 1) * n;
            self.gradient(
                &q[state.clone()],
                &qd[state.clone()],
                &mut jet.dl_dq[state.clone()],
            );
            jet.lagrangian[k] = self.momentum(
                &mut jet.momentum[state.clone()],
                &mut jet.momentum_drift[state.clone()],
                &qd[state],
            );
            self.mass_matrix(&mut jet.mass_matrix[k * n * n..(k + 1) * n * n]);
        }
    }

    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        let n = self.first.len() / 2;
        let m = q.len() / n;
        curvature.resize(m, n);
        for k in 0..m {
            let (state, block) = (k * n..(k + 1) * n, k * n * n..(k + 1) * n * n);
            let values = q[state.clone()].iter().chain(&qd[state]);
            for (x, &value) in self.second.iter_mut().zip(values) {
                *x = HyperDual64::from_re(value);
            }
            self.second_by(0, &mut curvature.dl_dqdq[block.clone()]);
            self.second_by(n, &mut curvature.dp_dq[block]);
        }
    }
}

impl<'a, S: OverDuals> DualJets<'a, S> {
    /// Evaluator for `system`, which has `n` coordinates.
    pub fn new(system: &'a S, n: usize) -> Self {
        Self {
            system,
            first: vec![Dual64::from_re(0.0); 2 * n],
            second: vec![HyperDual64::from_re(0.0); 2 * n],
        }
    }

    /// ∂L/∂q, one direction eᵢ of q at a time; copies the state to the scratch memory.
    fn gradient(&mut self, q: &[f64], qd: &[f64], dl_dq: &mut [f64]) {
        let n = q.len();
        for (i, &x) in q.iter().chain(qd).enumerate() {
            self.first[i] = Dual64::from_re(x);
            self.second[i] = HyperDual64::from_re(x);
        }
        for (i, slope) in dl_dq.iter_mut().enumerate() {
            self.first[i].eps = 1.0;
            let (q, qd) = self.first.split_at(n);
            *slope = self.system.with_slope(q, qd).eps;
            self.first[i].eps = 0.0;
        }
    }

    /// p and (∂p/∂q) q̇ from t₁ = eᵢ of q̇ and t₂ = q̇ along q; returns L.
    fn momentum(&mut self, momentum: &mut [f64], drift: &mut [f64], along: &[f64]) -> f64 {
        let n = along.len();
        let mut value = 0.0;
        (0..n).for_each(|i| self.second[i].eps2 = along[i]);
        for i in 0..n {
            self.second[n + i].eps1 = 1.0;
            let (q, qd) = self.second.split_at(n);
            let l = self.system.with_curvature(q, qd);
            (value, momentum[i], drift[i]) = (l.re, l.eps1, l.eps1eps2);
            self.second[n + i].eps1 = 0.0;
        }
        (0..n).for_each(|i| self.second[i].eps2 = 0.0);
        value
    }

    /// ∂²L/∂xᵢ∂qⱼ from t₁ = eᵢ of x, which begins at `first` (q or q̇), and t₂ = eⱼ of q, at the state in the scratch memory.
    fn second_by(&mut self, first: usize, out: &mut [f64]) {
        let n = self.second.len() / 2;
        for i in 0..n {
            self.second[first + i].eps1 = 1.0;
            for j in 0..n {
                self.second[j].eps2 = 1.0;
                let (q, qd) = self.second.split_at(n);
                out[i * n + j] = self.system.with_curvature(q, qd).eps1eps2;
                self.second[j].eps2 = 0.0;
            }
            self.second[first + i].eps1 = 0.0;
        }
    }

    /// M from t₁ = eᵢ and t₂ = eⱼ of q̇.
    fn mass_matrix(&mut self, mass_matrix: &mut [f64]) {
        let n = self.second.len() / 2;
        for i in 0..n {
            self.second[n + i].eps1 = 1.0;
            for j in i..n {
                self.second[n + j].eps2 = 1.0;
                let (q, qd) = self.second.split_at(n);
                let m = self.system.with_curvature(q, qd).eps1eps2;
                (mass_matrix[i * n + j], mass_matrix[j * n + i]) = (m, m);
                self.second[n + j].eps2 = 0.0;
            }
            self.second[n + i].eps1 = 0.0;
        }
    }
}
