//! Moreau's time stepping: dry friction as a set of forces, so that joints stick.

use super::{Failure, Sink, Solution, Span, Stepped, fixed};
use crate::dynamics::Balance;
use crate::forces::DrySolver;
use lagrangian_motion::solve::dot;

/// The balance of forces with dry friction: (t, q, q', balance).
pub type Frictional<'a> = dyn FnMut(f64, &[f64], &[f64], &mut Balance) + 'a;

/// Friction that brakes by less than this part of its limit did not brake a joint throughout a step.
const STEADY: f64 = 1.0 - 1e-9;

/// Moreau's time stepping for M q'' + s ∘ sgn(q') ∋ f − b ∘ q', sgn(0) = [−1, 1], order 2, fixed step:
///
///   q̄ = q + h/2 v,   v̄ = (v + v⁺)/2,   M (v⁺ − v) + h b ∘ v̄ + h s ∘ sgn(v⁺) ∋ h f(t + h/2, q̄, v̄),   q⁺ = q̄ + h/2 v⁺.
///
/// M, f and s are evaluated at (q̄, v), then once more at (q̄, v̄). A joint that its friction holds has v⁺ = 0 exactly, and keeps
/// its position for any number of steps; coupled joints stick and slip individually ([`DrySolver`]). A step is cut where a joint
/// comes to rest in it. Thus friction never pushes a joint along its velocity, only dissipates energy, and the order remains 2
/// through stops, starts and reversals. Without friction and with f a function of
/// q alone it is the method of Störmer and Verlet.
///
/// Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988, section 12; Stewart, Trinkle, An implicit
/// time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb friction, 1996. M must be
/// positive definite.
#[derive(Debug, Clone)]
pub struct Moreau {
    /// q̄, v̄ and v⁺.
    position: Vec<f64>,
    velocity: Vec<f64>,
    next: Vec<f64>,
    balance: Balance,
    /// Matrix, r and h s of (M + h/2 diag b) v⁺ + h s ∘ sgn(v⁺) ∋ r.
    system: Vec<f64>,
    rest: Vec<f64>,
    limit: Vec<f64>,
    /// Velocities under another friction.
    trial: Vec<f64>,
    /// Joints that come to rest at the end of the piece.
    stops: Vec<bool>,
    solver: DrySolver,
}

