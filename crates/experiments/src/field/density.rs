//! Networks of three neighbouring points, and a density that is one.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::inputs::{FieldScaling, Inputs, Symmetry, along};
use super::stencil::NEIGHBOURS;
use lagrangian::mechanics::{Jet, Jets, Lagrangian};
use lagrangian::{Coordinates, Result};
use nets::simd::Real;
use nets::{Activation, Build, Net, Packed, Pass};

/// The shape of a network of three neighbouring points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DensityConfig {
    /// What is known of the field.
    pub symmetry: Symmetry,
    /// Units of a hidden layer.
    pub width: usize,
    /// Hidden layers.
    pub layers: usize,
    /// Nonlinearity.
    pub activation: Activation,
    /// κ of the term ½ κ φ̇² that a density starts from.
    pub kinetic: f64,
}

impl Default for DensityConfig {
    fn default() -> Self {
        Self {
            symmetry: Symmetry::default(),
            width: 32,
            layers: 2,
            activation: Activation::default(),
            kinetic: 1.0,
        }
    }
}

/// What a network of three neighbouring points gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Output {
    /// A density, from which the motion follows.
    Density,
    /// The acceleration of the point in the middle: the plain network.
    Acceleration,
}

/// All of a network of three neighbouring points but its weights.
#[derive(Debug, Clone)]
pub(super) struct Shape {
    pub(super) output: Output,
    pub(super) config: DensityConfig,
    pub(super) inputs: Inputs,
    pub(super) net: Net,
}

/// A network of three neighbouring points with its weights.
#[derive(Debug, Clone)]
pub(crate) struct Weighted {
    pub(super) shape: Shape,
    pub(super) parameters: Vec<f64>,
    pub(super) packed: Packed<f64>,
}

impl Weighted {
    pub(super) fn new(shape: Shape, parameters: Vec<f64>) -> Result<Self> {
        Ok(Self {
            packed: Packed::of(&shape.net, &parameters)?,
            shape,
            parameters,
        })
    }
}

/// A network as the density of a field: ℓ = s² N(x) + ½ κ φ̇₀², s the scale of φ̇ (theory.md, 69).
///
/// It is a Lagrangian of the values left, here and right; [`Field`](super::Field) sums it over a ring of any size.
#[derive(Debug, Clone)]
pub struct DensityNet {
    pub(super) network: Weighted,
    coordinates: Coordinates,
}

impl DensityNet {
    /// A network with random weights.
    ///
    /// # Errors
    /// None of its own: those of the kernels.
    pub fn random(config: DensityConfig, scaling: FieldScaling, seed: u64) -> Result<Self> {
        let shape = Shape::new(Output::Density, config, scaling);
        let parameters = shape.initialise(seed);
        Ok(Self::of(Weighted::new(shape, parameters)?))
    }

    pub(super) fn of(network: Weighted) -> Self {
        Self {
            coordinates: network.shape.inputs.coordinates(),
            network,
        }
    }

    /// All weights, layer by layer.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.network.parameters
    }
}

impl Shape {
    pub(super) fn new(output: Output, config: DensityConfig, scaling: FieldScaling) -> Self {
        let inputs = Inputs {
            symmetry: config.symmetry,
            scaling,
        };
        let mut build = Build::new(inputs.count(), 0);
        let top = build.stack(config.layers, config.width, config.activation);
        match output {
            // A constant says nothing in a Lagrangian.
            Output::Density => build.linear(1, &[top]),
            Output::Acceleration => build.dense(1, &[top], None),
        };
        Self {
            output,
            net: build.finish(),
            config,
            inputs,
        }
    }

    /// Random weights; those of the output of a density are small, so that the mass matrix of a whole ring begins near κ:
    /// one that begins indefinite may stay so.
    pub(super) fn initialise(&self, seed: u64) -> Vec<f64> {
        let mut parameters = self.net.initialise(&mut ChaCha8Rng::seed_from_u64(seed));
        if self.output == Output::Density {
            let output = parameters.len() - self.config.width;
            let weights = parameters[output..].iter_mut();
            weights.for_each(|w| *w *= FIRST_OUTPUT);
        }
        parameters
    }

