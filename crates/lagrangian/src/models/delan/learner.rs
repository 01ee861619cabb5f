//! Training of deep Lagrangian networks: each balance M q̈ + c − … depends on the network through its outputs, their
//! change along q̇ and their change along one more direction in q (theory.md, section 14).

use super::{Block, DelanShape, Scratch};
use crate::models::NetworkShape;
use crate::models::setup::NetworkLearner;
use crate::train::{At, Learner, LearnerShape, Loss, Work};
use lagrangian_motion::solve::Regularity;
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};

/// A [`Delan`](crate::models::delan::Delan) in training.
///
/// Directions of a pass: one for each raw output S, that is for each coordinate at each acceleration that the loss
/// needs; for the pull-back, one for each acceleration.
pub(crate) type DelanLearner<'a> = NetworkLearner<'a, DelanShape>;

impl<T: Real> Learner<T> for DelanLearner<'_> {
    fn facts(&self) -> LearnerShape<'_> {
        self.shape_of(self.outputs(), self.loss.residuals(self.shape.dof()))
    }

    fn terms(&self) -> Terms {
        let k = self.outputs();
        let pairs = |i| vec![(0, 2 + i), (1 + i, 1), (1 + k + i, 0)];
        Terms::new((0..k).map(pairs).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let samples = work.pass.samples();
        work.evaluate_nominal(self.nominal);
        work.mechanics.scratch.resize(4 * self.shape.dof(), 0.0);
        let mut own = work.scratch.take::<Scratch<T>>();
        let mut block = own
            .block
            .take()
            .unwrap_or_else(|| Box::new(Block::new(self.shape, samples)));
        let states = (&work.states.q[..], &work.states.qd[..]);
        block.evaluate(self.shape, packed, &mut work.pass, states);
        work.linear.singular = 0;
        if self.loss.needs_forces() {
            self.torque_residuals(extra, &mut block, work);
        }
        if self.loss.inverts() {
            self.acceleration_residuals(extra, &mut block, work);
        }
        own.block = Some(block);
        work.scratch.put(own);
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (n, sets) = (self.shape.dof(), self.sets());
        let k = n * sets;
        let lambda = std::mem::take(&mut work.adjoint.lambda);
        let weight = |s: usize, d: usize, i: usize| lambda[s * k + d * n + i].f64();
        self.sensitivities(packed, work, sets, weight);
        let mut pairs = [(0, 0); 6];
        for d in 0..sets {
            let own = [(0, 2 + d), (1 + d, 1), (1 + sets + d, 0)];
            pairs[3 * d..3 * d + 3].copy_from_slice(&own);
        }
        work.pass
            .add_products(&self.shape.net, &pairs[..3 * sets], gradient);
        work.adjoint.lambda = lambda;
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        let n = self.shape.dof();
        let unit = |_: usize, d: usize, i: usize| f64::from(u8::from(d % n == i));
        self.sensitivities(packed, work, self.outputs(), unit);
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (shape, n, k) = (self.shape, self.shape.dof(), self.outputs());
        // One state at a time: a flow is linearised far less often than a loss.
        let mut own = work.scratch.take::<Scratch<T>>();
        let mut factor = own.factors.each.pop().unwrap_or_else(|| shape.factor());
        work.pass.reverse_features(&shape.net, packed, 0..1 + 2 * k);
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * k).enumerate() {
            let (pass, qd) = (&work.pass, &work.states.qd[s * n..][..n]);
            factor.read(
                |c, o| pass.output(&shape.net, c, s, o).f64(),
                |i| qd[i] / shape.scaling.qd_scale[i],
            );
            shape.slopes(pass, s, qd, &mut factor, slopes);
            for set in slopes.chunks_exact_mut(2 * n * n) {
                work.add_force_slopes(&self.forces, extra, (s, shape.scaling.energy), set);
            }
        }
        own.factors.each.push(factor);
        work.scratch.put(own);
    }
}

