//! What optimisers know: problems of least squares, and losses with a gradient. Neither knows a model.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | θ | parameters | P, and behind them what belongs to single samples |
//! | r | residuals of a batch, of order one | N |
//! | J | ∂r/∂θ, never formed | N × P |
//! | φ | a direction in the space of the parameters | P |

use std::ops::Add;

use nets::simd::AdamRule;

use super::batch::Samples;
use super::checkpoint::Checkpoint;

/// Samples of a step.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// All samples.
    pub samples: &'a Samples,
    /// The indices of those of this step.
    pub indices: &'a [usize],
}

/// Where a run is when it takes a step.
#[derive(Debug, Clone, Copy)]
pub struct StepAt<'a> {
    /// Steps done.
    pub step: usize,
    /// The part of the budget that is used.
    pub part: f64,
    /// The samples whose turn it is.
    pub batch: Batch<'a>,
}

/// The value of a loss on a batch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LossValue {
    /// The sum over samples and residuals.
    pub sum: f64,
    /// The number of terms in the sum.
    pub count: usize,
    /// Samples that were left out for a singular mass matrix.
    pub singular: usize,
}

impl LossValue {
    /// The mean; NaN of nothing.
    #[must_use]
    pub fn mean(self) -> f64 {
        if self.count == 0 {
            f64::NAN
        } else {
            self.sum / self.count as f64
        }
    }
}

/// The value on both batches together.
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

/// The residuals of a batch in figures.
#[derive(Debug, Clone, Copy)]
pub struct ResidualSize {
    /// The loss.
    pub loss: LossValue,
    /// Mean |r|.
    pub level: f64,
    /// Mean r², of the residuals as they are weighted.
    pub mean_square: f64,
}

/// A nonlinear problem of least squares over the batch of a step.
///
/// An optimiser calls the methods in the order in which they stand.
pub trait LeastSquares {
    /// Evaluates the residuals r at θ.
    fn residuals(&mut self, theta: &[f64]) -> ResidualSize;

    /// Linearises the residuals there, and evaluates J φ.
    fn linearise(&mut self, phi: &[f64]);

    /// Writes the lower triangle of J Jᵀ, r and J φ to `system`, and returns N. Rows that no parameter changes may be
    /// omitted, but count in N. Where λ = `damping` hides it, J Jᵀ may be rounded to single precision.
    fn products(&mut self, damping: f64, system: &mut super::System) -> usize;

    /// Adds Jᵀ x to φ.
    fn pull_back(&mut self, x: &[f64], phi: &mut [f64]);

    /// Ends a step θ ← θ − `rate` φ: moves what belongs to single samples, and brings θ back into its domain.
    fn settle(&mut self, theta: &mut [f64], rate: f64);
}

/// A loss with a gradient, whose parameters and moments are kept as its kernels want them.
pub trait Differentiable {
    /// Takes parameters and moments from the state of a run.
    fn load(&mut self, state: &Checkpoint);

    /// Gives them back.
    fn save(&self, state: &mut Checkpoint);

    /// Evaluates the loss of the batch of step `at` and its gradient.
    fn gradient(&mut self, at: &StepAt<'_>) -> GradientSize;

    /// Descends by a rule along the gradient that was evaluated last.
    fn descend(&mut self, rule: &AdamRule);
}

/// A gradient in figures.
#[derive(Debug, Clone, Copy)]
pub struct GradientSize {
    /// The loss.
    pub loss: LossValue,
    /// The sum of squares of the gradient.
    pub squares: f64,
}
