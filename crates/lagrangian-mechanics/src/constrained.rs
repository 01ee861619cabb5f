//! Models whose coordinates are joined by constraints: M q̈ + c = τ − d + Jᵀλ with J q̈ = −J̇ q̇ (theory.md, section 33).

use crate::dynamics::{Balance, Evaluation, Evaluator, Integration, Model, Projection};
use crate::forces::Applied;
use lagrangian_motion::solve::{SymmetricSolver, dot};
use lagrangian_motion::{Constraint, Coordinates, Error, Result};

/// A model that moves as another one does, but keeps constraints between its coordinates by the forces Jᵀλ that they take.
///
/// A constraint that others imply, such as a rod too many, changes nothing. Rollouts begin at the nearest state that keeps the
/// constraints, in the metric of the mass matrix, and return to it after each step.
///
/// ```
/// use lagrangian_mechanics::analytic::by_name;
/// use lagrangian_mechanics::{Constrained, Mechanical, Quantities};
/// use lagrangian_motion::Constraint;
///
/// // The spring holds the mass at 0; a constraint q̇ = 0 holds it anywhere.
/// let spring = by_name("mass-spring", &[])?;
/// let held = Constraint { name: "held".into(), slopes: vec![(0, 1.0)], products: vec![], constant: None };
/// let held = Constrained::new(Mechanical::conservative(spring.lagrangian()), vec![held])?;
/// assert_eq!(held.forward_dynamics(&[0.3], &[0.0], &[5.0])?, [0.0]);
/// assert_eq!(held.freedom(&[0.3])?, 0);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Constrained<M> {
    /// The model without the constraints.
    pub inner: M,
    constraints: Vec<Constraint>,
}

impl<M: Model> Constrained<M> {
    /// The model with these constraints.
    ///
    /// # Errors
    /// As [`Constraint::check`].
    pub fn new(inner: M, constraints: Vec<Constraint>) -> Result<Self> {
        let n = inner.coordinates().dof();
        constraints.iter().try_for_each(|own| own.check(n))?;
        Ok(Self { inner, constraints })
    }

    /// The constraints.
    #[must_use]
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }

    /// The number of degrees of freedom at a position: of coordinates that move, less that of independent constraints.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates.
    pub fn freedom(&self, q: &[f64]) -> Result<usize> {
        let n = self.checked([q])?;
        let held = self.coordinates().parameters().count();
        let mut own = self.constrained();
        own.join(q, &vec![0.0; n]);
        Ok(n - held - own.joints.rank())
    }

    /// The multipliers λ of the constraints at a state under forces, one for each constraint; 0 for one that others imply.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of coordinates.
    pub fn multipliers(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Result<Vec<f64>> {
        let n = self.checked([q, qd, tau])?;
        let mut own = self.constrained();
        let _ = own.forward_dynamics(q, qd, tau, &mut vec![0.0; n]);
        Ok(own.joints.multipliers().to_vec())
    }

    fn checked<const K: usize>(&self, signals: [&[f64]; K]) -> Result<usize> {
        let n = self.coordinates().dof();
        let remedy = "give one value for each coordinate of the model";
        for signal in signals {
            Error::check_shape("a state", signal.len(), n, remedy)?;
        }
        Ok(n)
    }

    fn constrained(&self) -> ConstrainedEvaluator<'_> {
        let (n, k) = (self.coordinates().dof(), self.constraints.len());
        ConstrainedEvaluator {
            inner: self.inner.evaluator(),
            coordinates: self.inner.coordinates(),
            constraints: &self.constraints,
            joints: Joints::new(n, k),
            solver: SymmetricSolver::new(n),
            mass: vec![0.0; n * n],
            inverse: vec![0.0; n * n],
            target: vec![0.0; k],
            moved: vec![0.0; n],
        }
    }
}

impl<M: Model> Model for Constrained<M> {
    fn coordinates(&self) -> &Coordinates {
        self.inner.coordinates()
    }

    fn moves(&self) -> bool {
        self.inner.moves()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.constrained())
    }

    fn integration(&self) -> Integration<'_> {
        match self.constraints.is_empty() {
            true => self.inner.integration(),
            false => Integration::Projected(self),
        }
    }
}

/// The largest number of Newton's steps of a projection, and the step that ends it in parts of the position.
const STEPS: usize = 20;
const SMALL: f64 = 1e-15;

