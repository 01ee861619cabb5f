//! The values of the maps, by the evaluator of the model.

use super::{Inputs, Layer, Map, undefined};
use crate::train::rollout::rk4::STAGES;
use lagrangian_mechanics::dynamics::{Evaluation, Evaluator, Model};
use lagrangian_mechanics::hamiltonian::HamiltonianJet;
use lagrangian_mechanics::lagrangian::Jet;
use lagrangian_motion::{Error, Result};

impl Layer {
    /// The value of `map` at `m` states, `[m, width]`: n values each of accelerations and forces, 2n of rates and steps, one of
    /// the scalar.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`] for inputs that are not states; [`Error::Setting`] for a map that the model does
    /// not have, and where it has no finite value or a singular mass matrix; [`Error::Argument`] for a step that is not a time.
    pub fn evaluate(&self, map: Map, inputs: &Inputs<'_>) -> Result<Vec<f64>> {
        let m = self.states(inputs)?;
        let mut values = vec![0.0; m * self.width(map)];
        if m == 0 {
            return Ok(values);
        }
        let still = vec![
            0.0;
            if inputs.u.is_empty() {
                inputs.q.len()
            } else {
                0
            }
        ];
        let u = if inputs.u.is_empty() {
            &still
        } else {
            inputs.u
        };
        let mut evaluator = self.model.evaluator();
        let outcome = match map {
            Map::Acceleration if !self.is_second_order() => Evaluation::Unsupported,
            Map::Acceleration => evaluator.forward_dynamics(inputs.q, inputs.v, u, &mut values),
            Map::Force if !self.is_second_order() => Evaluation::Unsupported,
            Map::Force => evaluator.inverse_dynamics(inputs.q, inputs.v, u, &mut values),
            Map::Rates => self.rates(&mut *evaluator, &self.joined(inputs), u, &mut values),
            Map::Step(h) => {
                let mut x = self.joined(inputs);
                let outcome = self.step(&mut *evaluator, check_step(h)?, u, &mut x);
                values = x;
                outcome
            }
            Map::Scalar => {
                let scalar = self.scalar(inputs)?;
                values = scalar.value;
                Evaluation::of(&values, 1, 0)
            }
        };
        self.checked(map, outcome, &values)?;
        Ok(values)
    }

    /// Refuses an evaluation that has no value.
    fn checked(&self, map: Map, outcome: Evaluation, values: &[f64]) -> Result<()> {
        match outcome {
            Evaluation::Unsupported => Err(self.unsupported(map)),
            Evaluation::NotFinite { state, .. } => Err(undefined("value", state)),
            Evaluation::Singular { states } => Err(Error::setting(
                format!("the mass matrix of the layer is singular at {states} states"),
                "leave these states out, or take a family whose mass matrix is positive definite (delan)",
            )),
            Evaluation::Regular => {
                let unbounded = values.iter().position(|x| !x.is_finite());
                unbounded.map_or(Ok(()), |at| Err(undefined("value", at / self.width(map))))
            }
        }
    }

    /// Whether dq/dt = v whatever the parameters.
    pub(super) fn is_second_order(&self) -> bool {
        self.model.evaluator().phase_flow().is_none()
    }

    /// The states (q, v) of some inputs, `[m, 2n]`.
    pub(super) fn joined(&self, inputs: &Inputs<'_>) -> Vec<f64> {
        let n = self.coordinates().dof();
        let rows = inputs.q.chunks_exact(n).zip(inputs.v.chunks_exact(n));
        rows.flat_map(|(q, v)| q.iter().chain(v)).copied().collect()
    }

    /// Writes (dq/dt, dv/dt) of the states x, `[m, 2n]`.
    fn rates(
        &self,
        evaluator: &mut dyn Evaluator,
        x: &[f64],
        tau: &[f64],
        rates: &mut [f64],
    ) -> Evaluation {
        let n = self.coordinates().dof();
        let half = |first: usize| -> Vec<f64> {
            x.chunks_exact(2 * n)
                .flat_map(|x| &x[first..first + n])
                .copied()
                .collect()
        };
        let (q, v) = (half(0), half(n));
        let (mut dq, mut dv) = (v.clone(), vec![0.0; v.len()]);
        let outcome = match evaluator.phase_flow() {
            Some(phase) => phase.flow(&q, &v, tau, &mut dq, &mut dv),
            None => evaluator.forward_dynamics(&q, &v, tau, &mut dv),
        };
        for (s, row) in rates.chunks_exact_mut(2 * n).enumerate() {
            row[..n].copy_from_slice(&dq[s * n..][..n]);
            row[n..].copy_from_slice(&dv[s * n..][..n]);
        }
        outcome
    }

    /// Moves the states x by a step (theory.md, equation 97).
    fn step(
        &self,
        evaluator: &mut dyn Evaluator,
        h: f64,
        tau: &[f64],
        x: &mut [f64],
    ) -> Evaluation {
        let start = x.to_vec();
        let (mut at, mut rates) = (start.clone(), vec![0.0; x.len()]);
        for (a, b) in STAGES {
            for ((at, start), rate) in at.iter_mut().zip(&start).zip(&rates) {
                *at = start + a * h * rate;
            }
            let outcome = self.rates(evaluator, &at, tau, &mut rates);
            if outcome != Evaluation::Regular {
                return outcome;
            }
            x.iter_mut()
                .zip(&rates)
                .for_each(|(x, rate)| *x += b * h * rate);
        }
        Evaluation::of(x, 2 * self.coordinates().dof(), 0)
    }

    /// L(q, q̇) or H(q, p) and its slopes.
    pub(super) fn scalar(&self, inputs: &Inputs<'_>) -> Result<Scalar> {
        let (q, v) = (inputs.q, inputs.v);
        if let Some(hamiltonian) = self.model.hamiltonian() {
            let mut jet = HamiltonianJet::default();
            let mut jets = hamiltonian.jets();
            let outcome = jets.value(q, v, &mut vec![0.0; q.len() / self.coordinates().dof()]);
            if !outcome.is_supported() {
                return Err(self.unsupported(Map::Scalar));
            }
            jets.jet(q, v, &mut jet);
            return Ok(Scalar {
                value: jet.hamiltonian,
                by_q: jet.dh_dq,
                by_v: jet.velocity,
            });
        }
        let lagrangian = self.model.lagrangian();
        let lagrangian = lagrangian.ok_or_else(|| self.unsupported(Map::Scalar))?;
        let mut jet = Jet::default();
        lagrangian.jets().jet(q, v, &mut jet);
        Ok(Scalar {
            value: jet.lagrangian,
            by_q: jet.dl_dq,
            by_v: jet.momentum,
        })
    }
}

/// A learned scalar of states (q, v) and its slopes.
pub(super) struct Scalar {
    /// The value of each state, `[m]`.
    pub(super) value: Vec<f64>,
    /// The slope by q, `[m, n]`.
    pub(super) by_q: Vec<f64>,
    /// The slope by v, `[m, n]`.
    pub(super) by_v: Vec<f64>,
}

/// Refuses a step that is not a time.
pub(super) fn check_step(h: f64) -> Result<f64> {
    match h.is_finite() {
        true => Ok(h),
        false => Err(Error::argument("step", h, "finite, in seconds")),
    }
}
