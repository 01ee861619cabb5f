//! Points of a deep Lagrangian network: α p is M (α v), the inertial force of an acceleration α v at rest.

use super::{DelanShape, Outputs, Scratch};
use crate::models::NetworkShape;
use crate::train::Work;
use crate::train::{Derivatives, PointFamily};
use nets::Packed;
use nets::simd::Real;

impl<T: Real> PointFamily<T> for DelanShape {
    /// The outputs do not change along q̇ here, so that all terms of ′ vanish.
    fn pairs(&self, d: usize, directions: usize) -> [(usize, usize); 2] {
        [(0, 2 + d), (1 + directions + d, 0)]
    }

    fn evaluate(&self, packed: &Packed<T>, work: &mut Work<T>, _derivatives: Derivatives) {
        let (shape, n) = (self, self.dof());
        let (energy, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        let points = work.pass.samples();
        let still = &mut work.mechanics.scratch[..n];
        still.fill(0.0);
        for point in 0..points {
            let q = &work.points.q[point * n..][..n];
            shape.write(&mut work.pass, point, q, still);
        }
        work.pass.forward(&shape.net, packed, Some(0));
        let mut own = work.scratch.take::<Scratch<T>>();
        let v = |point: usize, i: usize| work.points.v[point * n + i] / scale[i];
        own.factors
            .read(shape, packed, &mut work.pass, Outputs::Moving, v);
        for point in 0..points {
            let factor = &own.factors.each[point];
            let dl_dq = &mut work.mechanics.jet.dl_dq[point * n..][..n];
            shape.slope(&work.pass, point, dl_dq);
            dl_dq.iter_mut().for_each(|x| *x *= energy);
            for i in 0..n {
                work.mechanics.jet.momentum[point * n + i] =
                    energy / scale[i] * factor.momentum::<f64>(i);
                for j in 0..n {
                    work.mechanics.jet.mass_matrix[(point * n + i) * n + j] =
                        energy / (scale[i] * scale[j]) * factor.mass::<f64>(i, j);
                }
            }
        }
        work.scratch.put(own);
    }

    fn sensitivities(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: &dyn Fn(usize, usize, usize) -> f64,
    ) {
        let (shape, n) = (self, self.dof());
        let (points, outputs) = (work.pass.samples(), shape.factor_outputs());
        let scale = &shape.scaling.qd_scale;
        let mut own = work.scratch.take::<Scratch<T>>();
        own.seeds.resize(2 * n * points * outputs, 0.0);
        for point in 0..points {
            let beta = work.points.slope[point];
            for d in 0..directions {
                let along = |i: usize| -beta * weight(point, d, i);
                shape.write_tangent(&mut work.pass, (point, d), along);
            }
        }
        work.pass.forward_tangents(&shape.net, packed, directions);
        let linear = n * (n + 1) / 2 + 1;
        let mut beta = [0.0; crate::train::MAX_DOF];
        for point in 0..points {
            let (v, alpha) = (
                &work.points.v[point * n..][..n],
                work.points.momentum[point],
            );
            let factor = &mut own.factors.each[point];
            factor.accelerate(|i| alpha * v[i] / scale[i]);
            for d in 0..directions {
                for (i, b) in beta[..n].iter_mut().enumerate() {
                    *b = weight(point, d, i) / scale[i];
                }
                let pass = &work.pass;
                let (rates, values) = own.seeds.split_at_mut(directions * points * outputs);
                let at = (d * points + point) * outputs;
                let values = &mut values[at..at + outputs];
                let hat = |o: usize| pass.output(&shape.net, 2 + d, point, o).f64();
                factor.sensitivities(&beta[..n], hat, &mut rates[at..at + outputs], values);
                // The vector potential contributes to the momentum too.
                let potential = values[linear..].iter_mut().zip(&beta);
                potential.for_each(|(x, b)| *x += alpha * b);
            }
        }
        let seeds = &own.seeds;
        let seed = |c: usize, s: usize, o: usize| T::of(seeds[(c * points + s) * outputs + o]);
        work.pass
            .reverse_tangents(&shape.net, packed, directions, seed);
        work.scratch.put(own);
    }
}