impl Moreau {
    /// The method for `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            position: zeros(),
            velocity: zeros(),
            next: zeros(),
            balance: Balance::new(n),
            system: vec![0.0; n * n],
            rest: zeros(),
            limit: zeros(),
            trial: zeros(),
            stops: vec![false; n],
            solver: DrySolver::new(n),
        }
    }

    /// One step of size h of x = (q, v), in place.
    ///
    /// # Errors
    /// [`Failure::NotFinite`] where the balance is not finite, [`Failure::NotDefinite`] where M is not positive definite.
    pub fn step(&mut self, f: &mut Frictional<'_>, t: f64, h: f64, x: &mut [f64]) -> Stepped {
        let n = self.next.len();
        let (mut from, mut pieces) = (0.0, 0);
        loop {
            let (mut piece, mut is_cut) = (h - from, false);
            self.stops.fill(false);
            self.solve(f, t + from, piece, x)?;
            for _ in 0..=n {
                let Some((joint, part)) = self.first_stop(&x[n..]) else {
                    break;
                };
                // A joint that reverses repeatedly within one step is left to the next step.
                if pieces <= 2 * n {
                    self.stops.fill(false);
                    (piece, is_cut) = (piece * part, true);
                }
                self.stops[joint] = true;
                self.solve(f, t + from, piece, x)?;
            }
            self.advance(piece, x);
            if !is_cut {
                return Ok(());
            }
            (from, pieces) = (from + piece, pieces + 1);
        }
    }

    /// Writes the accelerations of a state; a joint at rest under less than its friction has zero acceleration.
    ///
    /// # Errors
    /// As [`Moreau::step`].
    pub fn acceleration(
        &mut self,
        f: &mut Frictional<'_>,
        t: f64,
        [q, v]: [&[f64]; 2],
        qdd: &mut [f64],
    ) -> Stepped {
        f(t, q, v, &mut self.balance);
        let Balance {
            mass_matrix,
            force,
            viscous,
            between,
            dry,
        } = &self.balance;
        for (i, &own) in v.iter().enumerate() {
            let direction = if own == 0.0 { 0.0 } else { own.signum() };
            let damping = viscous[i] * own + dot(&between[i * v.len()..][..v.len()], v);
            self.rest[i] = force[i] - damping - dry[i] * direction;
            self.limit[i] = if own == 0.0 { dry[i] } else { 0.0 };
        }
        self.system.copy_from_slice(mass_matrix);
        qdd.fill(0.0);
        self.solution(qdd)
    }

    /// v⁺ of a piece of h seconds from x.
    fn solve(&mut self, f: &mut Frictional<'_>, t: f64, h: f64, x: &[f64]) -> Stepped {
        let n = self.next.len();
        let (q, v) = x.split_at(n);
        for i in 0..n {
            self.position[i] = q[i] + 0.5 * h * v[i];
        }
        self.velocity.copy_from_slice(v);
        for _ in 0..2 {
            f(
                t + 0.5 * h,
                &self.position,
                &self.velocity,
                &mut self.balance,
            );
            self.set_up(h, v);
            let mut next = std::mem::take(&mut self.next);
            next.copy_from_slice(v);
            let solved = self.solution(&mut next);
            self.next = next;
            solved?;
            let mut same = true;
            for (i, v) in v.iter().enumerate() {
                let middle = 0.5 * (v + self.next[i]);
                same &= middle.to_bits() == self.velocity[i].to_bits();
                self.velocity[i] = middle;
            }
            if same {
                break;
            }
        }
        Ok(())
    }

    /// Sets up the problem of a piece of h seconds from the velocities v.
    fn set_up(&mut self, h: f64, v: &[f64]) {
        let n = v.len();
        let balance = &self.balance;
        self.system.copy_from_slice(&balance.mass_matrix);
        for i in 0..n {
            let damping = 0.5 * h * balance.viscous[i];
            let row = &balance.mass_matrix[i * n..(i + 1) * n];
            let momentum: f64 = row.iter().zip(v).map(|(m, v)| m * v).sum();
            self.system[i * (n + 1)] += damping;
            self.rest[i] = momentum - damping * v[i] + h * balance.force[i];
            for (j, between) in balance.between[i * n..][..n].iter().enumerate() {
                self.system[i * n + j] += 0.5 * h * between;
                self.rest[i] -= 0.5 * h * between * v[j];
            }
            self.limit[i] = match self.stops[i] {
                true => f64::INFINITY,
                false => h * balance.dry[i],
            };
        }
    }

    /// Solves the problem that is set up, from these velocities.
    fn solution(&mut self, v: &mut [f64]) -> Stepped {
        if !self.balance.is_finite() {
            return Err(Failure::NotFinite);
        }
        match self.solver.solve(&self.system, &self.rest, &self.limit, v) {
            true => Ok(()),
            false => Err(Failure::NotDefinite),
        }
    }

    /// Of the joints that friction does not brake at its limit throughout, though they move with the velocities v at first,
    /// the one that comes to rest first, and the fraction of the piece until then.
    fn first_stop(&mut self, v: &[f64]) -> Option<(usize, f64)> {
        let n = v.len();
        let mut first: Option<(usize, f64)> = None;
        for i in 0..n {
            let row = &self.system[i * n..(i + 1) * n];
            let moved: f64 = row.iter().zip(&self.next).map(|(m, v)| m * v).sum();
            let brakes = (self.rest[i] - moved) * v[i].signum();
            let is_steady = brakes >= STEADY * self.limit[i] || v[i] == 0.0;
            if self.stops[i] || self.limit[i] <= 0.0 || is_steady {
                continue;
            }
            let part = v[i] / (v[i] - self.with_steady_friction(i, v[i].signum()));
            if part < first.map_or(1.0, |(_, part)| part) && part > 0.0 {
                first = Some((i, part));
            }
        }
        first
    }

    /// Velocity of joint `i` at the end of the piece if its friction kept this direction throughout.
    fn with_steady_friction(&mut self, i: usize, direction: f64) -> f64 {
        let (rest, limit) = (self.rest[i], self.limit[i]);
        (self.rest[i], self.limit[i]) = (rest - limit * direction, 0.0);
        let mut trial = std::mem::take(&mut self.trial);
        trial.copy_from_slice(&self.next);
        let solved = self.solution(&mut trial);
        self.trial = trial;
        (self.rest[i], self.limit[i]) = (rest, limit);
        solved.map_or(f64::NAN, |()| self.trial[i])
    }

    fn advance(&self, h: f64, x: &mut [f64]) {
        let (q, v) = x.split_at_mut(self.next.len());
        for (i, &next) in self.next.iter().enumerate() {
            q[i] = self.position[i] + 0.5 * h * next;
            v[i] = next;
        }
    }
}

/// Solves the balance `f` from x₀ = (q, q') and passes (q, q') at every one of the times to `sink`.
pub fn solve(f: &mut Frictional<'_>, span: Span<'_>, sink: &mut Sink<'_>) -> Solution {
    let mut method = Moreau::new(span.x0.len() / 2);
    fixed::solve(|t, h, x| method.step(f, t, h, x), span, sink)
}
