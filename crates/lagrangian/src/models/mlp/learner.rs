//! Training of plain networks.

use super::{Direction, MlpShape};
use crate::models::NetworkShape;
use crate::models::setup::NetworkLearner;
use crate::train::{Learner, LearnerShape, Work};
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};

/// An [`Mlp`](crate::models::mlp::Mlp) in training: r = w (scale · N(x) − y), D = w · scale, y = q̈ forward, τ inverse,
/// (q̇, q̈) of a flow.
pub(crate) type MlpLearner<'a> = NetworkLearner<'a, MlpShape>;

impl<T: Real> Learner<T> for MlpLearner<'_> {
    fn facts(&self) -> LearnerShape<'_> {
        let outputs = self.shape.outputs();
        LearnerShape {
            // The sensitivities of the outputs are in the first components.
            directions: outputs.div_ceil(2),
            weights: self.weights,
            forces: None,
            ..self.shape_of(outputs, outputs)
        }
    }

    fn terms(&self) -> Terms {
        Terms::new((0..self.shape.outputs()).map(|i| vec![(i, 0)]).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, _extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        let outputs = shape.outputs();
        let third = match shape.config.direction {
            Direction::Inverse => &work.states.qdd,
            _ => &work.states.tau,
        };
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            shape.write(
                &mut work.pass,
                s,
                &work.states.q[row.clone()],
                &work.states.qd[row.clone()],
                &third[row],
            );
        }
        work.pass.forward(&shape.net, packed, None);
        for s in 0..work.pass.samples() {
            for i in 0..outputs {
                let target = match shape.config.direction {
                    Direction::Forward => work.states.qdd[s * n + i],
                    Direction::Inverse => work.states.tau[s * n + i],
                    Direction::Flow if i < n => work.states.qd[s * n + i],
                    Direction::Flow => work.states.qdd[s * n + i - n],
                };
                let scale = shape.output_scale(i) * self.weights[i];
                let at = s * outputs + i;
                let found = work.pass.output(&shape.net, 0, s, i).f64();
                work.linear.residual[at] = scale * found - self.weights[i] * target;
                for j in 0..outputs {
                    work.linear.d[at * outputs + j] = if i == j { scale } else { 0.0 };
                }
            }
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        work.pass.reverse_weighted(
            &self.shape.net,
            packed,
            self.shape.outputs(),
            &work.adjoint.lambda,
        );
        work.pass.add_products(&self.shape.net, &[(0, 0)], gradient);
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        work.pass
            .reverse_outputs(&self.shape.net, packed, self.shape.outputs());
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        _extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (shape, n) = (self.shape, self.shape.dof());
        let outputs = shape.outputs();
        work.pass.reverse_features(&shape.net, packed, 0..outputs);
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * outputs).enumerate() {
            shape.slopes(&work.pass, s, &work.states.q[s * n..][..n], slopes);
        }
    }
}
