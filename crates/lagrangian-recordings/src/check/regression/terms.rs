//! Terms of a regressor that fits any machine roughly: only its coordinates are known.

use std::ops::Range;

use lagrangian_motion::Coordinates;

/// Velocity scales on which dry friction may change its sign, relative to the root mean square of the velocity.
const FRICTION: [f64; 2] = [0.05, 0.3];

/// The terms of the regressor.
pub(super) struct Terms<'a> {
    pub(super) coordinates: &'a Coordinates,
    pub(super) speeds: &'a [f64],
    /// Mean and deviation of each position.
    pub(super) places: &'a [(f64, f64)],
    pub(super) shapes: Shapes,
    /// The velocities that friction may depend on.
    pub(super) rubbing: FrictionCoupling,
}

/// The functions of the positions that multiply accelerations and products of velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shapes {
    /// Those of a chain of joints: sines and cosines of neighbours and their differences, and positions themselves.
    OfChains,
    /// All products of functions of single positions up to this degree.
    Products(usize),
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

/// Values of these terms at `speed`, where `usual` is the root mean square of the velocity.
pub(super) fn friction_at(speed: f64, usual: f64) -> [f64; RUBBING] {
    let [sharp, smooth] = FRICTION.map(|part| (speed / (part * usual)).tanh());
    [speed, sharp, smooth]
}

/// Whether joint `j` of `n` is next to joint `i`.
fn near(n: usize, i: usize, j: usize) -> bool {
    n <= 2 || j.abs_diff(i) <= 1
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
        match self.shapes {
            Shapes::OfChains => self.row_of_chain(i, [q, qd, qdd], out),
            Shapes::Products(degree) => {
                let shapes = self.products(q, degree);
                out.clear();
                out.extend(shapes.iter().map(|s| s * qdd[i]));
                let others = (0..q.len()).filter(|j| *j != i).map(|j| qdd[j]);
                let squares = (0..q.len()).flat_map(|a| qd[..=a].iter().map(move |v| v * qd[a]));
                for factor in others.chain(squares).chain([1.0]) {
                    out.extend(shapes.iter().map(|s| s * factor));
                }
                let rubbing = (0..q.len()).filter(|j| self.rubs(i, *j));
                rubbing.for_each(|j| out.extend(friction_at(qd[j], self.speeds[j])));
                shapes.len()
            }
        }
    }

    /// The same of the terms of a chain.
    fn row_of_chain(&self, i: usize, [q, qd, qdd]: [&[f64]; 3], out: &mut Vec<f64>) -> usize {
        out.clear();
        let n = q.len();
        let neighbours: Vec<usize> = (0..n).filter(|&j| near(n, i, j)).collect();
        let mut shapes = Vec::new();
        for &j in &neighbours {
            shapes.extend(self.shapes(j, q[j]));
            if j + 1 < n && near(n, i, j + 1) {
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
        let rubbing = (0..n).filter(|j| self.rubs(i, *j));
        rubbing.for_each(|j| out.extend(friction_at(qd[j], self.speeds[j])));
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

    /// The number of terms of joint `i`.
    pub(super) fn count(&self, i: usize) -> usize {
        let (mut row, none) = (Vec::new(), vec![0.0; self.speeds.len()]);
        self.row(i, &none, &none, &none, &mut row);
        row.len()
    }

    fn rubs(&self, i: usize, j: usize) -> bool {
        self.rubbing == FrictionCoupling::All || near(self.speeds.len(), i, j)
    }

    /// All products of sines and cosines of multiples of angles, and powers of the other positions, up to a degree; the first is 1.
    fn products(&self, q: &[f64], degree: usize) -> Vec<f64> {
        let mut all = vec![(1.0, 0)];
        for (j, (q, (mean, deviation))) in q.iter().zip(self.places).enumerate() {
            for k in 0..all.len() {
                let (product, own) = all[k];
                for power in 1..=degree - own {
                    let times = power as f64;
                    if self.coordinates.is_circle(j) {
                        let (sin, cos) = (times * q).sin_cos();
                        all.extend([(product * sin, own + power), (product * cos, own + power)]);
                    } else {
                        let length = (q - mean) / deviation;
                        all.push((product * length.powi(power as i32), own + power));
                    }
                }
            }
        }
        all.into_iter().map(|(product, _)| product).collect()
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
