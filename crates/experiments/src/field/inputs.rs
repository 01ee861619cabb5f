//! What a network sees of three neighbouring points, scaled, and how each input depends on them.

use serde::{Deserialize, Serialize};

use super::stencil::NEIGHBOURS;
use lagrangian::Coordinates;
use lagrangian::trajectory::{Coordinate, Samples, Topology};
use nets::Pass;
use nets::simd::Real;

/// What is known of a field before anything is learned: a change of all values that no law of it notices.
///
/// It decides what a density may depend on beside the differences of neighbours, and so how well long waves come out
/// (theory.md, 70).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Symmetry {
    /// None: the density sees φ itself.
    #[default]
    None,
    /// φ + constant is the same field (a string that nothing holds): the density sees differences alone.
    Shift,
    /// φ + 2π is the same field (an angle): the density sees cos φ and sin φ, and differences of neighbours the short way
    /// round. Where a difference passes half a turn the short way changes, and the energy jumps: take a finer grid.
    Turn,
}

/// Scales that make the inputs of order one; one for all points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldScaling {
    /// Subtracted from φ.
    pub centre: f64,
    /// Divides φ.
    pub value: f64,
    /// Divides differences of φ.
    pub difference: f64,
    /// Divides φ̇.
    pub rate: f64,
    /// Divides differences of φ̇.
    pub difference_rate: f64,
    /// Divides φ̈.
    pub acceleration: f64,
}

impl FieldScaling {
    /// Scales that leave all as it is.
    #[must_use]
    pub fn identity() -> Self {
        Self {
            centre: 0.0,
            value: 1.0,
            difference: 1.0,
            rate: 1.0,
            difference_rate: 1.0,
            acceleration: 1.0,
        }
    }

    /// Of the rings in `samples`: the deviation of the values, root mean squares of all else.
    pub(super) fn of(samples: &Samples, symmetry: Symmetry) -> Self {
        let n = samples.n;
        let differences = |signal: &[f64]| {
            let rings = signal.chunks_exact(n);
            let all = rings.flat_map(|ring| (0..n).map(move |i| ring[(i + 1) % n] - ring[i]));
            all.collect::<Vec<f64>>()
        };
        let mut steps = differences(&samples.q);
        if symmetry == Symmetry::Turn {
            steps.iter_mut().for_each(|x| *x = super::wrapped(*x));
        }
        let centre = samples.q.iter().sum::<f64>() / samples.q.len().max(1) as f64;
        let deviation: Vec<f64> = samples.q.iter().map(|x| x - centre).collect();
        Self {
            centre,
            value: size(&deviation),
            difference: size(&steps),
            rate: size(&samples.qd),
            difference_rate: size(&differences(&samples.qd)),
            acceleration: size(&samples.qdd),
        }
    }
}

/// Root mean square; 1 where it is 0.
fn size(x: &[f64]) -> f64 {
    let mean = x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64;
    if mean > 0.0 { mean.sqrt() } else { 1.0 }
}

/// The inputs of a network at one density.
#[derive(Debug, Clone)]
pub(super) struct Inputs {
    pub(super) symmetry: Symmetry,
    pub(super) scaling: FieldScaling,
}

/// One input: its value, and its derivatives by the three values or the three rates.
type Input = (f64, [f64; NEIGHBOURS]);

impl Inputs {
    /// The coordinates of a density with these inputs.
    pub(super) fn coordinates(&self) -> Coordinates {
        let (unit, topology) = match self.symmetry {
            Symmetry::Turn => ("rad", Topology::Circle),
            _ => ("m", Topology::Line),
        };
        let coordinate = |name| Coordinate::new(name, unit, topology);
        Coordinates(["left", "here", "right"].map(coordinate).to_vec())
    }

    /// How many inputs depend on the values.
    pub(super) fn of_values(&self) -> usize {
        match self.symmetry {
            Symmetry::None => 3,
            Symmetry::Shift => 2,
            Symmetry::Turn => 4,
        }
    }

    /// How many inputs there are; those of the rates come last.
    pub(super) fn count(&self) -> usize {
        self.of_values() + NEIGHBOURS
    }

    /// The inputs that depend on the values φ, of which [`Inputs::of_values`] count.
    pub(super) fn values(&self, phi: &[f64]) -> [Input; 4] {
        let s = &self.scaling;
        let d = 1.0 / s.difference;
        let left = ((phi[1] - phi[0]) * d, [-d, d, 0.0]);
        let right = ((phi[2] - phi[1]) * d, [0.0, -d, d]);
        let none = (0.0, [0.0; NEIGHBOURS]);
        match self.symmetry {
            Symmetry::None => {
                let here = ((phi[1] - s.centre) / s.value, [0.0, 1.0 / s.value, 0.0]);
                [left, right, here, none]
            }
            Symmetry::Shift => [left, right, none, none],
            Symmetry::Turn => {
                let (sin, cos) = phi[1].sin_cos();
                [left, right, (cos, [0.0, -sin, 0.0]), (sin, [0.0, cos, 0.0])]
            }
        }
    }

    /// The derivatives of the inputs that depend on the rates φ̇, to which they are proportional.
    pub(super) fn rates(&self) -> [[f64; NEIGHBOURS]; NEIGHBOURS] {
        let d = 1.0 / self.scaling.difference_rate;
        [
            [-d, d, 0.0],
            [0.0, -d, d],
            [0.0, 1.0 / self.scaling.rate, 0.0],
        ]
    }

    /// Writes the values of the inputs as sample `s`.
    pub(super) fn write<T: Real>(&self, pass: &mut Pass<T>, s: usize, phi: &[f64], phid: &[f64]) {
        let first = self.of_values();
        for (at, (value, _)) in self.values(phi)[..first].iter().enumerate() {
            pass.set_feature(0, s, at, T::of(*value));
        }
        for (at, slopes) in self.rates().iter().enumerate() {
            pass.set_feature(0, s, first + at, T::of(along(slopes, phid)));
        }
    }
}

/// The derivative along a change of the three points.
#[inline]
pub(super) fn along(slopes: &[f64; NEIGHBOURS], change: &[f64]) -> f64 {
    slopes.iter().zip(change).map(|(s, x)| s * x).sum()
}
