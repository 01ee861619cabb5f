//! The plain network of the same three points, (φ, φ̇) → φ̈, without a Lagrangian.

use super::density::Weighted;
use super::stencil::{Neighbours, ring_coordinates};
use lagrangian::mechanics::Evaluation;
use lagrangian::{Coordinates, Evaluator, Model, Result};
use nets::Pass;

/// φ̈ᵢ = s N(what a [`DensityNet`](super::DensityNet) sees), the same at every point of a ring: a convolution.
///
/// It has the inputs, the size, the scales and the optimiser of a density; but it knows no energy, and no point further
/// than its neighbours.
pub(super) struct StencilField<'a> {
    network: &'a Weighted,
    coordinates: Coordinates,
}

impl<'a> StencilField<'a> {
    /// The same network at every point of a ring of at least three.
    pub(super) fn new(network: &'a Weighted, points: usize) -> Result<Self> {
        let here = &network.shape.inputs.coordinates().0[1];
        Ok(Self {
            network,
            coordinates: ring_coordinates(here, points)?,
        })
    }
}

impl Model for StencilField<'_> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(StencilEvaluator {
            network: self.network,
            points: self.coordinates.dof(),
            pass: Pass::new(&self.network.shape.net, BLOCK, 0),
            neighbours: Neighbours::new(self.coordinates.dof(), &self.coordinates.0[0]),
        })
    }
}

/// Points that go through the network together.
const BLOCK: usize = 16;

struct StencilEvaluator<'a> {
    network: &'a Weighted,
    points: usize,
    pass: Pass<f64>,
    neighbours: Neighbours,
}

impl StencilEvaluator<'_> {
    fn ring(&mut self, phi: &[f64], phid: &[f64], tau: &[f64], out: &mut [f64]) {
        self.neighbours.set(phi, phid);
        let Weighted { shape, packed, .. } = self.network;
        let scale = shape.inputs.scaling.acceleration;
        for start in (0..out.len()).step_by(BLOCK) {
            let count = BLOCK.min(out.len() - start);
            for s in 0..BLOCK {
                let (phi, phid) = self.neighbours.at(start + if s < count { s } else { 0 });
                shape.inputs.write(&mut self.pass, s, phi, phid);
            }
            self.pass.forward(&shape.net, packed, None);
            for s in 0..count {
                let found = self.pass.output(&shape.net, 0, s, 0);
                // A force acts on unit masses.
                out[start + s] = scale * found + tau[start + s];
            }
        }
    }
}

impl Evaluator for StencilEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.points;
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        for ((q, qd), (tau, qdd)) in states.zip(signals) {
            self.ring(q, qd, tau, qdd);
        }
        Evaluation::of(qdd, n, 0)
    }
}
