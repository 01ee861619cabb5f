//! The interface of optimisers: problems of least squares, and losses with a gradient, both independent of a model.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | θ | parameters | P, followed by the parameters of single samples |
//! | r | residuals of a batch, of order one | N |
//! | J | ∂r/∂θ, never formed | N × P |
//! | φ | a direction in the space of the parameters | P |

use std::ops::Add;

use nets::simd::AdamRule;

use super::checkpoint::Checkpoint;
use lagrangian_motion::Samples;

/// The samples of a step.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// The samples that the indices refer to.
    pub samples: &'a Samples,
    /// The indices of the samples of this step.
    pub indices: &'a [usize],
}

/// The step that a run takes.
#[derive(Debug, Clone, Copy)]
pub struct StepAt<'a> {
    /// The number of steps before it.
    pub step: usize,
    /// The part of the budget that is used.
    pub part: f64,
    /// The samples of the step.
    pub batch: Batch<'a>,
}

/// The value of a loss on a batch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LossValue {
    /// The sum over samples and residuals.
    pub sum: f64,
    /// The number of terms in the sum.
    pub count: usize,
    /// The number of samples that were omitted for a singular mass matrix.
    pub singular: usize,
}

impl LossValue {
    /// The mean; NaN without terms.
    #[must_use]
    pub fn mean(self) -> f64 {
        if self.count == 0 {
            f64::NAN
        } else {
            self.sum / self.count as f64
        }
    }
}

/// The loss on both batches together.
impl Add for LossValue {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            count: self.count + other.count,
            singular: self.singular + other.singular,
        }
    }
}

/// The size of the residuals of a batch.
#[derive(Debug, Clone, Copy)]
pub struct ResidualSize {
    /// The loss.
    pub loss: LossValue,
    /// The mean of |r|.
    pub level: f64,
    /// The mean of r² of the weighted residuals.
    pub mean_square: f64,
}

/// A nonlinear problem of least squares over the batch of a step.
///
/// An optimiser calls the methods in the order of their declaration.
pub trait LeastSquares {
    /// Evaluates the residuals r at θ.
    fn residuals(&mut self, theta: &[f64]) -> ResidualSize;

    /// Linearises the residuals at θ, and evaluates J φ.
    fn linearise(&mut self, phi: &[f64]);

    /// Writes the lower triangle of J Jᵀ, r and J φ to `system`, and returns N. Rows that do not depend on any parameter may
    /// be omitted, but count in N. J Jᵀ may be rounded to single precision where the damping λ exceeds the rounding.
    fn products(&mut self, damping: f64, system: &mut super::System) -> usize;

    /// Adds Jᵀ x to φ.
    fn pull_back(&mut self, x: &[f64], phi: &mut [f64]);

    /// Ends a step θ ← θ − `rate` φ: moves the parameters of single samples, and projects θ onto its domain.
    fn settle(&mut self, theta: &mut [f64], rate: f64);
}

/// A loss with a gradient, which keeps parameters and moments in the layout of its kernels.
pub trait Differentiable {
    /// Takes parameters and moments from the state of a run.
    fn load(&mut self, state: &Checkpoint);

    /// Writes parameters and moments to the state of a run.
    fn save(&self, state: &mut Checkpoint);

    /// Evaluates the loss on the batch of step `at` and its gradient.
    fn gradient(&mut self, at: &StepAt<'_>) -> GradientSize;

    /// Takes a step by a rule along the gradient that was evaluated last.
    fn descend(&mut self, rule: &AdamRule);
}

/// The size of a gradient.
#[derive(Debug, Clone, Copy)]
pub struct GradientSize {
    /// The loss.
    pub loss: LossValue,
    /// The sum of squares of the gradient.
    pub squares: f64,
}
