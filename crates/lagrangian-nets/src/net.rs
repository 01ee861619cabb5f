//! The layers of a network and the places of its parameters.

use std::ops::Range;

use rand::{Rng, RngExt};

use super::Activation;
use super::simd::Real;
use crate::{Error, Result};

/// Source of a layer: the features or an earlier layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The features of the sample.
    Features,
    /// The layer of this index.
    Layer(usize),
}

/// A source of a dense layer, and the signs of its weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighted {
    /// Weights of any sign.
    Any(Source),
    /// Weights ≥ 0, so that the layer is convex in its source.
    NonNegative(Source),
}

impl From<Source> for Weighted {
    fn from(source: Source) -> Self {
        Self::Any(source)
    }
}

/// One source of a dense layer and its weights W, `[width of the layer, width of the source]`, row-major among the
/// parameters.
#[derive(Debug, Clone)]
pub struct Input {
    /// Source that the weights multiply.
    pub source: Source,
    /// Width of the source.
    pub width: usize,
    /// Index of the first weight among the parameters.
    pub at: usize,
    /// Whether the weights must be ≥ 0, so that the layer is convex in its source.
    pub non_negative: bool,
    /// Whether no later layer reads the source, so that a reverse pass reaches it here first.
    pub last_reader: bool,
}

/// Map from the sources of a layer to its pre-activations.
#[derive(Debug, Clone)]
pub enum Kind {
    /// Affine: z = Σ W a + b, summed over the sources a.
    Dense {
        /// Sources with their matrices of weights W.
        inputs: Vec<Input>,
        /// Index of the first bias b among the parameters, `None` where the layer has no bias.
        bias: Option<usize>,
    },
    /// Affine in the velocities v: z = `Σ_j` `g_j` `v_j` + `g_n`, with gates g that another layer computes.
    Gate {
        /// Index of the layer that computes the gates, `[n + 1, width]`.
        gates: usize,
    },
}

/// One layer of a [`Net`]: a = σ(z).
#[derive(Debug, Clone)]
pub struct Layer {
    /// Number of units.
    pub width: usize,
    /// Map from the sources to z.
    pub kind: Kind,
    /// Activation σ, `None` where a = z.
    pub activation: Option<Activation>,
}

/// The initial weights of squares over those of other units: a polynomial without bound begins as a small one, and not as a mass matrix
/// that changes its sign.
const OF_SQUARES: f64 = 0.1;

/// The layers of a feed-forward network, without its parameters.
#[derive(Debug, Clone)]
pub struct Net {
    /// Number of features of a sample that the network reads.
    pub features: usize,
    /// Number of velocities that gates multiply, 0 without gates.
    pub velocities: usize,
    /// Layers, each after all that it reads.
    pub layers: Vec<Layer>,
    /// Layers that are the output, joined in this order; no layer reads them, and they have no activation.
    pub outputs: Vec<usize>,
    /// Outputs whose weights begin as this part of what they are elsewhere.
    pub faint: (Range<usize>, f64),
    /// Number of parameters: weights and biases of all layers.
    pub parameters: usize,
}

/// Builds a [`Net`] layer by layer.
#[derive(Debug)]
pub struct Build(Net);

impl Build {
    /// A network without layers that reads `features` features, and whose gates multiply `velocities` velocities.
    #[must_use]
    pub fn new(features: usize, velocities: usize) -> Self {
        Self(Net {
            features,
            velocities,
            layers: Vec::new(),
            outputs: Vec::new(),
            faint: (0..0, 1.0),
            parameters: 0,
        })
    }

    /// Adds a dense layer of `width` units with a bias, and returns it.
    pub fn dense(
        &mut self,
        width: usize,
        sources: &[impl Into<Weighted> + Copy],
        activation: Option<Activation>,
    ) -> Source {
        let inputs = self.inputs(width, sources);
        let bias = Some(self.0.parameters);
        self.0.parameters += width;
        let kind = Kind::Dense { inputs, bias };
        self.push(width, kind, activation)
    }

    /// Adds a dense layer of `width` units without bias and activation, and returns it.
    pub fn linear(&mut self, width: usize, sources: &[impl Into<Weighted> + Copy]) -> Source {
        let inputs = self.inputs(width, sources);
        let kind = Kind::Dense { inputs, bias: None };
        self.push(width, kind, None)
    }

    /// Adds `layers` dense layers of `width` units, the first on the features and each other on the one before it, and
    /// returns the last.
    pub fn stack(&mut self, layers: usize, width: usize, activation: Activation) -> Source {
        (0..layers).fold(Source::Features, |source, _| {
            self.dense(width, &[source], Some(activation))
        })
    }

    /// Adds a layer of `width` biases that reads nothing, and returns it.
    pub fn constant(&mut self, width: usize) -> Source {
        let features = std::mem::take(&mut self.0.features);
        let layer = self.dense(width, &[Source::Features], None);
        self.0.features = features;
        layer
    }

    /// Adds gates that read `source`, and a layer of `width` units (a multiple of 16) gated by them; returns the gated
    /// layer.
    pub fn gate(&mut self, width: usize, source: Source, activation: Option<Activation>) -> Source {
        assert_eq!(width % f32::LANES, 0, "gated units fill whole panels");
        let gates = self.0.layers.len();
        self.dense((self.0.velocities + 1) * width, &[source], None);
        self.push(width, Kind::Gate { gates }, activation)
    }

