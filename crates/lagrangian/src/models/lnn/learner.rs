//! Training of Lagrangian networks: residuals by the Euler–Lagrange equation, gradients through it without the
//! derivative of its solve (theory.md, equations 15 and 16).

use super::LnnShape;
use crate::models::NetworkShape;
use crate::models::setup::NetworkLearner;
use crate::train::{At, Learner, LearnerShape, Work};
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};

/// An [`Lnn`](crate::models::lnn::Lnn) in training.
pub(crate) type LnnLearner<'a> = NetworkLearner<'a, LnnShape>;

impl<T: Real> Learner<T> for LnnLearner<'_> {
    fn facts(&self) -> LearnerShape<'_> {
        let n = self.shape.dof();
        self.shape_of(n, self.loss.residuals(n))
    }

    fn terms(&self) -> Terms {
        let n = self.shape.dof();
        let pairs = |i| vec![(0, 2 + n + i), (1, 2 + i), (2 + i, 1), (2 + n + i, 0)];
        Terms::of_value((0..n).map(pairs).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        let torque = self.loss.needs_forces();
        let at = if torque { At::Recorded } else { At::Rest };
        work.evaluate_nominal(self.nominal);
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            let qdd = torque.then(|| &work.states.qdd[row.clone()]);
            shape.write(
                &mut work.pass,
                s,
                &work.states.q[row.clone()],
                &work.states.qd[row],
                qdd,
            );
        }
        work.pass.forward_for_reverse(&shape.net, packed, n, 0);
        work.pass.reverse(&shape.net, packed, n);
        work.linear.singular = 0;
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            let qdd = torque.then(|| &work.states.qdd[row.clone()]);
            shape.read(
                &work.pass,
                (s, s),
                (&work.states.qd[row], qdd),
                &mut work.mechanics.jet,
            );
            work.add_nominal_mass(s);
            work.force(&self.forces, extra, (s, at), self.shape.scaling.energy);
            work.hold(&shape.coordinates, s);
            if torque {
                self.torque_residual(s, work)
            } else {
                self.residual_of_jet(s, work, self.shape.scaling.energy)
            }
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (net, n) = (&self.shape.net, self.shape.dof());
        let lambda = std::mem::take(&mut work.adjoint.lambda);
        self.set_motion(work);
        let along = &work.adjoint.lambda_along;
        work.pass.combine(net, n, along, Some(&lambda));
        self.carry_mixed(packed, work, 1, |s, _, i| lambda[s * n + i].f64());
        work.pass.add_gradient(net, gradient);
        work.adjoint.lambda = lambda;
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        let (net, n) = (&self.shape.net, self.shape.dof());
        self.set_motion(work);
        work.pass.combine(net, n, &work.adjoint.lambda_along, None);
        self.carry_mixed(packed, work, n, |_, d, i| f64::from(u8::from(d == i)));
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (net, n, pass) = (&self.shape.net, self.shape.dof(), &mut work.pass);
        pass.reverse_features(net, packed, 2..2 + n);
        pass.reverse_features(net, packed, pass.mixed(0)..pass.mixed(n));
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * n).enumerate() {
            self.shape.slopes(&work.pass, s, &work.states.qd, slopes);
            let energy = self.shape.scaling.energy;
            work.add_force_slopes(&self.forces, extra, (s, energy), slopes);
        }
    }
}

impl LnnLearner<'_> {
    /// Sets the accelerations along which S is taken in the precision of the network.
    fn set_motion<T: Real>(&self, work: &mut Work<T>) {
        let pairs = work.adjoint.lambda_along.iter_mut();
        let pairs = pairs.zip(&work.linear.along);
        pairs.for_each(|(t, &x)| *t = T::of(x));
    }

    /// Carries the mixed components of the scalars Σᵢ weight(s, d, i) Sᵢ, d < `directions`, forward and back.
    fn carry_mixed<T: Real>(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: impl Fn(usize, usize, usize) -> f64,
    ) {
        let (shape, n) = (self.shape, self.shape.dof());
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            let qdd = &self.motion(&work.states.qdd, &work.linear.along)[row.clone()];
            let state = (&work.states.qd[row], qdd);
            for d in 0..directions {
                let weights = &mut work.mechanics.scratch[..n];
                for (i, w) in weights.iter_mut().enumerate() {
                    *w = weight(s, d, i);
                }
                shape.write_mixed(&mut work.pass, (d, s), state, weights);
            }
        }
        work.pass.forward_mixed(&shape.net, packed, directions);
        work.pass.reverse_mixed(&shape.net, packed, directions);
    }

    /// The accelerations at which the balance is taken: the recorded ones, or those of the model.
    fn motion<'b>(&self, recorded: &'b [f64], predicted: &'b [f64]) -> &'b [f64] {
        if self.loss.needs_forces() {
            recorded
        } else {
            predicted
        }
    }

    /// r = w (M q̈ + c + d − τ), D = w E. The pass was along (q̇, q̈), so that the drift holds M q̈ as well,
    /// except for the kinetic term of the scaling.
    fn torque_residual<T: Real>(&self, s: usize, work: &mut Work<T>) {
        let n = self.shape.dof();
        for i in 0..n {
            let at = s * n + i;
            let inertia = self.shape.velocity(i, work.states.qd[at]).kinetic[2];
            let kinetic = self.shape.scaling.energy * self.shape.config.kinetic * inertia;
            let balance = work.mechanics.jet.momentum_drift[at] + kinetic * work.states.qdd[at]
                - work.mechanics.jet.dl_dq[at];
            work.linear.residual[at] = self.weights[i] * (balance + work.mechanics.scratch[n + i]);
            work.linear.along[at] = 0.0;
            for j in 0..n {
                work.linear.d[at * n + j] = if i == j {
                    self.weights[i] * self.shape.scaling.energy
                } else {
                    0.0
                };
            }
        }
    }
}
