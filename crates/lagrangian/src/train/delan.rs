//! Training of deep Lagrangian networks: each balance M q̈ + c − … depends on the network through its outputs, their
//! change along q̇ and their change along one more direction in q (theory.md, section 14).

use super::forces::Forces;
use super::learner::{At, Learner, Loss, Work};
use crate::lagrangian::DelanShape;
use crate::mlp::simd::Real;
use crate::mlp::{Gradient, Net, Packed, Terms};
use crate::rigid::RigidBodies;
use crate::solve::Regularity;

/// A [`Delan`](crate::lagrangian::Delan) in training.
///
/// Directions of a pass: one for each raw output S, that is for each coordinate at each acceleration that the loss
/// needs; for the pull-back, one for each acceleration.
#[derive(Debug)]
pub(crate) struct DelanLearner<'a> {
    pub(crate) shape: &'a DelanShape,
    pub(crate) loss: Loss,
    /// Weight of each residual, `[m]`.
    pub(crate) weights: &'a [f64],
    pub(crate) forces: Forces,
    /// What is known already.
    pub(crate) nominal: Option<&'a RigidBodies>,
}

impl<T: Real> Learner<T> for DelanLearner<'_> {
    fn net(&self) -> &Net {
        &self.shape.net
    }
    fn dof(&self) -> usize {
        self.shape.dof()
    }
    fn room(&self) -> usize {
        self.outputs()
    }
    fn forces(&self) -> Option<&Forces> {
        Some(&self.forces)
    }
    fn outputs_each(&self) -> usize {
        self.outputs()
    }

    fn terms(&self) -> Terms {
        let k = self.outputs();
        let pairs = |i| vec![(0, 2 + i), (1 + i, 1), (1 + k + i, 0)];
        Terms::new((0..k).map(pairs).collect())
    }

    fn loss(&self) -> (Loss, &[f64]) {
        (self.loss, &self.weights[..self.shape.dof()])
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        self.prepare(work);
        work.know(self.nominal);
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            shape.write(&mut work.pass, s, &work.q[row.clone()], &work.qd[row]);
        }
        work.pass.forward(&shape.net, packed, Some(0));
        let scale = &shape.scaling.qd_scale;
        let outputs = shape.factor_outputs();
        for s in 0..work.pass.samples() {
            let (pass, qd, factor) = (&work.pass, &work.qd, &mut work.factors[s]);
            factor.read(
                |c, o| pass.output(&shape.net, c, s, o).f64(),
                |i| qd[s * n + i] / scale[i],
            );
            factor.seeds(&mut work.seeds[0][s * outputs..][..outputs]);
        }
        let seeds = &work.seeds[0];
        work.pass
            .reverse_sum(&shape.net, packed, |s, o| T::of(seeds[s * outputs + o]));
        work.singular = 0;
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            shape.slope(&work.pass, s, &mut work.jet.dl_dq[row]);
            self.balance(s, extra, work);
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (n, sets) = (self.shape.dof(), self.sets());
        let k = n * sets;
        let lambda = std::mem::take(&mut work.lambda);
        let weight = |s: usize, d: usize, i: usize| lambda[s * k + d * n + i].f64();
        self.sensitivities(packed, work, sets, weight);
        let mut pairs = [(0, 0); 6];
        for d in 0..sets {
            let own = [(0, 2 + d), (1 + d, 1), (1 + sets + d, 0)];
            pairs[3 * d..3 * d + 3].copy_from_slice(&own);
        }
        work.pass
            .add_products(&self.shape.net, &pairs[..3 * sets], gradient);
        work.lambda = lambda;
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
        work.pass.reverse_features(&shape.net, packed, 0..1 + 2 * k);
        for (s, slopes) in slopes.chunks_exact_mut(2 * n * k).enumerate() {
            let qd = &work.qd[s * n..][..n];
            shape.slopes(&work.pass, s, qd, &mut work.factors[s], slopes);
            for set in slopes.chunks_exact_mut(2 * n * n) {
                work.add_force_slopes(&self.forces, extra, (s, shape.scaling.energy), set);
            }
        }
    }
}

