//! The opponent: a plain network of the same three points, (φ, φ̇) → φ̈, without a Lagrangian.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::density::DensityConfig;
use super::inputs::{FieldScaling, Inputs};
use super::ring::check_points;
use super::stencil::{NEIGHBOURS, gather, gather_angles};
use lagrangian::dynamics::{Evaluator, Model};
use lagrangian::trajectory::Coordinate;
use lagrangian::{Coordinates, Result};
use nets::{Net, Packed, Pass};

/// φ̈ᵢ = s N(what a [`DensityNet`](super::DensityNet) sees), the same at every point: a convolution over the ring.
///
/// Same inputs, size, scales and optimiser as the density; but it knows no energy, and no point further than its
/// neighbours.
#[derive(Debug, Clone)]
pub struct StencilNet {
    pub(super) shape: StencilShape,
    parameters: Vec<f64>,
    packed: Packed<f64>,
}

/// All of a [`StencilNet`] but its weights.
#[derive(Debug, Clone)]
pub(super) struct StencilShape {
    pub(super) config: DensityConfig,
    pub(super) inputs: Inputs,
    pub(super) net: Net,
}

impl StencilShape {
    pub(super) fn new(config: DensityConfig, scaling: FieldScaling) -> Self {
        let inputs = Inputs::new(config.symmetry, scaling);
        Self {
            net: config.net(&inputs, true),
            config,
            inputs,
        }
    }

    pub(super) fn initialise(&self, seed: u64) -> Vec<f64> {
        self.net.initialise(&mut ChaCha8Rng::seed_from_u64(seed))
    }
}

impl StencilNet {
    pub(super) fn assemble(shape: StencilShape, parameters: Vec<f64>) -> Result<Self> {
        let packed = Packed::of(&shape.net, &parameters)?;
        Ok(Self {
            shape,
            parameters,
            packed,
        })
    }

    /// All weights, layer by layer.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Its configuration.
    #[must_use]
    pub fn config(&self) -> &DensityConfig {
        &self.shape.config
    }

    /// The same network at every point of a ring.
    ///
    /// # Errors
    /// [`lagrangian::Error::Argument`] for fewer than three points.
    pub fn ring(&self, points: usize) -> Result<StencilField<'_>> {
        check_points(points)?;
        let here = self.shape.inputs.coordinates().0.swap_remove(1);
        let coordinate = |i| Coordinate {
            name: format!("phi{i}"),
            ..here.clone()
        };
        Ok(StencilField {
            net: self,
            coordinates: Coordinates((1..=points).map(coordinate).collect()),
        })
    }
}

/// A [`StencilNet`] on a ring, as a model without energy.
#[derive(Debug, Clone)]
pub struct StencilField<'a> {
    net: &'a StencilNet,
    coordinates: Coordinates,
}

impl Model for StencilField<'_> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        let points = self.coordinates.dof();
        Box::new(StencilEvaluator {
            net: self.net,
            circle: self.coordinates.is_circle(0),
            points,
            pass: Pass::new(&self.net.shape.net, BLOCK, 0),
            phi: vec![0.0; points * NEIGHBOURS],
            phid: vec![0.0; points * NEIGHBOURS],
        })
    }
}

/// Points that go through the network together.
const BLOCK: usize = 16;

struct StencilEvaluator<'a> {
    net: &'a StencilNet,
    circle: bool,
    points: usize,
    pass: Pass<f64>,
    phi: Vec<f64>,
    phid: Vec<f64>,
}

impl StencilEvaluator<'_> {
    fn ring(&mut self, phi: &[f64], phid: &[f64], tau: &[f64], out: &mut [f64]) {
        const N: usize = NEIGHBOURS;
        if self.circle {
            gather_angles(phi, &mut self.phi);
        } else {
            gather(phi, &mut self.phi);
        }
        gather(phid, &mut self.phid);
        let shape = &self.net.shape;
        let scale = shape.inputs.scaling.acceleration;
        for start in (0..out.len()).step_by(BLOCK) {
            let count = BLOCK.min(out.len() - start);
            for s in 0..BLOCK {
                let at = (start + if s < count { s } else { 0 }) * N;
                let (phi, phid) = (&self.phi[at..at + N], &self.phid[at..at + N]);
                shape.inputs.write(&mut self.pass, s, phi, phid);
            }
            self.pass.forward(&shape.net, &self.net.packed, None);
            for s in 0..count {
                let found = self.pass.output(&shape.net, 0, s, 0);
                // A force acts on unit masses.
                out[start + s] = scale * found + tau[start + s];
            }
        }
    }
}

impl Evaluator for StencilEvaluator<'_> {
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize {
        let n = self.points;
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        for ((q, qd), (tau, qdd)) in states.zip(signals) {
            self.ring(q, qd, tau, qdd);
        }
        0
    }

    fn inverse_dynamics(&mut self, _: &[f64], _: &[f64], _: &[f64], _: &mut [f64]) -> bool {
        false
    }

    fn energy(&mut self, _: &[f64], _: &[f64], _: &mut [f64]) -> bool {
        false
    }
}
