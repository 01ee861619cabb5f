//! The leapfrog method for any Hamiltonian.

use super::{Flow, Stepped, fixed_point};

/// The method of Störmer and Verlet as a partitioned Runge–Kutta method, order 2, time-reversible, fixed step, of
/// q' = f(t, q, z), z' = g(t, q, z):
///
///   z½ = z + h/2 g(t, q, z½),   q₊ = q + h/2 [f(t, q, z½) + f(t + h, q₊, z½)],   z₊ = z½ + h/2 g(t + h, q₊, z½).
///
/// Symplectic for every Hamiltonian, f = ∂H/∂p and g = −∂H/∂q, separable or not. Both implicit lines are solved by
/// fixed-point iteration, which converges for h/2 ‖∂g/∂z‖ < 1 and h/2 ‖∂f/∂q‖ < 1.
/// Hairer, Lubich, Wanner, Geometric Numerical Integration, theorem VI.3.4.
#[derive(Debug, Clone)]
pub struct GeneralisedLeapfrog {
    half: Vec<f64>,
    ahead: Vec<f64>,
    next: Vec<f64>,
    dq: Vec<f64>,
    begin: Vec<f64>,
    dz: Vec<f64>,
}

impl GeneralisedLeapfrog {
    /// The method for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let [half, ahead, next, dq, begin, dz] = [(); 6].map(|()| vec![0.0; n]);
        Self {
            half,
            ahead,
            next,
            dq,
            begin,
            dz,
        }
    }

    /// One step of size h of x = (q, z), in place.
    ///
    /// # Errors
    /// [`super::Failure::NotConverged`] where an implicit line was not solved, [`super::Failure::NotFinite`] where the flow is not
    /// finite.
    pub fn step(&mut self, flow: &mut Flow<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let (q, z) = x.split_at_mut(self.dz.len());
        let Self {
            half,
            ahead,
            next,
            dq,
            begin,
            dz,
        } = self;
        half.copy_from_slice(z);
        fixed_point::solve(half, next, |half, next| {
            flow(t, q, half, begin, dz);
            for (i, next) in next.iter_mut().enumerate() {
                *next = z[i] + 0.5 * h * dz[i];
            }
        })?;
        for (i, ahead) in ahead.iter_mut().enumerate() {
            *ahead = q[i] + h * begin[i];
        }
        fixed_point::solve(ahead, next, |ahead, next| {
            flow(t + h, ahead, half, dq, dz);
            for (i, next) in next.iter_mut().enumerate() {
                *next = q[i] + 0.5 * h * (begin[i] + dq[i]);
            }
        })?;
        q.copy_from_slice(ahead);
        for (i, z) in z.iter_mut().enumerate() {
            *z = half[i] + 0.5 * h * dz[i];
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Midpoint, StormerVerlet};
    use super::*;

    /// H = ½ (q² + 1) (p² + 1), which is not separable (Tao 2016, section 3).
    fn curved(q: f64, p: f64) -> (f64, f64) {
        ((q * q + 1.0) * p, -q * (p * p + 1.0))
    }

    fn leap(h: f64, steps: usize, x: [f64; 2]) -> [f64; 2] {
        let mut method = GeneralisedLeapfrog::new(1);
        let mut flow = |_: f64, q: &[f64], p: &[f64], dq: &mut [f64], dp: &mut [f64]| {
            (dq[0], dp[0]) = curved(q[0], p[0]);
        };
        let mut x = x;
        for _ in 0..steps {
            assert_eq!(method.step(&mut flow, 0.0, h, &mut x), Ok(()));
        }
        x
    }

    fn midpoint(h: f64, steps: usize, x: [f64; 2]) -> [f64; 2] {
        let mut method = Midpoint::new(2);
        let mut flow = |_: f64, x: &[f64], dx: &mut [f64]| (dx[0], dx[1]) = curved(x[0], x[1]);
        let mut x = x;
        for _ in 0..steps {
            assert_eq!(method.step(&mut flow, 0.0, h, &mut x), Ok(()));
        }
        x
    }

    /// Makes steps of size h: (h, steps, (q, p)).
    type Steps = fn(f64, usize, [f64; 2]) -> [f64; 2];
    const METHODS: [Steps; 2] = [leap, midpoint];

    #[test]
    fn a_step_of_a_hamiltonian_that_is_not_separable_conserves_area() {
        for method in METHODS {
            let (h, e, [q, p]) = (0.1, 1e-5, [0.3, 0.8]);
            let difference = |a: [f64; 2], b: [f64; 2]| {
                let (a, b) = (method(h, 1, a), method(h, 1, b));
                [(a[0] - b[0]) / (2.0 * e), (a[1] - b[1]) / (2.0 * e)]
            };
            let [by_q, by_p] = [
                difference([q + e, p], [q - e, p]),
                difference([q, p + e], [q, p - e]),
            ];
            let area = by_q[0] * by_p[1] - by_q[1] * by_p[0];
            assert!((area - 1.0).abs() < 1e-9, "{area}");
        }
    }

    #[test]
    fn energy_stays_within_a_bound_that_shrinks_with_the_square_of_the_step() {
        let energy = |[q, p]: [f64; 2]| 0.5 * (q * q + 1.0) * (p * p + 1.0);
        for method in METHODS {
            let worst = |h: f64| {
                let mut x = [0.0, 1.0];
                let mut worst: f64 = 0.0;
                for _ in 0..(200.0 / h) as usize {
                    x = method(h, 1, x);
                    worst = worst.max((energy(x) - 1.0).abs());
                }
                worst
            };
            let (coarse, fine) = (worst(0.05), worst(0.025));
            assert!(
                coarse < 1e-2 && (coarse / fine - 4.0).abs() < 0.3,
                "{coarse} {fine}"
            );
        }
    }

    #[test]
    fn where_the_second_half_of_the_state_is_the_velocity_it_is_the_leapfrog() {
        let force = |q: f64, v: f64| -q.sin() - 0.1 * v;
        let (mut general, mut plain) = ([1.0, 0.5], [1.0, 0.5]);
        let mut flow = |_: f64, q: &[f64], v: &[f64], dq: &mut [f64], dv: &mut [f64]| {
            (dq[0], dv[0]) = (v[0], force(q[0], v[0]));
        };
        let mut second = |_: f64, q: &[f64], v: &[f64], a: &mut [f64]| a[0] = force(q[0], v[0]);
        let (mut a, mut b) = (GeneralisedLeapfrog::new(1), StormerVerlet::new(1));
        for _ in 0..100 {
            assert_eq!(a.step(&mut flow, 0.0, 0.1, &mut general), Ok(()));
            assert_eq!(b.step(&mut second, 0.0, 0.1, &mut plain), Ok(()));
        }
        for (x, y) in general.iter().zip(plain) {
            assert!((x - y).abs() < 1e-13, "{x} {y}");
        }
    }
}