    /// Energy of one unit of the network's output.
    pub(super) fn energy(&self) -> f64 {
        self.inputs.scaling.rate.powi(2)
    }

    /// Writes a state as sample `s`: the value, ′ = the motion, and i = the directions of the three rates.
    pub(super) fn write<T: Real>(&self, pass: &mut Pass<T>, s: usize, phi: &[f64], phid: &[f64]) {
        self.inputs.write(pass, s, phi, phid);
        let first = self.inputs.of_values();
        for (at, (_, slopes)) in self.inputs.values(phi)[..first].iter().enumerate() {
            pass.set_feature(1, s, at, T::of(along(slopes, phid)));
            (0..NEIGHBOURS).for_each(|d| pass.set_feature(2 + d, s, at, T::default()));
        }
        for (at, slopes) in self.inputs.rates().iter().enumerate() {
            pass.set_feature(1, s, first + at, T::default());
            for (d, &slope) in slopes.iter().enumerate() {
                pass.set_feature(2 + d, s, first + at, T::of(slope));
            }
        }
    }

    /// Writes the mixed components of sample `s`, so that that of direction a of the output is
    /// d/dt ∂N/∂φ̇ₐ − ∂N/∂φₐ (theory.md, equations 12 and 16).
    pub(super) fn write_mixed<T: Real>(&self, pass: &mut Pass<T>, s: usize, phi: &[f64]) {
        let first = self.inputs.of_values();
        for (at, (_, slopes)) in self.inputs.values(phi)[..first].iter().enumerate() {
            for (d, slope) in slopes.iter().enumerate() {
                pass.set_mixed_feature(d, s, at, T::of(-slope));
            }
        }
    }

    /// Reads sample `s` of a pass that has been forward and back into row `row` of `jet`.
    pub(super) fn read<T: Real>(
        &self,
        pass: &Pass<T>,
        (s, row): (usize, usize),
        phi: &[f64],
        phid: &[f64],
        jet: &mut Jet,
    ) {
        const N: usize = NEIGHBOURS;
        let (e, kinetic, first) = (self.energy(), self.config.kinetic, self.inputs.of_values());
        let values = self.inputs.values(phi).map(|(_, slopes)| slopes);
        let rates = self.inputs.rates();
        // The derivative by point a through the inputs that depend on it.
        let through = |from: usize, slopes: &[[f64; N]], a: usize| -> f64 {
            let inputs = slopes.iter().enumerate();
            e * inputs
                .map(|(at, slopes)| pass.feature_gradient(s, from + at).f64() * slopes[a])
                .sum::<f64>()
        };
        for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
            let m = pass.second_derivative(s, a, Some(b), N).f64();
            jet.mass_matrix[(row * N + a) * N + b] = e * m;
        }
        for a in 0..N {
            jet.dl_dq[row * N + a] = through(0, &values[..first], a);
            jet.momentum[row * N + a] = through(first, &rates, a);
            jet.momentum_drift[row * N + a] = e * pass.second_derivative(s, a, None, N).f64();
        }
        jet.momentum[row * N + 1] += kinetic * phid[1];
        jet.mass_matrix[row * N * N + N + 1] += kinetic;
        let value = pass.output(&self.net, 0, s, 0).f64();
        jet.lagrangian[row] = e * value + 0.5 * kinetic * phid[1].powi(2);
    }
}

impl Lagrangian for DensityNet {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DensityJets {
            network: &self.network,
            pass: Pass::new(&self.network.shape.net, BLOCK, NEIGHBOURS),
        })
    }
}

/// Share of the usual random weights that the output starts with.
const FIRST_OUTPUT: f64 = 0.1;

/// Densities that go through the network together.
const BLOCK: usize = 16;

