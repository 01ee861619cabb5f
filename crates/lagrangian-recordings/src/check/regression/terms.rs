//! Terms of a regressor that fits any machine roughly: only its coordinates are known.

use std::ops::Range;

use lagrangian_motion::Coordinates;

/// Velocity scales on which dry friction may change its sign, relative to the root mean square of the velocity.
const FRICTION: [f64; 2] = [0.05, 0.3];

/// The terms of the regressor.
pub(super) struct Terms<'a> {
    pub(super) coordinates: &'a Coordinates,
    pub(super) speeds: &'a [f64],
    /// The velocities that friction may depend on.
    pub(super) rubbing: FrictionCoupling,
}

/// The joints whose velocities the friction of one joint may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrictionCoupling {
    /// Its neighbours and itself.
    Neighbours,
    /// All velocities, to find the one that a force brakes.
    All,
}

/// Number of terms of friction with one velocity.
pub(super) const RUBBING: usize = 1 + FRICTION.len();

/// Values of these terms at `speed`, the root mean square of the velocity.
pub(super) fn friction_at(speed: f64) -> [f64; RUBBING] {
    let [sharp, smooth] = FRICTION.map(|part| (1.0 / part).tanh());
    [speed, sharp, smooth]
}

impl Terms<'_> {
    /// The row of joint `i` at one state; returns the number of terms that q̈ᵢ multiplies, which come first.
    pub(super) fn row(
        &self,
        i: usize,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        out: &mut Vec<f64>,
    ) -> usize {
        out.clear();
        let n = q.len();
        let near = |j: usize| n <= 2 || j.abs_diff(i) <= 1;
        let neighbours: Vec<usize> = (0..n).filter(|&j| near(j)).collect();
        let mut shapes = Vec::new();
        for &j in &neighbours {
            shapes.extend(self.shapes(j, q[j]));
            if j + 1 < n && near(j + 1) {
                shapes.extend([(q[j] - q[j + 1]).sin(), (q[j] - q[j + 1]).cos()]);
            }
        }
        out.push(qdd[i]);
        out.extend(shapes.iter().map(|s| s * qdd[i]));
        let own = out.len();
        out.extend((0..n).filter(|&j| j != i).map(|j| qdd[j]));
        for &j in neighbours.iter().filter(|&&j| j != i) {
            out.extend(shapes.iter().map(|s| s * qdd[j]));
        }
        for (k, &a) in neighbours.iter().enumerate() {
            for &b in &neighbours[k..] {
                out.extend(shapes.iter().map(|s| s * qd[a] * qd[b]));
            }
        }
        out.push(1.0);
        let rubs = |j: &usize| self.rubbing == FrictionCoupling::All || near(*j);
        for j in (0..n).filter(rubs) {
            out.push(qd[j]);
            out.extend(FRICTION.map(|part| (qd[j] / (part * self.speeds[j])).tanh()));
        }
        for a in 0..n {
            out.extend(self.shapes(a, q[a]));
            let mut sum = q[a];
            for next in &q[a + 1..] {
                sum += next;
                out.extend([sum.sin(), sum.cos()]);
            }
        }
        own
    }

    /// Indices of the friction terms in a row of `size` terms, where friction may depend on all velocities: `[n, RUBBING]`.
    pub(super) fn friction(&self, size: usize) -> Range<usize> {
        let n = self.coordinates.dof();
        let mut gravity = n * (n - 1);
        gravity += (0..n).map(|j| self.shapes(j, 0.0).len()).sum::<usize>();
        size - gravity - n * RUBBING..size - gravity
    }

    /// Functions of one coordinate.
    fn shapes(&self, j: usize, q: f64) -> Vec<f64> {
        let mut shapes = vec![q.sin(), q.cos()];
        if !self.coordinates.is_circle(j) {
            shapes.push(q);
        }
        shapes
    }
}