impl DelanLearner<'_> {
    /// Accelerations at which the balance is taken: the recorded one, the model's own, or both.
    fn sets(&self) -> usize {
        if self.loss == Loss::TorqueAcceleration {
            2
        } else {
            1
        }
    }

    fn outputs(&self) -> usize {
        self.sets() * self.shape.dof()
    }

    /// Makes room for what this family needs beside the pass.
    fn prepare<T: Real>(&self, work: &mut Work<T>) {
        let samples = work.pass.samples();
        if work.factors.len() == samples {
            return;
        }
        work.factors = vec![self.shape.factor(); samples];
        let outputs = self.shape.factor_outputs();
        work.seeds = [
            vec![0.0; samples * outputs],
            vec![0.0; 2 * self.outputs() * samples * outputs],
        ];
        work.scratch.resize(4 * self.shape.dof(), 0.0);
    }

    /// The factors stand at the outputs of sample `s`, `jet.dl_dq` holds ∂(L/E)/∂q: fills residuals and D.
    fn balance<T: Real>(&self, s: usize, extra: &[f64], work: &mut Work<T>) {
        let (n, energy) = (self.shape.dof(), self.shape.scaling.energy);
        let k = self.outputs();
        if self.loss.needs_forces() {
            for i in 0..n {
                work.along[s * k + i] = work.qdd[s * n + i];
            }
            work.force(&self.forces, extra, (s, At::Recorded), energy);
            self.torque_residual(s, work);
        }
        if self.loss.inverts() {
            work.force(&self.forces, extra, (s, At::Rest), energy);
            self.acceleration_residual(s, extra, work);
        }
    }

    /// Left side of the balance of coordinate `i` without the forces, in units of the energy.
    fn left<T: Real>(&self, work: &Work<T>, s: usize, i: usize) -> f64 {
        let n = self.shape.dof();
        work.factors[s].momentum_rate(i) / self.shape.scaling.qd_scale[i]
            - work.jet.dl_dq[s * n + i]
    }

    fn accelerate<T: Real>(&self, work: &mut Work<T>, s: usize, set: usize) {
        let (n, k) = (self.shape.dof(), self.outputs());
        let scale = &self.shape.scaling.qd_scale;
        let along = &work.along[s * k + set * n..][..n];
        work.factors[s].accelerate(|i| along[i] / scale[i]);
    }

    /// r = w (M q̈ + c + d − τ), D = w E; and the power r·q̇.
    fn torque_residual<T: Real>(&self, s: usize, work: &mut Work<T>) {
        let (n, k, energy) = (self.shape.dof(), self.outputs(), self.shape.scaling.energy);
        let m = self.loss.residuals(n);
        self.accelerate(work, s, 0);
        work.mix[s * m * k..][..m * k].fill(0.0);
        let mut power = 0.0;
        for i in 0..n {
            let error = energy * self.left(work, s, i) + work.scratch[n + i];
            work.residual[s * m + i] = self.weights[i] * error;
            work.mix[(s * m + i) * k + i] = self.weights[i] * energy;
            power += error * work.qd[s * n + i];
            if self.loss == Loss::TorquePower {
                work.mix[(s * m + n) * k + i] = self.weights[n] * energy * work.qd[s * n + i];
            }
        }
        if self.loss == Loss::TorquePower {
            work.residual[s * m + n] = self.weights[n] * power;
        }
    }

    /// r = w (M⁻¹ (τ − d − c) − q̈), D = −w M⁻¹ E at the acceleration of the model (theory.md, equation 15). The
    /// second half of the scratch holds d − τ.
    fn acceleration_residual<T: Real>(&self, s: usize, extra: &[f64], work: &mut Work<T>) {
        let (n, k, energy) = (self.shape.dof(), self.outputs(), self.shape.scaling.energy);
        let (m, set) = (self.loss.residuals(n), self.sets() - 1);
        let scale = &self.shape.scaling.qd_scale;
        work.factors[s].accelerate(|_| 0.0);
        let mass = &mut work.jet.mass_matrix[s * n * n..][..n * n];
        for i in 0..n {
            for j in 0..n {
                mass[i * n + j] = energy / (scale[i] * scale[j]) * work.factors[s].mass(i, j);
            }
            mass[i * n + i] += self.forces.rotor(extra, i);
        }
        work.add_known_mass(s);
        for i in 0..n {
            work.scratch[i] = -energy * self.left(work, s, i) - work.scratch[n + i];
        }
        work.hold(&self.shape.coordinates, s);
        let (force, rest) = work.scratch.split_at_mut(n);
        let found = &mut rest[n..2 * n];
        let mass = &work.jet.mass_matrix[s * n * n..][..n * n];
        let mut regular = work.solver.solve(mass, force, found) == Regularity::Definite;
        regular &= found.iter().all(|a| a.abs() < 1e30);
        let mut inverse = std::mem::take(&mut work.inverse);
        inverse.resize(n * n, 0.0);
        let _ = work.solver.invert(mass, &mut inverse);
        for i in 0..n {
            let (row, weight) = (set * n + i, self.weights[set * n + i]);
            work.along[s * k + row] = found[i];
            work.residual[s * m + row] = weight * (found[i] - work.qdd[s * n + i]);
            let mix = &mut work.mix[(s * m + row) * k..][..k];
            mix.fill(0.0);
            let column = mix[set * n..].iter_mut().zip(&inverse[i * n..]);
            column.for_each(|(d, x)| *d = -weight * energy * x);
        }
        work.inverse = inverse;
        if regular {
            // Rotors feel the acceleration of the model.
            return work.force(&self.forces, extra, (s, At::Found(set)), energy);
        }
        work.singular += usize::from(s < work.count);
        work.residual[s * m..][..m].fill(0.0);
        work.along[s * k..][..k].fill(0.0);
        work.mix[s * m * k..][..m * k].fill(0.0);
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
        let (shape, n) = (self.shape, self.shape.dof());
        let (samples, outputs) = (work.pass.samples(), shape.factor_outputs());
        for s in 0..samples {
            for d in 0..directions {
                shape.write_tangent(&mut work.pass, (s, d), |i| -weight(s, d, i));
            }
        }
        work.pass.forward_tangents(&shape.net, packed, directions);
        let mut beta = [0.0; 64];
        for s in 0..samples {
            for d in 0..directions {
                if d % directions.div_ceil(self.sets()) == 0 {
                    self.accelerate(work, s, d * self.sets() / directions);
                }
                for (i, b) in beta[..n].iter_mut().enumerate() {
                    *b = weight(s, d, i) / shape.scaling.qd_scale[i];
                }
                let pass = &work.pass;
                let (rates, values) = work.seeds[1].split_at_mut(directions * samples * outputs);
                let at = (d * samples + s) * outputs;
                work.factors[s].sensitivities(
                    &beta[..n],
                    |o| pass.output(&shape.net, 2 + d, s, o).f64(),
                    &mut rates[at..at + outputs],
                    &mut values[at..at + outputs],
                );
            }
        }
        let seeds = &work.seeds[1];
        let seed = |c: usize, s: usize, o: usize| T::of(seeds[(c * samples + s) * outputs + o]);
        work.pass
            .reverse_tangents(&shape.net, packed, directions, seed);
    }
}