impl DelanLearner<'_> {
    /// Accelerations at which the balance is taken: the recorded one, the model's own, or both.
    fn sets(&self) -> usize {
        if self.loss == Loss::TORQUE_ACCELERATION {
            2
        } else {
            1
        }
    }

    fn outputs(&self) -> usize {
        self.sets() * self.shape.dof()
    }

    /// Residuals at the recorded acceleration.
    fn torque_residuals<T: Real>(&self, extra: &[f64], block: &mut Block<T>, work: &mut Work<T>) {
        let (n, k) = (self.shape.dof(), self.outputs());
        block.accelerate(|s, i| work.states.qdd[s * n + i]);
        block.balance();
        for s in 0..work.pass.samples() {
            for i in 0..n {
                work.linear.along[s * k + i] = work.states.qdd[s * n + i];
            }
            work.force(&self.forces, extra, (s, At::Recorded), self.energy());
            self.torque_residual(s, block, work);
        }
    }

    /// Residuals at the acceleration of the model.
    fn acceleration_residuals<T: Real>(
        &self,
        extra: &[f64],
        block: &mut Block<T>,
        work: &mut Work<T>,
    ) {
        block.accelerate(|_, _| 0.0);
        block.balance();
        block.weigh();
        for s in 0..work.pass.samples() {
            work.force(&self.forces, extra, (s, At::Rest), self.energy());
            self.acceleration_residual(s, extra, block, work);
        }
    }

    fn energy(&self) -> f64 {
        self.shape.scaling.energy
    }

    /// r = w (M q̈ + c + d − τ), D = w E; and the power r·q̇.
    fn torque_residual<T: Real>(&self, s: usize, block: &Block<T>, work: &mut Work<T>) {
        let (n, k, energy) = (self.shape.dof(), self.outputs(), self.energy());
        let m = self.loss.residuals(n);
        work.linear.d[s * m * k..][..m * k].fill(0.0);
        let mut power = 0.0;
        for i in 0..n {
            let error = energy * block.left(s, i) + work.mechanics.scratch[n + i];
            work.linear.residual[s * m + i] = self.weights[i] * error;
            work.linear.d[(s * m + i) * k + i] = self.weights[i] * energy;
            power += error * work.states.qd[s * n + i];
            if self.loss == Loss::TORQUE_POWER {
                work.linear.d[(s * m + n) * k + i] =
                    self.weights[n] * energy * work.states.qd[s * n + i];
            }
        }
        if self.loss == Loss::TORQUE_POWER {
            work.linear.residual[s * m + n] = self.weights[n] * power;
        }
    }

    /// r = w (M⁻¹ (τ − d − c) − q̈), D = −w M⁻¹ E at the acceleration of the model (theory.md, equation 15). The
    /// second half of the scratch holds d − τ.
    fn acceleration_residual<T: Real>(
        &self,
        s: usize,
        extra: &[f64],
        block: &Block<T>,
        work: &mut Work<T>,
    ) {
        let (n, k, energy) = (self.shape.dof(), self.outputs(), self.energy());
        let (m, set) = (self.loss.residuals(n), self.sets() - 1);
        let scale = &self.shape.scaling.qd_scale;
        let mass = &mut work.mechanics.jet.mass_matrix[s * n * n..][..n * n];
        for i in 0..n {
            for j in 0..n {
                mass[i * n + j] = energy / (scale[i] * scale[j]) * block.mass(s, i, j);
            }
            mass[i * n + i] += self.forces.rotor(extra, i);
        }
        work.add_nominal_mass(s);
        for i in 0..n {
            work.mechanics.scratch[i] = -energy * block.left(s, i) - work.mechanics.scratch[n + i];
        }
        work.hold(&self.shape.coordinates, s);
        let (force, rest) = work.mechanics.scratch.split_at_mut(n);
        let found = &mut rest[n..2 * n];
        let mass = &work.mechanics.jet.mass_matrix[s * n * n..][..n * n];
        let mut regular = work.mechanics.solver.solve(mass, force, found) == Regularity::Definite;
        regular &= found.iter().all(|a| a.abs() < 1e30);
        let mut inverse = std::mem::take(&mut work.mechanics.inverse);
        inverse.resize(n * n, 0.0);
        let _ = work.mechanics.solver.invert(mass, &mut inverse);
        for i in 0..n {
            let (row, weight) = (set * n + i, self.weights[set * n + i]);
            work.linear.along[s * k + row] = found[i];
            work.linear.residual[s * m + row] = weight * (found[i] - work.states.qdd[s * n + i]);
            let mix = &mut work.linear.d[(s * m + row) * k..][..k];
            mix.fill(0.0);
            let column = mix[set * n..].iter_mut().zip(&inverse[i * n..]);
            column.for_each(|(d, x)| *d = -weight * energy * x);
        }
        work.mechanics.inverse = inverse;
        if regular {
            // Rotors have the acceleration of the model.
            return work.force(&self.forces, extra, (s, At::Predicted(set)), energy);
        }
        work.omit(s);
    }

    /// Fills the components of a pass that [`Learner::terms`] names, for `directions` scalars Σᵢ weight(s, d, i) Sᵢ;
    /// direction d is taken at acceleration d · sets / directions.
    fn sensitivities<T: Real>(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: impl Fn(usize, usize, usize) -> f64,
    ) {
        let (shape, n, k) = (self.shape, self.shape.dof(), self.outputs());
        let mut own = work.scratch.take::<Scratch<T>>();
        let Some(block) = &mut own.block else {
            return;
        };
        for d in 0..directions {
            block.write_tangent(&mut work.pass, d, |s, i| weight(s, d, i));
        }
        work.pass.forward_tangents(&shape.net, packed, directions);
        // After a torque loss alone the factor is already at its one acceleration.
        let there = self.sets() == 1 && self.loss.needs_forces();
        for d in 0..directions {
            if !there && d % directions.div_ceil(self.sets()) == 0 {
                let set = d * self.sets() / directions;
                block.accelerate(|s, i| work.linear.along[s * k + set * n + i]);
            }
            let of = (d, directions);
            block.seed(shape, &mut work.pass, of, |s, i| weight(s, d, i));
        }
        work.pass
            .reverse_tangents_seeded(&shape.net, packed, directions);
        work.scratch.put(own);
    }
}
