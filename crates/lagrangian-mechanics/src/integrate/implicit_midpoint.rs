//! The implicit midpoint rule.

use super::fixed_point::{Convergence, MAX_ITERATIONS};
use super::{Failure, SecondOrder, Stepped};

/// The implicit midpoint rule, order 2, time-reversible, A-stable, fixed step:
///
///   a = f(t + h/2, q + h/2 v̄, v̄),   v̄ = v + h/2 a;   q ← q + h v̄,   v ← v + h a.
///
/// It conserves every quadratic invariant of the motion exactly and is symplectic where M is constant. Solved
/// by fixed-point iteration, which converges for h²/4 ‖∂f/∂q‖ + h/2 ‖∂f/∂v‖ < 1: for stiffer motion take a
/// smaller step. Hairer, Lubich, Wanner, Geometric Numerical Integration, sections II.1 and IV.2.
#[derive(Debug, Clone)]
pub struct ImplicitMidpoint {
    acceleration: Vec<f64>,
    next: Vec<f64>,
    middle: Vec<f64>,
}

impl ImplicitMidpoint {
    /// The method for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            acceleration: vec![0.0; n],
            next: vec![0.0; n],
            middle: vec![0.0; 2 * n],
        }
    }

    /// One step of size h of x = (q, v), in place.
    ///
    /// # Errors
    /// [`Failure::NotConverged`] where the step was not solved, [`Failure::NotFinite`] where f is not finite.
    pub fn step(&mut self, f: &mut SecondOrder<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let n = self.acceleration.len();
        self.solve_midpoint(f, t, h, x)?;
        for i in 0..n {
            x[i] += h * self.middle[n + i];
            x[n + i] += h * self.acceleration[i];
        }
        Ok(())
    }

    /// a = f at the midpoint that a leads to; the last step's a is the first guess.
    fn solve_midpoint(&mut self, f: &mut SecondOrder<'_>, t: f64, h: f64, x: &[f64]) -> Stepped {
        let n = self.acceleration.len();
        let mut convergence = Convergence::new();
        for _ in 0..MAX_ITERATIONS {
            let (q, v) = self.middle.split_at_mut(n);
            for i in 0..n {
                v[i] = x[n + i] + 0.5 * h * self.acceleration[i];
                q[i] = x[i] + 0.5 * h * v[i];
            }
            f(t + 0.5 * h, q, v, &mut self.next);
            if self.next.iter().any(|a| !a.is_finite()) {
                // A bad guess must not spoil the next step.
                self.acceleration.fill(0.0);
                return Err(Failure::NotFinite);
            }
            // The criterion is the change of h a compared with the velocity.
            let (mut change, mut size) = (0.0_f64, f64::MIN_POSITIVE);
            for (i, next) in self.next.iter().enumerate() {
                change = change.max(h * (next - self.acceleration[i]).abs());
                size = size.max((h * next).abs()).max(v[i].abs());
            }
            self.acceleration.copy_from_slice(&self.next);
            if convergence.is_reached(change, size) {
                return Ok(());
            }
        }
        Err(Failure::NotConverged)
    }
}
