//! Points of a Lagrangian network: p and ∂L/∂q are first derivatives, so one direction in (q, q̇) holds both.

use super::LnnShape;
use crate::models::NetworkShape;
use crate::train::Work;
use crate::train::{Derivatives, PointFamily};
use nets::Packed;
use nets::simd::Real;

impl<T: Real> PointFamily<T> for LnnShape {
    /// The tangent ′ is zero, so that the mixed components hold first derivatives.
    fn pairs(&self, d: usize, _directions: usize) -> [(usize, usize); 2] {
        let mixed = 2 + self.dof() + d;
        [(0, mixed), (mixed, 0)]
    }

    fn evaluate(&self, packed: &Packed<T>, work: &mut Work<T>, derivatives: Derivatives) {
        let (shape, n) = (self, self.dof());
        for point in 0..work.pass.samples() {
            let row = point * n..point * n + n;
            let (q, v) = (&work.points.q[row.clone()], &work.points.v[row]);
            shape.write_still(&mut work.pass, point, q, v);
        }
        let directions = match derivatives {
            Derivatives::First => 0,
            Derivatives::WithMass => n,
        };
        work.pass.forward(&shape.net, packed, Some(directions));
        work.pass.reverse(&shape.net, packed, directions);
        for point in 0..work.pass.samples() {
            let row = point * n..point * n + n;
            let v = &work.points.v[row];
            shape.read(
                &work.pass,
                (point, point),
                (v, None),
                &mut work.mechanics.jet,
            );
        }
    }

    fn sensitivities(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: &dyn Fn(usize, usize, usize) -> f64,
    ) {
        let (shape, n) = (self, self.dof());
        for point in 0..work.pass.samples() {
            let row = point * n..point * n + n;
            let v = &work.points.v[row];
            let (alpha, beta) = (work.points.momentum[point], work.points.slope[point]);
            for d in 0..directions {
                let weights = &mut work.mechanics.scratch[..n];
                for (i, w) in weights.iter_mut().enumerate() {
                    *w = beta * weight(point, d, i);
                }
                // Without acceleration, as the tangent ′ is zero.
                shape.write_mixed_positions(&mut work.pass, (d, point), weights);
                shape.write_mixed_velocity(&mut work.pass, (d, point), v, |i| {
                    alpha * weight(point, d, i)
                });
            }
        }
        work.pass.forward_mixed(&shape.net, packed, directions);
        work.pass.reverse_mixed(&shape.net, packed, directions);
    }
}
