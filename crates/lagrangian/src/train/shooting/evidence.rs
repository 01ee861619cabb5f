//! Precisions of groups of parameters by the evidence (MacKay 1992).

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use crate::train::learner::Learner;
use nets::Kind;

/// Groups of parameters, each with a normal prior of its own precision around zero: the weights of a hidden layer, its biases,
/// the weights of each output, its bias, and each parameter of a force.
pub(super) struct Groups {
    /// The group of each parameter.
    group: Vec<usize>,
    /// The number of parameters of each group.
    sizes: Vec<f64>,
    /// α.
    precision: Vec<f64>,
}

/// The largest change of a precision at once.
const CHANGE: f64 = 10.0;

/// The least mean square of the parameters of a group in the metric of steps, in units of weights of normalised layers.
const LEAST: f64 = 1e-2;

/// The part of the parameters that the data are taken to determine at first.
const DETERMINED: f64 = 0.1;

impl Groups {
    pub(super) fn of(learner: &dyn Learner<f64>, theta: &[f64]) -> Self {
        let net = learner.net();
        let (mut group, mut count) = (vec![0; theta.len()], 0);
        let mut add = |at: usize, rows: usize, width: usize, each: bool| {
            for row in 0..rows {
                group[at + row * width..][..width].fill(count);
                count += usize::from(each || row + 1 == rows);
            }
        };
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let each = net.outputs.contains(&l);
            let matrices = inputs
                .iter()
                .filter(|i| i.width > 0)
                .map(|i| (i.at, i.width));
            for (at, width) in matrices.chain(bias.map(|at| (at, 1))) {
                add(at, layer.width, width, each);
            }
        }
        add(net.parameters, theta.len() - net.parameters, 1, true);
        let mut groups = Self {
            group,
            sizes: vec![0.0; count],
            precision: vec![0.0; count],
        };
        groups.sizes = groups.sums(|_| 1.0);
        let metric = groups.metric(theta);
        for (g, metric) in groups.group.iter().zip(metric) {
            groups.precision[*g] = DETERMINED * metric;
        }
        groups
    }

    fn sums(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.sizes.len()];
        for (i, g) in self.group.iter().enumerate() {
            sums[*g] += of(i);
        }
        sums
    }

    /// α of each parameter.
    pub(super) fn precisions(&self) -> Vec<f64> {
        self.group.iter().map(|g| self.precision[*g]).collect()
    }

    /// One over the mean square of the group of each parameter: the metric in which steps are short.
    pub(super) fn metric(&self, theta: &[f64]) -> Vec<f64> {
        let squares = self.sums(|i| theta[i] * theta[i]);
        let each = |&g: &usize| 1.0 / (squares[g] / self.sizes[g]).max(LEAST);
        self.group.iter().map(each).collect()
    }

    /// α ← γ / |θ|² with γ = n − α tr (Jᵀ J/t + A)⁻¹ of each group; returns Σ γ. `matrix` is the lower triangle of Jᵀ J, t the
    /// variance of the residuals.
    pub(super) fn update(&mut self, matrix: &Mat<f64>, variance: f64, theta: &[f64]) -> f64 {
        let mut curvature = Mat::from_fn(theta.len(), theta.len(), |i, j| {
            matrix[if i < j { (j, i) } else { (i, j) }] / variance
        });
        for (i, a) in self.precisions().into_iter().enumerate() {
            curvature[(i, i)] += a;
        }
        let Ok(factor) = curvature.llt(Side::Lower) else {
            return theta.len() as f64;
        };
        let inverse = factor.inverse();
        let (traces, squares) = (
            self.sums(|i| inverse[(i, i)]),
            self.sums(|i| theta[i] * theta[i]),
        );
        let mut determined = 0.0;
        for (g, a) in self.precision.iter_mut().enumerate() {
            let gamma = (self.sizes[g] - *a * traces[g]).clamp(1e-3, self.sizes[g]);
            *a = (gamma / squares[g].max(1e-8)).clamp(*a / CHANGE, *a * CHANGE);
            determined += gamma;
        }
        determined
    }
}
