//! The classical Runge–Kutta method.

use super::{FirstOrder, Stepped};

/// The classical Runge–Kutta method of order 4 (Kutta 1901): four evaluations a step, fixed step.
#[derive(Debug, Clone)]
pub struct Rk4 {
    slope: Vec<f64>,
    stage: Vec<f64>,
    sum: Vec<f64>,
}

impl Rk4 {
    /// The node of each stage, which is also the distance along the slope of the stage before it, and the weight of its slope in
    /// sixths (theory.md, equation 97).
    pub const STAGES: [(f64, f64); 4] = [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)];

    /// The method for states of `n` components.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            slope: vec![0.0; n],
            stage: vec![0.0; n],
            sum: vec![0.0; n],
        }
    }

    /// One step of size h, in place.
    ///
    /// # Errors
    /// Never; a state that is not finite is written to `x`.
    pub fn step(&mut self, f: &mut FirstOrder<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        self.stage.copy_from_slice(x);
        self.sum.copy_from_slice(x);
        for (stage, (node, weight)) in Self::STAGES.into_iter().enumerate() {
            let next = Self::STAGES.get(stage + 1).map_or(0.0, |(node, _)| *node);
            f(t + node * h, &self.stage, &mut self.slope);
            for (i, k) in self.slope.iter().enumerate() {
                self.sum[i] += h * weight / 6.0 * k;
                self.stage[i] = x[i] + h * next * k;
            }
        }
        x.copy_from_slice(&self.sum);
        Ok(())
    }
}
