//! Training of Hamiltonian networks on (q̇, ṗ). The residuals are linear in the first derivatives of the network, so
//! that one reverse pass computes them (theory.md, equation 93).

use super::{HnnNet, HnnShape, Unit};
use crate::dataset::Momenta;
use crate::models::NetworkShape;
use crate::models::delan::{Outputs, Scratch};
use crate::models::setup::NetworkLearner;
use crate::train::{At, Learner, LearnerShape, Work};
use lagrangian_motion::Signals;
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};

/// An [`Hnn`](crate::models::hnn::Hnn) in training:
///
///   r = w (∂H/∂p − q̇,  −∂H/∂q + τ − d − ṗ),   S = (∂N/∂π, −∂N/∂q),   D diagonal.
///
/// Directions of a pass: one for each of the 2n raw outputs S; for the pull-back, one along them all.
pub(crate) type HnnLearner<'a> = NetworkLearner<'a, HnnShape>;

impl<T: Real> Learner<T> for HnnLearner<'_> {
    fn facts(&self) -> LearnerShape<'_> {
        let k = 2 * self.shape.dof();
        LearnerShape {
            phase: self.phase,
            ..self.shape_of(k, k)
        }
    }

    fn terms(&self) -> Terms {
        let k = 2 * self.shape.dof();
        let plain = matches!(self.shape.net, HnnNet::None(_));
        let pairs = |d| match plain {
            true => vec![(d, 0)],
            false => vec![(0, 2 + d), (1 + k + d, 0)],
        };
        Terms::new((0..k).map(pairs).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        let net = shape.net();
        self.set_momenta(work);
        for s in 0..work.pass.samples() {
            let row = s * n..s * n + n;
            shape.write(
                &mut work.pass,
                s,
                &work.states.q[row.clone()],
                &work.states.p[row],
            );
        }
        work.pass.forward(net, packed, None);
        match &shape.net {
            HnnNet::Free(_) => work.pass.reverse_sum(net, packed, |_, _| T::of(1.0)),
            HnnNet::Mass(_) => self.factors(packed, work),
            HnnNet::None(_) => (),
        }
        work.linear.singular = 0;
        for s in 0..work.pass.samples() {
            self.read(s, work);
            work.force(&self.forces, extra, (s, At::Rest), 1.0);
            self.residual(s, work);
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (net, k) = (self.shape.net(), 2 * self.shape.dof());
        if let HnnNet::None(_) = self.shape.net {
            work.pass
                .reverse_weighted(net, packed, k, &work.adjoint.lambda);
            return work.pass.add_products(net, &[(0, 0)], gradient);
        }
        let lambda = std::mem::take(&mut work.adjoint.lambda);
        self.sensitivities(packed, work, 1, |s, _, j| lambda[s * k + j].f64());
        work.pass.add_products(net, &[(0, 2), (2, 0)], gradient);
        work.adjoint.lambda = lambda;
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        let (net, k) = (self.shape.net(), 2 * self.shape.dof());
        if let HnnNet::None(_) = self.shape.net {
            return work.pass.reverse_outputs(net, packed, k);
        }
        self.sensitivities(packed, work, k, |_, d, j| f64::from(u8::from(d == j)));
    }

    fn state_slopes(
        &self,
        packed: &Packed<T>,
        _extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        self.curvature(packed, work, slopes);
    }
}

impl HnnLearner<'_> {
    /// Sets the momenta and their rates, unless they are recorded.
    fn set_momenta<T: Real>(&self, work: &mut Work<T>) {
        let n = self.shape.dof();
        let Signals { p, pd, qd, qdd, .. } = &mut work.states.signals;
        match &self.shape.config.momenta {
            _ if self.phase => (),
            Momenta::Recorded => (),
            Momenta::Velocities => {
                p.copy_from_slice(qd);
                pd.copy_from_slice(qdd);
            }
            Momenta::Masses(masses) => {
                for (at, (p, pd)) in p.iter_mut().zip(pd).enumerate() {
                    let mass = masses[at % n];
                    (*p, *pd) = (mass * qd[at], mass * qdd[at]);
                }
            }
        }
    }

    /// Reads G and V, at rest, and reverses the pass.
    fn factors<T: Real>(&self, packed: &Packed<T>, work: &mut Work<T>) {
        let HnnNet::Mass(shape) = &self.shape.net else {
            return;
        };
        let (n, scale) = (shape.dof(), &shape.scaling.qd_scale);
        let mut own = work.scratch.take::<Scratch<T>>();
        let (p, factors) = (&work.states.p, &mut own.factors);
        let pi = |s: usize, i: usize| p[s * n + i] / scale[i];
        factors.read(shape, packed, &mut work.pass, Outputs::Values, pi);
        // With a = π the rate of the momentum is the momentum itself.
        for (s, factor) in factors.each.iter_mut().enumerate() {
            factor.accelerate(|i| pi(s, i));
        }
        work.scratch.put(own);
    }

    /// S of sample `s` into `along`.
    fn read<T: Real>(&self, s: usize, work: &mut Work<T>) {
        let (shape, n) = (self.shape, self.shape.dof());
        let raw = &mut work.linear.along[s * 2 * n..][..2 * n];
        if let HnnNet::None(_) = shape.net {
            for (d, raw) in raw.iter_mut().enumerate() {
                *raw = work.pass.output(shape.net(), 0, s, d).f64();
            }
            return;
        }
        shape.read_slopes(&work.pass, s, &work.states.q[s * n..][..n], raw);
        if let HnnNet::Mass(_) = shape.net
            && let Some(own) = work.scratch.get::<Scratch<T>>()
        {
            for (i, raw) in raw[..n].iter_mut().enumerate() {
                *raw = own.factors.each[s].momentum::<f64>(i);
            }
        }
    }

    /// r and D; the second half of the scratch holds d − τ, `extra` its slopes.
    fn residual<T: Real>(&self, s: usize, work: &mut Work<T>) {
        let n = self.shape.dof();
        let (k, force_terms) = (2 * n, self.forces.force_terms());
        work.linear.d[s * k * k..][..k * k].fill(0.0);
        for i in 0..n {
            let (v, f) = (s * k + i, s * k + n + i);
            let Unit { rate, force, start } = self.shape.unit(i, work.states.p[s * n + i]);
            let speed = rate * work.linear.along[v] + start;
            work.linear.residual[v] = self.weights[i] * (speed - work.states.qd[s * n + i]);
            work.linear.d[(s * k + i) * k + i] = self.weights[i] * rate;
            let push = force * work.linear.along[f] - work.mechanics.scratch[n + i];
            work.linear.residual[f] = self.weights[n + i] * (push - work.states.pd[s * n + i]);
            work.linear.d[(s * k + n + i) * k + n + i] = self.weights[n + i] * force;
            for slope in &mut work.linear.extra[f * force_terms..][..force_terms] {
                *slope /= -force;
            }
        }
    }

    /// Fills the components of a pass that [`Learner::terms`] names, for `directions` scalars Σⱼ weight(s, d, j) Sⱼ.
    fn sensitivities<T: Real>(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: impl Fn(usize, usize, usize) -> f64,
    ) {
        let (shape, net, n) = (self.shape, self.shape.net(), self.shape.dof());
        let samples = work.pass.samples();
        for s in 0..samples {
            for d in 0..directions {
                let q = &work.states.q[s * n..][..n];
                shape.write_tangent(&mut work.pass, (s, d), q, |j| weight(s, d, j));
            }
        }
        work.pass.forward_tangents(net, packed, directions);
        let HnnNet::Mass(delan) = &shape.net else {
            let nothing = |_, _, _| T::default();
            return work.pass.reverse_tangents(net, packed, directions, nothing);
        };
        let outputs = delan.factor_outputs();
        let (mut beta, mut rates) = ([0.0; 64], vec![0.0; outputs]);
        let mut own = work.scratch.take::<Scratch<T>>();
        let Scratch { factors, seeds, .. } = &mut *own;
        seeds.resize(2 * n * samples * outputs, 0.0);
        for s in 0..samples {
            for d in 0..directions {
                for (i, b) in beta[..n].iter_mut().enumerate() {
                    *b = weight(s, d, i);
                }
                let pass = &work.pass;
                let values = &mut seeds[(d * samples + s) * outputs..][..outputs];
                let hat = |o| pass.output(net, 2 + d, s, o).f64();
                factors.each[s].sensitivities(&beta[..n], hat, &mut rates, values);
            }
        }
        let seed = |c: usize, s: usize, o: usize| match c.checked_sub(directions) {
            None => T::default(),
            Some(d) => T::of(seeds[(d * samples + s) * outputs + o]),
        };
        work.pass.reverse_tangents(net, packed, directions, seed);
        work.scratch.put(own);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::{HnnConfig, HnnStructure};
    use super::*;
    use crate::train::tests::{assert_step_solves, forces, gradient_error, samples};
    use crate::train::{ForceTerms, Loss};
    use lagrangian_mechanics::lagrangian::Scaling;
    use lagrangian_motion::Coordinates;
    use lagrangian_motion::Samples;
    use lagrangian_motion::Signals;

    fn shape(
        n: usize,
        structure: HnnStructure,
        momenta: Momenta,
        speed_limit: Option<f64>,
    ) -> HnnShape {
        let config = HnnConfig {
            structure,
            momenta,
            speed_limit,
            width: 16,
            ..Default::default()
        };
        let scaling = Scaling {
            energy: 1.7,
            qd_scale: (0..n).map(|i| 1.3 + 0.2 * i as f64).collect(),
            ..Scaling::identity(n)
        };
        HnnShape::new(Coordinates::angles(n), config, scaling).unwrap()
    }

    fn recorded(n: usize, m: usize) -> Samples {
        let other = samples(n, 2 * m);
        Samples {
            signals: Signals {
                p: other.qd[..m * n].to_vec(),
                pd: other.qdd[..m * n].to_vec(),
                ..samples(n, m).signals
            },
            ..samples(n, m)
        }
    }

    fn each(mut check: impl FnMut(&HnnLearner<'_>, usize)) {
        for n in [1, 2, 3] {
            for (structure, momenta, limit) in [
                (HnnStructure::Free, Momenta::Recorded, None),
                (HnnStructure::Free, Momenta::Recorded, Some(2.5)),
                (HnnStructure::Mass, Momenta::Recorded, None),
                (HnnStructure::Mass, Momenta::Masses(vec![0.7; n]), None),
                (HnnStructure::Free, Momenta::Velocities, None),
                (HnnStructure::None, Momenta::Velocities, None),
            ] {
                let friction = momenta.canonical();
                let shape = shape(n, structure, momenta, limit);
                let weights: Vec<f64> = (0..2 * n).map(|i| 0.8 + 0.1 * i as f64).collect();
                let terms = match friction {
                    true => ForceTerms::friction(),
                    false => ForceTerms::default(),
                };
                let learner = HnnLearner {
                    shape: &shape,
                    loss: Loss::ACCELERATION,
                    weights: &weights,
                    forces: forces(terms, n),
                    nominal: None,
                    phase: false,
                };
                check(&learner, n);
            }
        }
    }

    #[test]
    fn the_gradient_through_hamiltons_equations_agrees_with_differences() {
        each(|learner, n| {
            let error = gradient_error(learner, learner.loss, &recorded(n, 37));
            let config = &learner.shape.config;
            assert!(error < 1e-7, "n {n} {config:?}: {error:e}");
        });
    }

    #[test]
    fn a_natural_step_of_a_hamiltonian_network_shrinks_every_residual_by_its_rate() {
        each(|learner, n| {
            // Few samples: the residuals of a smooth scalar at near states depend on each other.
            assert_step_solves(learner, learner.loss, &recorded(n, 3));
        });
    }
}
