//! Variational integrators: methods that discretise the action, not the equation of motion.

use super::fixed_point::Convergence;
use super::{Failure, Stepped};
use crate::dynamics::Slopes;
use lagrangian_motion::solve::{Regularity, SymmetricSolver};

/// A Lagrangian with its forces: (t, q, v, slopes), which writes the slopes.
pub type Mechanics<'a> = dyn FnMut(f64, &[f64], &[f64], &mut Slopes) + 'a;

/// Approximation of the action of an interval, with v = (q₁ − q₀)/h (theory.md, equation 101).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// `L_d` = h L((q₀ + q₁)/2, v).
    #[default]
    Midpoint,
    /// `L_d` = h/2 \[L(q₀, v) + L(q₁, v)\]: Störmer–Verlet where M is constant.
    Trapezoidal,
}

/// Maximum number of iterations.
const MAX_ITERATIONS: usize = 50;
/// Number of iterations with M as the matrix, before differences replace it.
const WITH_MASS_MATRIX: usize = 8;
/// Part of the velocity over which differences of the residual are taken.
const DIFFERENCE: f64 = 1e-6;

/// The integrator of the discrete Euler–Lagrange equation, order 2, fixed step: with the forced discrete Legendre
/// transforms p⁻(q₀, q₁) and p⁺(q₀, q₁) of one of the [`Rule`]s,
///
///   solve p⁻(q, q₁) = p for q₁, then p₁ = p⁺(q, q₁)   (theory.md, equations 102 and 103).
///
/// Symplectic in (q, p) for every regular Lagrangian, also where M depends on q or L is not quadratic in the velocity;
/// it conserves the momentum of every symmetry that acts on the coordinates as shifts or linear maps. Newton's method with M
/// in the place of the Jacobian, and with differences where that converges slowly; it fails where h is of the order of
/// the shortest period.
/// Marsden, West, Discrete mechanics and variational integrators, Acta Numerica 2001, sections 1.3, 2.6 and 3.2.
#[derive(Debug, Clone)]
pub struct Variational {
    rule: Rule,
    /// Slopes at the midpoint, or at the beginning of the interval.
    first: Slopes,
    /// Slopes at the end of the interval.
    second: Slopes,
    newton: Newton,
    /// Momentum of [`Variational::step`].
    p: Vec<f64>,
    /// Trial velocity.
    v: Vec<f64>,
    /// q at the end of the interval for the trial velocity.
    end: Vec<f64>,
    /// q at the midpoint for the trial velocity.
    middle: Vec<f64>,
    /// p⁻.
    minus: Vec<f64>,
    /// p⁺.
    plus: Vec<f64>,
}

/// The linear system of a Newton step.
#[derive(Debug, Clone)]
struct Newton {
    solver: SymmetricSolver,
    /// M, or the Jacobian by differences.
    jacobian: Vec<f64>,
    /// p − p⁻.
    residual: Vec<f64>,
    /// Change of the velocity.
    change: Vec<f64>,
}

