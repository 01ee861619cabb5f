//! Residuals of one ring and their derivatives by the parameters, row by row.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | S | what each density says of each of its points, d/dt ∂N/∂φ̇ₐ − ∂N/∂φₐ | `[points, 3]` |
//! | r | (M⁻¹(−c) − φ̈) / scale | `[points]` |
//! | J | ∂r/∂θ = −(E / scale) M⁻¹ Σ ∂S/∂θ, at the accelerations that the model predicts | `[points, P]` |
//!
//! (theory.md, 71: equation 15 over a ring.) A ring is one block of the network's kernels; the rows cost less than the
//! Gram matrix of all S would, because M⁻¹ mixes 3 S a point to one residual.

use super::density::{Output, Shape};
use super::stencil::{Assembly, NEIGHBOURS, Neighbours, gather, point};
use lagrangian::mechanics::{Jet, Regularity};
use nets::simd::Buffer;
use nets::{Gradient, Net, Packed, Pass, Terms};

/// One ring with the accelerations that belong to it, `[points]` each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ring<'a> {
    pub(super) phi: &'a [f64],
    pub(super) phid: &'a [f64],
    pub(super) phidd: &'a [f64],
}

/// The buffers of one ring at work.
pub(super) struct RowWork {
    pass: Pass<f64>,
    gradient: Gradient<f64>,
    wide: Buffer<f64>,
    terms: Terms,
    neighbours: Neighbours,
    jet: Jet,
    assembly: Assembly,
    /// φ̈ as predicted, and scratch.
    found: Vec<f64>,
    column: Vec<f64>,
    unit: Vec<f64>,
    /// Weights of S, `[points, raw outputs]`.
    weights: Vec<f64>,
}

impl Shape {
    pub(super) fn work(&self, points: usize) -> RowWork {
        const N: usize = NEIGHBOURS;
        let mixed = |a| vec![(0, 2 + N + a), (1, 2 + a), (2 + a, 1), (2 + N + a, 0)];
        let (directions, terms) = match self.output {
            Output::Density => (N, Terms::of_value((0..N).map(mixed).collect())),
            Output::Acceleration => (0, Terms::new(vec![vec![(0, 0)]])),
        };
        let pass = Pass::new(&self.net, points, directions);
        let mut jet = Jet::default();
        jet.resize(points, N);
        RowWork {
            wide: Buffer::new(pass.widest()),
            pass,
            gradient: Gradient::new(&self.net),
            weights: vec![0.0; points * terms.outputs()],
            terms,
            neighbours: Neighbours::new(points, &self.inputs.coordinates().0[1]),
            jet,
            assembly: Assembly::new(points),
            found: vec![0.0; points],
            column: vec![0.0; points],
            unit: vec![0.0; points],
        }
    }

    /// Writes the residuals of a ring, and where `rows` is given, J `[points, P]`. `false` where M was singular: then
    /// all are 0, and the ring weighs nothing.
    pub(super) fn residuals(
        &self,
        packed: &Packed<f64>,
        ring: Ring<'_>,
        work: &mut RowWork,
        residual: &mut [f64],
        mut rows: Option<&mut [f64]>,
    ) -> bool {
        work.neighbours.set(ring.phi, ring.phid);
        let regular = match self.output {
            Output::Density => work.accelerate(self, packed),
            Output::Acceleration => work.predict(self, packed),
        };
        if let Some(rows) = rows.as_deref_mut().filter(|_| regular) {
            match self.output {
                Output::Density => work.density_rows(self, packed, rows),
                Output::Acceleration => work.plain_rows(self, packed, rows),
            }
        }
        let scale = self.inputs.scaling.acceleration;
        for (r, (found, target)) in residual.iter_mut().zip(work.found.iter().zip(ring.phidd)) {
            *r = (found - target) / scale;
        }
        if regular && residual.iter().all(|r| r.abs() < LARGEST) {
            return true;
        }
        residual.fill(0.0);
        if let Some(rows) = rows {
            rows.fill(0.0);
        }
        false
    }
}

/// A residual of more deviations than this comes from a mass matrix that is singular but for rounding.
const LARGEST: f64 = 1e30;

impl RowWork {
    fn write(&mut self, mut put: impl FnMut(&mut Pass<f64>, usize, &[f64], &[f64])) {
        for s in 0..self.found.len() {
            let (phi, phid) = self.neighbours.at(s);
            put(&mut self.pass, s, phi, phid);
        }
    }

    /// φ̈ by the Euler–Lagrange equation, into `found`; `false` where M is singular.
    fn accelerate(&mut self, shape: &Shape, packed: &Packed<f64>) -> bool {
        self.write(|pass, s, phi, phid| shape.write(pass, s, phi, phid));
        self.pass.forward(&shape.net, packed, Some(NEIGHBOURS));
        self.pass.reverse(&shape.net, packed, NEIGHBOURS);
        for s in 0..self.found.len() {
            let (phi, phid) = self.neighbours.at(s);
            shape.read(&self.pass, (s, s), phi, phid, &mut self.jet);
        }
        self.assembly.set(&self.jet);
        self.unit.fill(0.0);
        let found = self.assembly.accelerate(&self.unit, &mut self.found);
        matches!(found, Regularity::Definite | Regularity::Indefinite)
    }

