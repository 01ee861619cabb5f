//! The implicit midpoint rule for any flow.

use super::{FirstOrder, Stepped, fixed_point};

/// The implicit midpoint rule, order 2, time-reversible, A-stable, fixed step, of x' = f(t, x):
///
///   x̄ = x + h/2 f(t + h/2, x̄),   x ← 2 x̄ − x.
///
/// Symplectic for every Hamiltonian H(q, p), and it conserves every quadratic invariant. Solved by fixed-point
/// iteration, which converges for h/2 ‖∂f/∂x‖ < 1. Hairer, Lubich, Wanner, Geometric Numerical Integration, theorems
/// IV.2.1 and VI.4.2.
#[derive(Debug, Clone)]
pub struct Midpoint {
    slope: Vec<f64>,
    middle: Vec<f64>,
    next: Vec<f64>,
}

impl Midpoint {
    /// The method for states of `n` components.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let [slope, middle, next] = [(); 3].map(|()| vec![0.0; n]);
        Self {
            slope,
            middle,
            next,
        }
    }

    /// One step of size h, in place; the last step's slope is the first guess.
    ///
    /// # Errors
    /// [`super::Failure::NotConverged`] where the step was not solved, [`super::Failure::NotFinite`] where f is not finite.
    pub fn step(&mut self, f: &mut FirstOrder<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let Self {
            slope,
            middle,
            next,
        } = self;
        let along = |slope: &[f64], middle: &mut [f64]| {
            let states = middle.iter_mut().zip(x.iter().zip(slope));
            states.for_each(|(m, (x, k))| *m = x + 0.5 * h * k);
        };
        along(slope, middle);
        let solved = fixed_point::solve(middle, next, |middle, next| {
            f(t + 0.5 * h, middle, slope);
            along(slope, next);
        });
        if solved.is_err() {
            // A bad guess must not spoil the next step.
            slope.fill(0.0);
            return solved;
        }
        x.iter_mut()
            .zip(slope.iter())
            .for_each(|(x, k)| *x += h * k);
        Ok(())
    }
}
