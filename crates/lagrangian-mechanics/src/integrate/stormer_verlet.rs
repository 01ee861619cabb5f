//! The leapfrog method.

use super::{SecondOrder, Stepped, fixed_point};

/// The method of Störmer (1907) and Verlet (1967), order 2, time-reversible, fixed step:
///
///   v½ = v + h/2 f(t, q, v½),   q ← q + h v½,   v ← v½ + h/2 f(t + h, q, v½).
///
/// Symplectic where M is constant and the force a gradient; the energy error then stays bounded for
/// exponentially long times. Where f depends on the velocity (a configuration-dependent M, magnetic fields,
/// friction) the first line is implicit and solved by fixed-point iteration, which converges for
/// h ‖∂f/∂v‖ < 2; the method is then still reversible, but not symplectic in (q, p).
/// Hairer, Lubich, Wanner, Geometric Numerical Integration, sections I.1 and VI.3.
#[derive(Debug, Clone)]
pub struct StormerVerlet {
    force: Vec<f64>,
    half: Vec<f64>,
    next: Vec<f64>,
}

impl StormerVerlet {
    /// The method for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            force: vec![0.0; n],
            half: vec![0.0; n],
            next: vec![0.0; n],
        }
    }

    /// One step of size h of x = (q, v), in place.
    ///
    /// # Errors
    /// [`super::Failure::NotConverged`] where the implicit half-step was not solved.
    pub fn step(&mut self, f: &mut SecondOrder<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let (q, v) = x.split_at_mut(self.force.len());
        self.solve_half_step(f, t, h, q, v)?;
        q.iter_mut().zip(&self.half).for_each(|(q, v)| *q += h * v);
        f(t + h, q, &self.half, &mut self.force);
        for (i, v) in v.iter_mut().enumerate() {
            *v = self.half[i] + 0.5 * h * self.force[i];
        }
        Ok(())
    }

    /// v½ = v + h/2 f(t, q, v½) by fixed-point iteration; two evaluations where f ignores the velocity.
    fn solve_half_step(
        &mut self,
        f: &mut SecondOrder<'_>,
        t: f64,
        h: f64,
        q: &[f64],
        v: &[f64],
    ) -> Stepped {
        let Self { force, half, next } = self;
        half.copy_from_slice(v);
        fixed_point::solve(half, next, |half, next| {
            f(t, q, half, force);
            for (i, next) in next.iter_mut().enumerate() {
                *next = v[i] + 0.5 * h * force[i];
            }
        })
    }
}