    fn inputs(&mut self, width: usize, sources: &[impl Into<Weighted> + Copy]) -> Vec<Input> {
        let net = &mut self.0;
        let mut input = |weighted: Weighted| {
            let (source, non_negative) = match weighted {
                Weighted::Any(source) => (source, false),
                Weighted::NonNegative(source) => (source, true),
            };
            let from = match source {
                Source::Features => net.features,
                Source::Layer(l) => net.layers[l].width,
            };
            let at = net.parameters;
            net.parameters += width * from;
            Input {
                source,
                width: from,
                at,
                non_negative,
                last_reader: false,
            }
        };
        sources.iter().map(|&source| input(source.into())).collect()
    }

    fn push(&mut self, width: usize, kind: Kind, activation: Option<Activation>) -> Source {
        self.0.layers.push(Layer {
            width,
            kind,
            activation,
        });
        Source::Layer(self.0.layers.len() - 1)
    }

    /// Returns the network, whose output is its last layer.
    pub fn finish(self) -> Net {
        let last = self.0.layers.len().saturating_sub(1);
        self.finish_with(&[Source::Layer(last)])
    }

    /// Returns the network, whose output is these layers in order.
    pub fn finish_with(mut self, outputs: &[Source]) -> Net {
        let layer = |source: &Source| match source {
            Source::Features => None,
            Source::Layer(l) => Some(*l),
        };
        self.0.outputs = outputs.iter().filter_map(layer).collect();
        let mut seen = vec![false; self.0.layers.len() + 1];
        for layer in self.0.layers.iter_mut().rev() {
            let Kind::Dense { inputs, .. } = &mut layer.kind else {
                continue;
            };
            // A layer that reads zero values of its source writes no sensitivity to it.
            for input in inputs.iter_mut().filter(|input| input.width > 0) {
                let slot = match input.source {
                    Source::Features => 0,
                    Source::Layer(l) => l + 1,
                };
                input.last_reader = !std::mem::replace(&mut seen[slot], true);
            }
        }
        self.0
    }
}

impl Net {
    /// Index of the layer that has output `o`, and index of its unit there.
    #[inline]
    #[must_use]
    pub fn output_at(&self, mut o: usize) -> (usize, usize) {
        for &l in &self.outputs {
            let width = self.layers[l].width;
            if o < width {
                return (l, o);
            }
            o -= width;
        }
        (self.layers.len().saturating_sub(1), o)
    }

    /// Random parameters: weights are normal with variance 1 / (width of the source); weights that must be ≥ 0 are
    /// absolute values of these, scaled to keep their sum; biases are zero.
    pub fn initialise(&self, rng: &mut impl Rng) -> Vec<f64> {
        let mut parameters = vec![0.0; self.parameters];
        for layer in &self.layers {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            for input in inputs {
                let part = match input.source {
                    Source::Layer(k)
                        if self.layers[k].activation == Some(Activation::Square)
                            && !input.non_negative =>
                    {
                        OF_SQUARES
                    }
                    _ => 1.0,
                };
                let scale = part * (1.0 / input.width as f64).sqrt();
                for w in &mut parameters[input.at..input.at + layer.width * input.width] {
                    let x = scale * normal(rng);
                    *w = if input.non_negative {
                        x.abs() * scale
                    } else {
                        x
                    };
                }
            }
        }
        let (outputs, part) = &self.faint;
        for (layer, row) in outputs.clone().map(|o| self.output_at(o)) {
            if let Kind::Dense { inputs, .. } = &self.layers[layer].kind {
                for input in inputs {
                    let row = &mut parameters[input.at + row * input.width..][..input.width];
                    row.iter_mut().for_each(|w| *w *= part);
                }
            }
        }
        parameters
    }

    /// Index of the first negative parameter that must be ≥ 0.
    #[must_use]
    pub fn negative(&self, parameters: &[f64]) -> Option<usize> {
        let inputs = self.layers.iter().filter_map(|layer| match &layer.kind {
            Kind::Dense { inputs, .. } => Some(inputs.iter().map(|i| (layer.width, i))),
            Kind::Gate { .. } => None,
        });
        inputs
            .flatten()
            .filter(|(_, input)| input.non_negative)
            .flat_map(|(width, input)| input.at..input.at + width * input.width)
            .find(|&at| parameters[at] < 0.0)
    }

    /// Checks that `parameters` has the length that the network needs and is finite.
    ///
    /// # Errors
    /// [`Error::Count`] and [`Error::NotFinite`].
    pub fn check(&self, parameters: &[f64]) -> Result<()> {
        if parameters.len() != self.parameters {
            return Err(Error::Count {
                found: parameters.len(),
                expected: self.parameters,
            });
        }
        if let Some(index) = parameters.iter().position(|x| !x.is_finite()) {
            return Err(Error::NotFinite { index });
        }
        Ok(())
    }

    /// Sets negative weights that must be ≥ 0 to zero.
    pub fn project(&self, parameters: &mut [f64]) {
        for layer in &self.layers {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            for input in inputs.iter().filter(|i| i.non_negative) {
                for w in &mut parameters[input.at..input.at + layer.width * input.width] {
                    *w = w.max(0.0);
                }
            }
        }
    }
}

/// A sample of the standard normal distribution (Box, Muller 1958).
pub fn normal(rng: &mut impl Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
