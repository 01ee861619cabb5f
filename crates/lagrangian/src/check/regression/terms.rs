//! The terms of a regressor that fits any machine roughly: nothing but its coordinates is known.

use crate::Coordinates;

/// The speeds over which dry friction may change its sign, in parts of the root mean square of the velocity.
const FRICTION: [f64; 2] = [0.05, 0.3];

/// The terms of the regressor.
pub(super) struct Terms<'a> {
    pub(super) coordinates: &'a Coordinates,
    pub(super) speeds: &'a [f64],
}

impl Terms<'_> {
    /// The row of joint `i` at one state; the first terms are those that q̈ᵢ multiplies, as many as the number
    /// returned.
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
        for &j in &neighbours {
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

    /// Functions of one coordinate.
    fn shapes(&self, j: usize, q: f64) -> Vec<f64> {
        let mut shapes = vec![q.sin(), q.cos()];
        if !self.coordinates.is_circle(j) {
            shapes.push(q);
        }
        shapes
    }
}