struct DensityJets<'a> {
    network: &'a Weighted,
    pass: Pass<f64>,
}

impl Jets for DensityJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        const N: usize = NEIGHBOURS;
        let (Weighted { shape, packed, .. }, pass) = (self.network, &mut self.pass);
        let m = q.len() / N;
        jet.resize(m, N);
        for start in (0..m).step_by(BLOCK) {
            let count = BLOCK.min(m - start);
            // The last block repeats its first sample: every lane stays an ordinary state.
            for s in 0..BLOCK {
                let at = (start + if s < count { s } else { 0 }) * N;
                shape.write(pass, s, &q[at..at + N], &qd[at..at + N]);
            }
            pass.forward_for_reverse(&shape.net, packed, N, 1);
            pass.reverse(&shape.net, packed, N);
            for s in 0..count {
                let at = (start + s) * N;
                shape.read(pass, (s, start + s), &q[at..at + N], &qd[at..at + N], jet);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;
    use lagrangian::analytic::{ClosedForm, DualJets, DualNum};

    impl Inputs {
        /// All inputs over any scalar.
        fn evaluate<D: DualNum<Primitive = f64> + Copy>(&self, phi: &[D], phid: &[D]) -> Vec<D> {
            let s = &self.scaling;
            let mut x = vec![
                (phi[1] - phi[0]) / s.difference,
                (phi[2] - phi[1]) / s.difference,
            ];
            match self.symmetry {
                Symmetry::None => x.push((phi[1] - s.centre) / s.value),
                Symmetry::Shift => {}
                Symmetry::Turn => x.extend([phi[1].cos(), phi[1].sin()]),
            }
            for pair in phid.windows(2) {
                x.push((pair[1] - pair[0]) / s.difference_rate);
            }
            x.push(phid[1] / s.rate);
            x
        }
    }

    /// The slow, plain evaluation that the kernels are tested against.
    impl ClosedForm for DensityNet {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
            let Shape {
                config,
                inputs,
                net,
                ..
            } = &self.network.shape;
            let x = inputs.evaluate(q, qd);
            let value = net.evaluate(&self.network.parameters, &x, &[])[0];
            value * self.network.shape.energy() + qd[1] * qd[1] * (0.5 * config.kinetic)
        }
    }

    fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
        let pairs = a.iter().zip(b);
        pairs.fold(0.0, |worst, (a, b)| (a - b).abs().max(worst))
    }

    #[test]
    fn the_kernels_agree_with_dual_numbers_for_every_symmetry() {
        let scaling = FieldScaling {
            centre: 0.3,
            value: 1.7,
            difference: 0.6,
            rate: 1.3,
            difference_rate: 0.8,
            acceleration: 2.0,
        };
        let state = |from: f64| (0..30).map(|k| (from + 1.7 * f64::from(k)).sin()).collect();
        let (phi, phid): (Vec<f64>, Vec<f64>) = (state(0.1), state(0.9));
        for symmetry in [Symmetry::None, Symmetry::Shift, Symmetry::Turn] {
            let config = DensityConfig {
                symmetry,
                width: 12,
                ..DensityConfig::default()
            };
            let net = DensityNet::random(config, scaling.clone(), 4).unwrap();
            let (mut fast, mut slow) = (Jet::default(), Jet::default());
            net.jets().jet(&phi, &phid, &mut fast);
            DualJets::new(&net, NEIGHBOURS).jet(&phi, &phid, &mut slow);
            assert!(largest_difference(&fast.lagrangian, &slow.lagrangian) < 1e-14);
            assert!(largest_difference(&fast.dl_dq, &slow.dl_dq) < 1e-13);
            assert!(largest_difference(&fast.momentum, &slow.momentum) < 1e-13);
            assert!(largest_difference(&fast.mass_matrix, &slow.mass_matrix) < 1e-13);
            assert!(largest_difference(&fast.momentum_drift, &slow.momentum_drift) < 1e-13);
        }
    }
}
