//! Training of plain networks.

use super::learner::{Learner, Loss, Work};
use crate::baseline::{Direction, MlpShape};
use crate::mlp::simd::Real;
use crate::mlp::{Gradient, Net, Packed};

/// An [`Mlp`](crate::baseline::Mlp) in training: r = w (scale · N(x) − y), D = w · scale, y = q̈ forward, τ inverse.
#[derive(Debug)]
pub(crate) struct MlpLearner<'a> {
    pub(crate) shape: &'a MlpShape,
    pub(crate) loss: Loss,
    /// Weight of each coordinate's residual, `[n]`.
    pub(crate) weights: &'a [f64],
}

impl<T: Real> Learner<T> for MlpLearner<'_> {
    fn net(&self) -> &Net {
        &self.shape.net
    }
    fn dof(&self) -> usize {
        self.shape.dof()
    }
    fn room(&self) -> usize {
        // The sensitivities of n outputs stand in the first n components.
        self.shape.dof().div_ceil(2)
    }

    fn terms(&self) -> Vec<Vec<(usize, usize)>> {
        (0..self.shape.dof()).map(|i| vec![(i, 0)]).collect()
    }

    fn loss(&self) -> (Loss, &[f64]) {
        (self.loss, self.weights)
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, _extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        let (third, target) = match shape.config.direction {
            Direction::Forward => (&work.tau, &work.qdd),
            Direction::Inverse => (&work.qdd, &work.tau),
        };
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            shape.write(
                &mut work.pass,
                s,
                &work.q[row.clone()],
                &work.qd[row.clone()],
                &third[row],
            );
        }
        work.pass.forward(&shape.net, packed, None);
        for s in 0..work.pass.samples() {
            for i in 0..n {
                let scale = shape.output_scale()[i] * self.weights[i];
                let at = s * n + i;
                let found = work.pass.output(&shape.net, 0, s, i).f64();
                work.residual[at] = scale * found - self.weights[i] * target[at];
                for j in 0..n {
                    work.mix[at * n + j] = if i == j { scale } else { 0.0 };
                }
            }
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        work.pass
            .reverse_weighted(&self.shape.net, packed, self.shape.dof(), &work.lambda);
        work.pass.add_products(&self.shape.net, &[(0, 0)], gradient);
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        work.pass
            .reverse_outputs(&self.shape.net, packed, self.shape.dof());
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        _extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (shape, n) = (self.shape, self.shape.dof());
        work.pass.reverse_features(&shape.net, packed, 0..n);
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * n).enumerate() {
            shape.slopes(&work.pass, s, &work.q[s * n..][..n], slopes);
        }
    }
}
