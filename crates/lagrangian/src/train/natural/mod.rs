//! Natural gradient (Gauss–Newton, Levenberg–Marquardt) in the space of samples, with momentum.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | r | residuals of the batch, of order one | N |
//! | J | ∂r/∂θ, never formed | N × P |
//! | φ | direction of the step, kept as momentum | P |
//! | μ, λ, η | momentum, damping, rate | |
//!
//! φ ← μ φ + Jᵀ (J Jᵀ + λ N I)⁻¹ (r − μ J φ), θ ← θ − η φ (theory.md, equations 19 and 20; SPRING: Goldshlager,
//! Abrahamsen, Lin 2024, arXiv 2401.10190). The problem defines J.

mod config;
mod damping;
mod part;
mod system;

pub use config::NaturalConfig;
pub use damping::DampingRule;
pub use part::Part;
pub use system::System;

use super::problem::{LeastSquares, LossValue, ResidualSize};

/// The rate and the damping of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSize {
    /// The rate η.
    pub rate: f64,
    /// The damping λ.
    pub damping: f64,
}

/// The natural gradient with its momentum.
#[allow(
    missing_debug_implementations,
    reason = "the memory of the solver has nothing to show"
)]
pub struct Natural {
    /// The direction φ.
    pub phi: Vec<f64>,
    system: System,
    /// λ N of the last step.
    damped: f64,
}

impl Natural {
    /// The natural gradient without momentum for a problem with this number of parameters.
    #[must_use]
    pub fn new(parameters: usize) -> Self {
        Self {
            phi: vec![0.0; parameters],
            system: System::new(),
            damped: 0.0,
        }
    }

    /// Takes a step and returns the loss before it. Where the system of a batch cannot be solved, the parameters stay and the
    /// momentum is reset.
    ///
    /// `theta` may be longer than φ: its last parameters belong to single samples, and the problem moves them.
    pub fn step(
        &mut self,
        problem: &mut dyn LeastSquares,
        config: &NaturalConfig,
        size: StepSize,
        theta: &mut [f64],
    ) -> LossValue {
        self.step_in_parts(problem, config, size, theta, &mut |_| ())
    }

    /// Takes a [`Natural::step`] and calls `done` at the end of each of its parts.
    pub fn step_in_parts(
        &mut self,
        problem: &mut dyn LeastSquares,
        config: &NaturalConfig,
        size: StepSize,
        theta: &mut [f64],
        done: &mut dyn FnMut(Part),
    ) -> LossValue {
        let seen = problem.residuals(theta);
        done(Part::Forward);
        problem.linearise(&self.phi);
        done(Part::Backward);
        let damping = damping_of_batch(config, size.damping, seen);
        let count = problem.products(damping, &mut self.system);
        done(Part::Products);
        self.damped = damping * count as f64;
        let solved = self.system.damp_and_solve(self.damped, config.momentum);
        done(Part::Solve);
        if !solved {
            self.phi.fill(0.0);
            return seen.loss;
        }
        self.phi.iter_mut().for_each(|x| *x *= config.momentum);
        problem.pull_back(self.system.solution(), &mut self.phi);
        done(Part::PullBack);
        let rate = self.advance(config, size.rate, theta);
        problem.settle(theta, rate);
        done(Part::Update);
        seen.loss
    }

    /// θ ← θ − η φ; returns η as shortened.
    fn advance(&mut self, config: &NaturalConfig, rate: f64, theta: &mut [f64]) -> f64 {
        let length = rate * self.phi.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !length.is_finite() {
            self.phi.fill(0.0);
            return 0.0;
        }
        let rate = if length > config.longest {
            rate * config.longest / length
        } else {
            rate
        };
        let pairs = theta.iter_mut().zip(&self.phi);
        pairs.for_each(|(theta, x)| *theta -= rate * x);
        rate
    }

    /// The ratio of the decrease of the loss to the decrease that the quadratic model predicted for the last step.
    pub(super) fn gain(&self, rate: f64, change: Change) -> f64 {
        let before = change.before.mean();
        let predicted =
            before - self.predicted(rate) / change.before.count.max(1) as f64 / change.unit;
        (before - change.after.mean()) / predicted.max(f64::MIN_POSITIVE)
    }

    /// The sum of squares that the quadratic model predicts after a step at `rate`: with
    /// x = (J Jᵀ + λ N I)⁻¹ (r − μ J φ), J φ after the step is r − λ N x whatever the momentum.
    fn predicted(&self, rate: f64) -> f64 {
        let pairs = self.system.residual.iter().zip(self.system.solution());
        pairs
            .map(|(r, x)| ((1.0 - rate) * r + rate * self.damped * x).powi(2))
            .sum()
    }
}

/// The change of the loss of a batch by a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    pub(super) before: LossValue,
    pub(super) after: LossValue,
    /// The unit of the squares: mean |r| where absolute values are minimised, else 1.
    pub(super) unit: f64,
}

/// λ of a batch: far from the solution the quadratic model is poor; near it, only damping slows the step.
fn damping_of_batch(config: &NaturalConfig, damping: f64, seen: ResidualSize) -> f64 {
    let damping = config.damping_rule.on_batch(damping, seen.mean_square);
    damping * seen.level.min(1.0).sqrt()
}