impl<M: Model> Projection for Constrained<M> {
    fn project(&self, state: &mut [f64]) {
        let mut own = self.constrained();
        let (q, qd) = state.split_at(state.len() / 2);
        own.weigh(q, qd);
        own.joints.project(&self.constraints, &own.inverse, state);
    }
}

/// Evaluates a model with constraints.
struct ConstrainedEvaluator<'a> {
    inner: Box<dyn Evaluator + 'a>,
    coordinates: &'a Coordinates,
    constraints: &'a [Constraint],
    joints: Joints,
    solver: SymmetricSolver,
    mass: Vec<f64>,
    inverse: Vec<f64>,
    target: Vec<f64>,
    moved: Vec<f64>,
}

impl ConstrainedEvaluator<'_> {
    /// Inverts the mass matrix of a state; a coordinate that never moves has no part in it.
    fn weigh(&mut self, q: &[f64], qd: &[f64]) {
        let _ = self.inner.mass_matrix(q, qd, &mut self.mass);
        let _ = self.solver.invert(&self.mass, &mut self.inverse);
        for i in self.coordinates.parameters() {
            self.inverse[i * q.len()..][..q.len()].fill(0.0);
        }
    }

    /// Takes the mass matrix of a state and the constraints there.
    fn join(&mut self, q: &[f64], qd: &[f64]) {
        self.weigh(q, qd);
        self.joints.set(self.constraints, q, &self.inverse);
    }
}

impl Evaluator for ConstrainedEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let outcome = self.inner.forward_dynamics(q, qd, tau, qdd);
        let n = self.coordinates.dof().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), qdd) in states.zip(qdd.chunks_exact_mut(n)) {
            self.join(q, qd);
            let drifts = self.constraints.iter().map(|own| own.drift(qd));
            let targets = self.target.iter_mut().zip(drifts);
            targets.for_each(|(to, drift)| *to = -drift);
            self.joints.correct(qdd, &self.target);
        }
        match outcome {
            Evaluation::Unsupported => outcome,
            _ => Evaluation::of(qdd, n, outcome.singular()),
        }
    }

    /// The τ of least size that yields q̈, in the metric of M⁻¹: the part that the constraints would take is omitted. Where inputs
    /// are not the forces themselves, it is that of the model without constraints.
    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        let outcome = self.inner.inverse_dynamics(q, qd, qdd, tau);
        if !outcome.is_supported() || self.inner.applied().actuation.is_some() {
            return outcome;
        }
        let n = self.coordinates.dof().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), tau) in states.zip(tau.chunks_exact_mut(n)) {
            self.join(q, qd);
            let rows = self.inverse.chunks_exact(n);
            let moved = self.moved.iter_mut().zip(rows);
            moved.for_each(|(to, row)| *to = dot(row, tau));
            self.target.fill(0.0);
            self.joints.correct(&mut self.moved, &self.target);
            self.joints.add_forces(tau);
        }
        outcome
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        self.inner.mass_matrix(q, qd, mass)
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        self.inner.bias(q, qd, bias)
    }

    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        self.inner.momentum(q, qd, p)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        self.inner.energy(q, qd, energy)
    }

    fn applied(&self) -> Applied<'_> {
        self.inner.applied()
    }

    /// Dry friction as a set of forces beside constraints is not solved.
    fn balance(&mut self, _: &[f64], _: &[f64], _: &[f64], _: &mut Balance) -> Evaluation {
        Evaluation::Unsupported
    }
}

/// Rows J of constraints with the metric of a mass matrix M: moves x to the nearest x + M⁻¹ Jᵀ λ that has J x = b.
#[derive(Debug, Clone)]
pub struct Joints {
    n: usize,
    /// J, `[k, n]`.
    rows: Vec<f64>,
    /// J M⁻¹, `[k, n]`.
    spread: Vec<f64>,
    /// The factor L of J M⁻¹ Jᵀ in the order of pivots, `[k, k]`, a row for each constraint.
    factor: Vec<f64>,
    /// The constraints in the order of their pivots.
    order: Vec<usize>,
    rank: usize,
    lambda: Vec<f64>,
}

/// The part of a row, squared, by which it must differ from those before it.
const DEPENDENT: f64 = 1e-11;

impl Joints {
    /// No rows yet, of `k` constraints between `n` coordinates.
    #[must_use]
    pub fn new(n: usize, k: usize) -> Self {
        Self {
            n: n.max(1),
            rows: vec![0.0; k * n],
            spread: vec![0.0; k * n],
            factor: vec![0.0; k * k],
            order: Vec::with_capacity(k),
            rank: 0,
            lambda: vec![0.0; k],
        }
    }

