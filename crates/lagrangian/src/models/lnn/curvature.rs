//! ∂²L/∂q∂q and ∂p/∂q of a Lagrangian network: one pass with the 2 n tangents of all of (q̇, q).

use super::{Lnn, LnnShape};
use crate::models::NetworkShape;
use crate::models::passes::BLOCK;
use lagrangian_mechanics::lagrangian::Curvature;
use lagrangian_mechanics::lagrangian::scaled::Features;
use nets::Pass;
use nets::simd::Real;

/// Writes them for the `m` states; the first call makes `pass`.
pub(super) fn curvature(
    lnn: &Lnn,
    pass: &mut Option<Pass<f64>>,
    (q, qd): (&[f64], &[f64]),
    curvature: &mut Curvature,
) {
    let (shape, n) = (&lnn.shape, lnn.shape.dof());
    let m = q.len() / n;
    curvature.resize(m, n);
    let pass = pass.get_or_insert_with(|| Pass::new(&shape.net, BLOCK, 2 * n));
    for start in (0..m).step_by(BLOCK) {
        let count = BLOCK.min(m - start);
        for s in 0..BLOCK {
            let row = (start + if s < count { s } else { 0 }) * n;
            shape.write(pass, s, &q[row..][..n], &qd[row..][..n], None);
            shape.write_positions(pass, s, &q[row..][..n]);
        }
        pass.forward_for_reverse(&shape.net, &lnn.packed, 2 * n, 1);
        pass.reverse(&shape.net, &lnn.packed, 2 * n);
        for s in 0..count {
            let row = start + s;
            shape.read_curvature(pass, (s, row), &q[row * n..][..n], curvature);
        }
    }
}

impl LnnShape {
    /// Writes the directions of the coordinates as tangents n … 2 n − 1 of sample `s`.
    fn write_positions<T: Real>(&self, pass: &mut Pass<T>, s: usize, q: &[f64]) {
        let n = self.dof();
        let mut at = 0;
        for (i, &q) in q.iter().enumerate() {
            let features = Features::new(&self.coordinates, &self.scaling, i, q);
            for slope in &features.slopes[..features.count] {
                for d in 0..n {
                    let one = if d == i { *slope } else { 0.0 };
                    pass.set_feature(2 + n + d, s, at, T::of(one));
                }
                at += 1;
            }
        }
        for d in 0..n {
            (0..n).for_each(|i| self.set_velocity(pass, 2 + n + d, s, at, i, T::default()));
        }
    }

    /// Reads sample `s` into row `row`. The features of an angle bend, so that ∂L/∂x enters the diagonal.
    fn read_curvature<T: Real>(
        &self,
        pass: &Pass<T>,
        (s, row): (usize, usize),
        q: &[f64],
        curvature: &mut Curvature,
    ) {
        let (n, e) = (self.dof(), self.scaling.energy);
        let mut at = 0;
        for (i, &q) in q.iter().enumerate() {
            let features = Features::new(&self.coordinates, &self.scaling, i, q);
            let mut bend = 0.0;
            for k in &features.bends[..features.count] {
                bend += pass.feature_gradient(s, at).f64() * k;
                at += 1;
            }
            for j in 0..n {
                let entry = (row * n + i) * n + j;
                let second = |t, u| pass.second_derivative(s, t, Some(u), 2 * n).f64();
                let own = if i == j { bend } else { 0.0 };
                curvature.dl_dqdq[entry] = e * (second(n + i, n + j) + own);
                curvature.dp_dq[entry] = e * second(i, n + j);
            }
        }
        curvature.hold(&self.coordinates, row);
    }
}