impl Variational {
    /// The method for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize, rule: Rule) -> Self {
        let row = || vec![0.0; n];
        Self {
            rule,
            first: Slopes::new(n),
            second: Slopes::new(n),
            newton: Newton {
                solver: SymmetricSolver::new(n),
                jacobian: vec![0.0; n * n],
                residual: row(),
                change: row(),
            },
            p: row(),
            v: row(),
            end: row(),
            middle: row(),
            minus: row(),
            plus: row(),
        }
    }

    /// Momenta p⁻ at the beginning and p⁺ at the end of the interval from q₀ at t to q₁ at t + h, `[n]` each.
    pub fn momenta(
        &mut self,
        f: &mut Mechanics<'_>,
        (t, h): (f64, f64),
        q0: &[f64],
        q1: &[f64],
    ) -> (&[f64], &[f64]) {
        for (i, v) in self.v.iter_mut().enumerate() {
            *v = (q1[i] - q0[i]) / h;
        }
        self.end.copy_from_slice(q1);
        self.transform(f, (t, h), q0);
        (&self.minus, &self.plus)
    }

    /// One step of size h of x = (q, v), in place: a Legendre transform to (q, p), a step, and the inverse transform.
    ///
    /// # Errors
    /// [`Failure::NotConverged`] where the step was not solved, [`Failure::NotFinite`] where L is not finite.
    pub fn step(&mut self, f: &mut Mechanics<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let (q, v) = x.split_at_mut(self.v.len());
        f(t, q, v, &mut self.first);
        let mut p = std::mem::take(&mut self.p);
        p.copy_from_slice(&self.first.momentum);
        let outcome = self
            .advance(f, (t, h), q, &mut p, v)
            .and_then(|()| self.velocity(f, t + h, q, &p, v));
        self.p = p;
        outcome
    }

    /// One step of size h of (q, p), in place; `v` is a guess of the velocity, and becomes the velocity over the step.
    ///
    /// # Errors
    /// As [`Variational::step`].
    pub fn advance(
        &mut self,
        f: &mut Mechanics<'_>,
        (t, h): (f64, f64),
        q: &mut [f64],
        p: &mut [f64],
        v: &mut [f64],
    ) -> Stepped {
        self.v.copy_from_slice(v);
        let mut convergence = Convergence::new();
        for iteration in 0..MAX_ITERATIONS {
            self.evaluate(f, (t, h), q, p);
            if self.newton.residual.iter().any(|x| !x.is_finite()) {
                return Err(Failure::NotFinite);
            }
            let (change, size) = self.correct(f, (t, h), (q, p), iteration >= WITH_MASS_MATRIX)?;
            if convergence.is_reached(change, size) {
                self.evaluate(f, (t, h), q, p);
                q.copy_from_slice(&self.end);
                p.copy_from_slice(&self.plus);
                v.copy_from_slice(&self.v);
                return Ok(());
            }
        }
        Err(Failure::NotConverged)
    }

    /// Evaluates the residual p − p⁻ at the trial velocity.
    fn evaluate(&mut self, f: &mut Mechanics<'_>, (t, h): (f64, f64), q: &[f64], p: &[f64]) {
        for (i, end) in self.end.iter_mut().enumerate() {
            *end = q[i] + h * self.v[i];
        }
        self.transform(f, (t, h), q);
        for (i, residual) in self.newton.residual.iter_mut().enumerate() {
            *residual = p[i] - self.minus[i];
        }
    }

    /// Moves the trial velocity by a Newton step; returns its largest change and size.
    fn correct(
        &mut self,
        f: &mut Mechanics<'_>,
        at: (f64, f64),
        (q, p): (&[f64], &[f64]),
        exactly: bool,
    ) -> Result<(f64, f64), Failure> {
        let jacobian = &mut self.newton.jacobian;
        jacobian.copy_from_slice(&self.first.mass_matrix);
        if self.rule == Rule::Trapezoidal {
            let pairs = jacobian.iter_mut().zip(&self.second.mass_matrix);
            pairs.for_each(|(m, other)| *m = 0.5 * (*m + other));
        }
        if exactly {
            self.differences(f, at, q, p);
        }
        let Newton {
            solver,
            jacobian,
            residual,
            change,
        } = &mut self.newton;
        let solved = if exactly {
            solver.solve_general(jacobian, residual, change)
        } else {
            solver.solve(jacobian, residual, change) != Regularity::NotFinite
        };
        if !solved {
            return Err(Failure::NotConverged);
        }
        let (mut change, mut size) = (0.0_f64, f64::MIN_POSITIVE);
        for ((v, step), q) in self.v.iter_mut().zip(&self.newton.change).zip(q) {
            *v += step;
            change = change.max(step.abs());
            size = size.max(v.abs()).max(q.abs() / at.1 * f64::EPSILON);
        }
        Ok((change, size))
    }

    /// Jacobian ∂p⁻/∂v by differences; the residual keeps its value.
    fn differences(&mut self, f: &mut Mechanics<'_>, at: (f64, f64), q: &[f64], p: &[f64]) {
        let (n, residual) = (self.v.len(), self.newton.residual.clone());
        let size = self.v.iter().fold(1e-3, |size: f64, v| size.max(v.abs()));
        for j in 0..n {
            let (v, step) = (self.v[j], DIFFERENCE * size);
            self.v[j] = v + step;
            self.evaluate(f, at, q, p);
            for (i, (here, beside)) in residual.iter().zip(&self.newton.residual).enumerate() {
                self.newton.jacobian[i * n + j] = (here - beside) / step;
            }
            self.v[j] = v;
        }
        self.newton.residual = residual;
    }

    /// Evaluates p⁻ and p⁺ of the interval from `q` to `end`, whose velocity is `v`.
    fn transform(&mut self, f: &mut Mechanics<'_>, (t, h): (f64, f64), q: &[f64]) {
        let half = 0.5 * h;
        match self.rule {
            Rule::Midpoint => {
                for (i, middle) in self.middle.iter_mut().enumerate() {
                    *middle = q[i] + half * self.v[i];
                }
                f(t + half, &self.middle, &self.v, &mut self.first);
                for (i, p) in self.first.momentum.iter().enumerate() {
                    self.minus[i] = p - half * self.first.force[i];
                    self.plus[i] = p + half * self.first.force[i];
                }
            }
            Rule::Trapezoidal => {
                f(t, q, &self.v, &mut self.first);
                f(t + h, &self.end, &self.v, &mut self.second);
                let pairs = self.first.momentum.iter().zip(&self.second.momentum);
                for (i, (p, other)) in pairs.enumerate() {
                    let mean = 0.5 * (p + other);
                    self.minus[i] = mean - half * self.first.force[i];
                    self.plus[i] = mean + half * self.second.force[i];
                }
            }
        }
    }

    /// The inverse Legendre transform: v with ∂L/∂v(q, v) = p, from the guess in `v`.
    fn velocity(
        &mut self,
        f: &mut Mechanics<'_>,
        t: f64,
        q: &[f64],
        p: &[f64],
        v: &mut [f64],
    ) -> Stepped {
        let mut convergence = Convergence::new();
        for _ in 0..MAX_ITERATIONS {
            f(t, q, v, &mut self.first);
            for (i, residual) in self.newton.residual.iter_mut().enumerate() {
                *residual = p[i] - self.first.momentum[i];
            }
            let Newton {
                solver,
                residual,
                change,
                ..
            } = &mut self.newton;
            let regularity = solver.solve(&self.first.mass_matrix, residual, change);
            if regularity == Regularity::NotFinite || change.iter().any(|x| !x.is_finite()) {
                return Err(Failure::NotFinite);
            }
            let (mut change, mut size) = (0.0_f64, f64::MIN_POSITIVE);
            for (v, step) in v.iter_mut().zip(&self.newton.change) {
                *v += step;
                change = change.max(step.abs());
                size = size.max(v.abs());
            }
            if convergence.is_reached(change, size) {
                return Ok(());
            }
        }
        Err(Failure::NotConverged)
    }
}