    /// The number of independent rows.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// λ of the last correction, `[k]`; 0 for a row that others imply.
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.lambda
    }

    /// Takes the rows of constraints at q, and factorises J M⁻¹ Jᵀ by Cholesky's method with pivots, for M⁻¹ `[n, n]`.
    pub fn set(&mut self, constraints: &[Constraint], q: &[f64], inverse: &[f64]) {
        let (n, k) = (self.n, self.lambda.len());
        let spread = self.spread.chunks_exact_mut(n);
        for ((row, spread), own) in self.rows.chunks_exact_mut(n).zip(spread).zip(constraints) {
            own.write_row(q, row);
            let each = spread.iter_mut().zip(inverse.chunks_exact(n));
            each.for_each(|(to, column)| *to = dot(row, column));
        }
        self.factorise(k);
    }

    fn factorise(&mut self, k: usize) {
        let n = self.n;
        let entry = |i: usize, j: usize| dot(&self.rows[i * n..][..n], &self.spread[j * n..][..n]);
        // Until its row is solved for, λ holds what is left of the diagonal, in parts of it.
        self.lambda.fill(1.0);
        self.order.clear();
        self.order.extend(0..k);
        self.rank = 0;
        for p in 0..k {
            let left = |at: &usize| self.lambda[self.order[*at]];
            let Some(best) = (p..k).max_by(|a, b| left(a).total_cmp(&left(b))) else {
                break;
            };
            self.order.swap(p, best);
            let i = self.order[p];
            let own = entry(i, i);
            if !(self.lambda[i] > DEPENDENT && own > 0.0) {
                break;
            }
            let pivot = (self.lambda[i] * own).sqrt();
            self.factor[i * k + p] = pivot;
            self.rank = p + 1;
            for j in self.order[p + 1..].iter().copied() {
                let known = dot(&self.factor[i * k..][..p], &self.factor[j * k..][..p]);
                let below = (entry(j, i) - known) / pivot;
                self.factor[j * k + p] = below;
                self.lambda[j] -= below * below / entry(j, j).max(f64::MIN_POSITIVE);
            }
        }
    }

    /// Moves `x` so that J x = `target`.
    pub fn correct(&mut self, x: &mut [f64], target: &[f64]) {
        let (n, k) = (self.n, self.lambda.len());
        self.lambda.fill(0.0);
        for p in 0..self.rank {
            let i = self.order[p];
            let mut left = target[i] - dot(&self.rows[i * n..][..n], x);
            for t in 0..p {
                left -= self.factor[i * k + t] * self.lambda[self.order[t]];
            }
            self.lambda[i] = left / self.factor[i * k + p];
        }
        for p in (0..self.rank).rev() {
            let i = self.order[p];
            let mut left = self.lambda[i];
            for j in &self.order[p + 1..self.rank] {
                left -= self.factor[j * k + p] * self.lambda[*j];
            }
            self.lambda[i] = left / self.factor[i * k + p];
        }
        for (spread, lambda) in self.spread.chunks_exact(n).zip(&self.lambda) {
            x.iter_mut()
                .zip(spread)
                .for_each(|(x, by)| *x += lambda * by);
        }
    }

    /// Moves a state (q, q̇) to the nearest one that keeps the constraints in the metric of M.
    pub fn project(&mut self, constraints: &[Constraint], inverse: &[f64], state: &mut [f64]) {
        let (q, qd) = state.split_at_mut(state.len() / 2);
        let size = |x: &[f64]| x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (mut target, mut moved) = (vec![0.0; constraints.len()], vec![0.0; q.len()]);
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            self.set(constraints, q, inverse);
            let values = constraints.iter().map(|own| own.value(q).unwrap_or(0.0));
            target.iter_mut().zip(values).for_each(|(to, g)| *to = -g);
            moved.fill(0.0);
            self.correct(&mut moved, &target);
            let (step, most) = (size(&moved), size(q));
            // Rounding neither shrinks nor matters.
            if step <= SMALL * most || (step < 1e-12 * most && step >= last) {
                break;
            }
            q.iter_mut().zip(&moved).for_each(|(q, by)| *q += by);
            last = step;
        }
        self.set(constraints, q, inverse);
        target.fill(0.0);
        self.correct(qd, &target);
    }

    /// Adds the forces Jᵀ λ of the last correction.
    pub fn add_forces(&self, forces: &mut [f64]) {
        for (row, lambda) in self.rows.chunks_exact(self.n).zip(&self.lambda) {
            let each = forces.iter_mut().zip(row);
            each.for_each(|(force, j)| *force += lambda * j);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::dynamics::{Mechanical, Quantities};
    use crate::integrate::Method;
    use crate::lagrangian::{Jet, Jets, Lagrangian};
    use crate::rollout::{RolloutOptions, free, rollout, times};

    /// Points in the plane, with the mass of each coordinate and the acceleration of gravity.
    struct Masses(Coordinates, Vec<f64>, f64);

    impl Lagrangian for Masses {
        fn coordinates(&self) -> &Coordinates {
            &self.0
        }

        fn jets(&self) -> Box<dyn Jets + '_> {
            Box::new(self)
        }
    }

    impl Jets for &Masses {
        fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
            let n = self.1.len();
            jet.resize(q.len() / n, n);
            jet.lagrangian.fill(0.0);
            jet.momentum_drift.fill(0.0);
            jet.mass_matrix.fill(0.0);
            for at in 0..q.len() {
                let (s, i) = (at / n, at % n);
                let weight = if i % 2 == 1 { self.2 * self.1[i] } else { 0.0 };
                jet.momentum[at] = self.1[i] * qd[at];
                jet.dl_dq[at] = -weight;
                jet.mass_matrix[(s * n + i) * n + i] = self.1[i];
                jet.lagrangian[s] += 0.5 * self.1[i] * qd[at] * qd[at] - weight * q[at];
            }
        }
    }

    fn masses(each: &[f64], gravity: f64) -> Mechanical<Masses> {
        let coordinates = Coordinates::lines(each.len());
        Mechanical::conservative(Masses(coordinates, each.to_vec(), gravity))
    }

    /// A rod from a place to a point.
    fn pivot(place: [f64; 2], point: usize, length: f64) -> Constraint {
        let at = [2 * point, 2 * point + 1];
        Constraint {
            name: "rod".into(),
            slopes: vec![(at[0], -place[0]), (at[1], -place[1])],
            products: at.map(|i| (i, i, 1.0)).to_vec(),
            constant: Some(0.5 * (dot(&place, &place) - length * length)),
        }
    }

    /// A rod between two points.
    fn rod(a: usize, b: usize, length: f64) -> Constraint {
        let mut own = pivot([0.0; 2], b, length);
        for i in 0..2 {
            let (a, b) = (2 * a + i, 2 * b + i);
            own.products
                .extend([(a, a, 1.0), (a, b, -1.0), (b, a, -1.0)]);
        }
        own
    }

    fn double_pendulum() -> Constrained<Mechanical<Masses>> {
        let rods = vec![pivot([0.0; 2], 0, 1.0), rod(0, 1, 0.7)];
        Constrained::new(masses(&[1.0, 1.0, 0.6, 0.6], 9.81), rods).unwrap()
    }

    /// The largest violation of constraints along a motion, and how much its energy changes.
    fn violations<M: Model>(
        model: &Constrained<M>,
        state: [&[f64]; 2],
        seconds: f64,
        method: Method,
    ) -> [f64; 2] {
        let options = RolloutOptions {
            method,
            ..RolloutOptions::default()
        };
        let times = times(seconds, 0.05).unwrap();
        let motion = rollout(model, state[0], state[1], &times, &free, &options).unwrap();
        assert!(motion.outcome.is_finished(), "{:?}", motion.outcome);
        let (q, qd) = (&motion.trajectory.q, &motion.trajectory.qd);
        let n = state[0].len();
        let mut worst = 0.0_f64;
        for (q, qd) in q.chunks_exact(n).zip(qd.chunks_exact(n)) {
            for own in model.constraints() {
                worst = worst.max(own.value(q).unwrap_or(0.0).abs());
                worst = worst.max(dot(&own.row(q), qd).abs());
            }
        }
        let energy = model.energy(q, qd).unwrap();
        let drift = energy.iter().map(|e| (e - energy[0]).abs());
        [worst, drift.fold(0.0, f64::max)]
    }

    #[test]
    fn every_integrator_keeps_the_rods_of_a_double_pendulum() {
        let state: [&[f64]; 2] = [&[1.0, 0.0, 1.7, 0.0], &[0.0; 4]];
        for (method, drift) in [
            (Method::Dop853, 1e-7),
            (Method::Dopri5, 1e-6),
            (Method::Rk4, 0.1),
            (Method::StormerVerlet, 3.0),
            (Method::ImplicitMidpoint, 3.0),
        ] {
            let [worst, energy] = violations(&double_pendulum(), state, 100.0, method);
            assert!(
                worst < 1e-10 && energy < drift,
                "{} {worst:.1e} {energy:.1e}",
                method.name()
            );
        }
    }

    #[test]
    fn a_rod_too_many_changes_nothing() {
        // A four-bar linkage whose coupler carries a third point, by one rod more than it takes.
        let bars = vec![
            pivot([0.0; 2], 0, 1.0),
            pivot([2.0, 0.0], 1, 1.0),
            rod(0, 1, 2.0),
            rod(0, 2, 1.0),
            rod(1, 2, 1.0),
        ];
        let mut twice = bars.clone();
        twice.extend(bars[..2].iter().cloned());
        let place = [0.0, 1.0, 2.0, 1.0, 1.0, 1.0];
        let one = Constrained::new(masses(&[1.0; 4], 9.81), bars[..3].to_vec()).unwrap();
        let other = Constrained::new(masses(&[1.0; 6], 9.81), twice).unwrap();
        assert_eq!(one.freedom(&place[..4]).unwrap(), 1);
        // The third point is in line with the bar: it may move across it to first order.
        assert_eq!(other.freedom(&place).unwrap(), 2);
        let state: [&[f64]; 2] = [&[0.6, 0.8, 2.6, 0.8], &[0.0; 4]];
        let [worst, energy] = violations(&one, state, 30.0, Method::Dop853);
        assert!(worst < 1e-10 && energy < 1e-6, "{worst:.1e} {energy:.1e}");
    }

    #[test]
    fn a_sleigh_does_not_slip_and_keeps_its_energy() {
        // Two points on a rod; the first glides along the rod alone: (y₂ − y₁) ẋ₁ − (x₂ − x₁) ẏ₁ = 0.
        let skate = Constraint {
            name: "skate".into(),
            slopes: vec![],
            products: vec![(0, 3, 1.0), (0, 1, -1.0), (1, 2, -1.0), (1, 0, 1.0)],
            constant: None,
        };
        let sleigh = Constrained::new(masses(&[1.0; 4], 0.0), vec![rod(0, 1, 1.0), skate]).unwrap();
        assert_eq!(sleigh.freedom(&[0.0, 0.0, 1.0, 0.0]).unwrap(), 2);
        let state: [&[f64]; 2] = [&[0.0, 0.0, 1.0, 0.0], &[0.5, 0.0, 0.5, 1.0]];
        let [worst, energy] = violations(&sleigh, state, 100.0, Method::Dop853);
        assert!(worst < 1e-10 && energy < 1e-8, "{worst:.1e} {energy:.1e}");
    }

    #[test]
    fn forces_of_a_motion_are_those_that_rods_do_not_take() {
        let model = double_pendulum();
        let (q, qd) = ([0.6, -0.8, 0.6, -1.5], [0.8, 0.6, 1.1, 0.6]);
        let tau = [0.3, -0.2, 0.7, 0.1];
        let qdd = model.forward_dynamics(&q, &qd, &tau).unwrap();
        let own = model.inverse_dynamics(&q, &qd, &qdd).unwrap();
        let again = model.forward_dynamics(&q, &qd, &own).unwrap();
        assert!(qdd.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-12));
        for constraint in model.constraints() {
            let row = constraint.row(&q);
            let taken: f64 = (0..4)
                .map(|i| row[i] * own[i] / [1.0, 1.0, 0.6, 0.6][i])
                .sum();
            assert!(taken.abs() < 1e-12, "{taken}");
            assert!((dot(&row, &qdd) + constraint.drift(&qd)).abs() < 1e-12);
        }
        // M q̈ = τ − c + Jᵀ λ.
        let lambda = model.multipliers(&q, &qd, &tau).unwrap();
        let rows: Vec<Vec<f64>> = model.constraints().iter().map(|own| own.row(&q)).collect();
        for i in 0..4 {
            let mass = [1.0, 1.0, 0.6, 0.6][i];
            let weight = if i % 2 == 1 { 9.81 * mass } else { 0.0 };
            let joints = lambda[0] * rows[0][i] + lambda[1] * rows[1][i];
            assert!((mass * qdd[i] - tau[i] + weight - joints).abs() < 1e-12);
        }
    }
}