    /// J at the accelerations in `found`.
    fn density_rows(&mut self, shape: &Shape, packed: &Packed<f64>, rows: &mut [f64]) {
        const N: usize = NEIGHBOURS;
        let points = self.found.len();
        gather(&self.found, &mut self.weights);
        self.pass.combine(&shape.net, N, &self.weights, None);
        self.write(|pass, s, phi, _| shape.write_mixed(pass, s, phi));
        self.pass.forward_mixed(&shape.net, packed, N);
        self.pass.reverse_mixed(&shape.net, packed, N);
        let factor = -shape.energy() / shape.inputs.scaling.acceleration;
        for (j, row) in rows.chunks_exact_mut(shape.net.parameters).enumerate() {
            self.unit.fill(0.0);
            self.unit[j] = factor;
            self.assembly
                .solver
                .substitute(&self.unit, &mut self.column);
            for (i, weights) in self.weights.chunks_exact_mut(N).enumerate() {
                for (a, weight) in weights.iter_mut().enumerate() {
                    *weight = self.column[point(i, a, points)];
                }
            }
            self.add_row(&shape.net, row);
        }
    }

    /// φ̈ as a plain network predicts it, into `found`.
    fn predict(&mut self, shape: &Shape, packed: &Packed<f64>) -> bool {
        self.write(|pass, s, phi, phid| shape.inputs.write(pass, s, phi, phid));
        self.pass.forward(&shape.net, packed, None);
        for (s, found) in self.found.iter_mut().enumerate() {
            *found = shape.inputs.scaling.acceleration * self.pass.output(&shape.net, 0, s, 0);
        }
        true
    }

    fn plain_rows(&mut self, shape: &Shape, packed: &Packed<f64>, rows: &mut [f64]) {
        self.pass.reverse_outputs(&shape.net, packed, 1);
        for (j, row) in rows.chunks_exact_mut(shape.net.parameters).enumerate() {
            self.weights.fill(0.0);
            self.weights[j] = 1.0;
            self.add_row(&shape.net, row);
        }
    }

    /// Writes Σ weight ∂S/∂θ to a row.
    fn add_row(&mut self, net: &Net, row: &mut [f64]) {
        let Self {
            pass,
            gradient,
            wide,
            terms,
            weights,
            ..
        } = self;
        gradient.clear();
        pass.pull_back_factors(net, terms, weights, wide, gradient);
        row.fill(0.0);
        gradient.add_to(net, row);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;
    use crate::field::{DensityConfig, FieldScaling, Symmetry};

    fn scaling() -> FieldScaling {
        FieldScaling {
            centre: 0.2,
            value: 0.9,
            difference: 0.8,
            rate: 1.2,
            difference_rate: 1.1,
            acceleration: 1.5,
        }
    }

    #[test]
    fn the_rows_are_the_derivatives_of_the_residuals_by_the_weights() {
        let signal = |from: f64| (0..6).map(move |k| (from + 2.3 * f64::from(k)).sin());
        let [phi, phid, phidd]: [Vec<f64>; 3] = [0.1, 0.7, 1.9].map(|x| signal(x).collect());
        let ring = Ring {
            phi: &phi,
            phid: &phid,
            phidd: &phidd,
        };
        let config = |symmetry| DensityConfig {
            symmetry,
            width: 8,
            ..DensityConfig::default()
        };
        let density = |s| Shape::new(Output::Density, config(s), scaling());
        let plain = Shape::new(Output::Acceleration, config(Symmetry::None), scaling());
        let all = [Symmetry::None, Symmetry::Shift, Symmetry::Turn].map(density);
        for shape in all.into_iter().chain([plain]) {
            let mut theta = shape.initialise(3);
            let (mut packed, mut work) = (Packed::new(&shape.net), shape.work(phi.len()));
            let mut rows = vec![0.0; phi.len() * theta.len()];
            let mut at = |theta: &[f64], rows: Option<&mut [f64]>| {
                packed.set(&shape.net, theta);
                let mut r = vec![0.0; phi.len()];
                assert!(shape.residuals(&packed, ring, &mut work, &mut r, rows));
                r
            };
            at(&theta, Some(&mut rows));
            for k in (0..theta.len()).step_by(7) {
                let (here, h) = (theta[k], 1e-5);
                theta[k] = here + h;
                let above = at(&theta, None);
                theta[k] = here - h;
                let below = at(&theta, None);
                theta[k] = here;
                for (j, (a, b)) in above.iter().zip(&below).enumerate() {
                    let slope = rows[j * theta.len() + k];
                    assert!(
                        ((a - b) / (2.0 * h) - slope).abs() < 1e-8,
                        "{k} {j}: {slope}"
                    );
                }
            }
        }
    }
}
