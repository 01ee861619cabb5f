//! The refinement of the coefficients of a formula: its balance of forces is linear in them.

use super::{FormulaShape, along};
use crate::models::NetworkShape;
use crate::models::setup::NetworkLearner;
use crate::train::{At, Learner, LearnerShape, Work};
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};
use num_dual::Dual64;

/// A [`Formula`](super::Formula) in training: raw output i is Σ c (d/dt ∂/∂q̇ᵢ − ∂/∂qᵢ) term. It predicts accelerations.
///
/// Features are the balances of the terms: component i holds those of coordinate i, component n + i n + j their inertia at (i, j).
pub(crate) type FormulaLearner<'a> = NetworkLearner<'a, FormulaShape>;

impl<T: Real> Learner<T> for FormulaLearner<'_> {
    fn facts(&self) -> LearnerShape<'_> {
        let n = self.shape.dof();
        LearnerShape {
            // A pass has two components more than directions.
            directions: n + n * n - 2,
            ..self.shape_of(n, n)
        }
    }

    fn terms(&self) -> Terms {
        Terms::new((0..self.shape.dof()).map(|i| vec![(0, i)]).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        work.linear.singular = 0;
        work.evaluate_nominal(self.nominal);
        self.write(work, None);
        work.pass.forward(&shape.net, packed, Some(n + n * n - 2));
        for s in 0..work.pass.samples() {
            let found = |c: usize| work.pass.output(&shape.net, c, s, 0).f64();
            let (bias, mass): (Vec<f64>, Vec<f64>) = (
                (0..n).map(found).collect(),
                (n..n + n * n).map(found).collect(),
            );
            work.mechanics.jet.mass_matrix[s * n * n..][..n * n].copy_from_slice(&mass);
            work.mechanics.jet.momentum_drift[s * n..][..n].copy_from_slice(&bias);
            work.mechanics.jet.dl_dq[s * n..][..n].fill(0.0);
            work.add_nominal_mass(s);
            work.force(&self.forces, extra, (s, At::Rest), 1.0);
            work.hold(&shape.coordinates, s);
            self.residual_of_jet(s, work, 1.0);
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        self.write_motion(work);
        for s in 0..work.pass.samples() {
            for k in 0..shape.net.features {
                let each = (0..n).map(|i| {
                    work.adjoint.lambda[s * n + i].f64() * work.pass.feature(i, s, k).f64()
                });
                let sum: f64 = each.sum();
                work.pass.set_feature(0, s, k, T::of(sum));
            }
        }
        work.pass.reverse_outputs(&shape.net, packed, 1);
        work.pass.add_products(&shape.net, &[(0, 0)], gradient);
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        self.write_motion(work);
        work.pass.reverse_outputs(&self.shape.net, packed, 1);
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (shape, n) = (self.shape, self.shape.dof());
        work.pass.reverse_features(&shape.net, packed, 0..1);
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * n).enumerate() {
            slopes.fill(0.0);
            let [q, qd] = [&work.states.q, &work.states.qd].map(|x| &x[s * n..][..n]);
            let qdd: Vec<Dual64> = work.linear.along[s * n..][..n]
                .iter()
                .map(|a| (*a).into())
                .collect();
            // A direction beyond the last component is none.
            let turned = |d: usize| (along(q, d), along(qd, d.wrapping_sub(n)));
            let directions: Vec<_> = (0..2 * n).map(turned).collect();
            for (k, (term, unit)) in shape.terms().enumerate() {
                let c = unit * work.pass.feature_sensitivity(0, s, k).f64();
                if c == 0.0 {
                    continue;
                }
                let position = term.position(&directions[n].0);
                for (d, (q, qd)) in directions.iter().enumerate() {
                    let balance = match d < n {
                        true => term.balance((q, qd), &qdd),
                        false => term.balance_at(&position, qd, &qdd),
                    };
                    for (i, own) in balance[..n].iter().enumerate() {
                        slopes[i * 2 * n + d] += c * own.eps;
                    }
                }
            }
            work.add_force_slopes(&self.forces, extra, (s, 1.0), slopes);
        }
    }
}

impl FormulaLearner<'_> {
    /// Writes the balances of the terms at the states of the block: at rest, with their inertia, or at these accelerations.
    fn write<T: Real>(&self, work: &mut Work<T>, at: Option<&[f64]>) {
        let n = self.shape.dof();
        let still = vec![0.0; n];
        for s in 0..work.pass.samples() {
            let (q, qd) = (&work.states.q[s * n..][..n], &work.states.qd[s * n..][..n]);
            let qdd = at.map_or(&*still, |at| &at[s * n..][..n]);
            for (k, (term, unit)) in self.shape.terms().enumerate() {
                let position = term.position(q);
                let (balance, value) = (term.balance_at(&position, qd, qdd), position.value);
                for (i, own) in balance.iter().enumerate().take(n) {
                    work.pass.set_feature(i, s, k, T::of(unit * own));
                    for j in (0..n).filter(|_| at.is_none()) {
                        let inertia = unit * value * term.by_speeds(i, j);
                        work.pass.set_feature(n + i * n + j, s, k, T::of(inertia));
                    }
                }
            }
        }
    }

    /// Writes the balances at the accelerations of the model.
    fn write_motion<T: Real>(&self, work: &mut Work<T>) {
        let along = std::mem::take(&mut work.linear.along);
        self.write(work, Some(&along));
        work.linear.along = along;
    }
}
