//! A block of samples through a network, forward and backward over the truncated algebra {1, ′, i, i′} of theory.md,
//! section 5.
//!
//! Every matrix of a block has a row for each component of each sample. For n directions, component 0 is the
//! value, 1 the tangent ′, 2 + i the tangent along direction i and 2 + n + i the mixed second derivative along i and ′.

mod backward;
mod forward;
mod planes;
mod products;

use super::component;
use super::net::{Kind, Net, Source};
use super::packed::panels;
use super::simd::{Buffer, Real, Shape};

/// Matrices of one layer, with a row for each component of each sample.
#[derive(Debug)]
struct LayerBuffers<T: Real> {
    shape: Shape,
    /// Pre-activations z.
    z: Buffer<T>,
    /// Activations a = σ(z), empty where the layer has no activation: then a is z, and ya is yz.
    a: Buffer<T>,
    /// Sensitivities to a.
    ya: Buffer<T>,
    /// Sensitivities to z.
    yz: Buffer<T>,
    /// σ′, σ″ and σ‴ at the value of z.
    slopes: [Buffer<T>; 3],
}

/// A block of samples in a network: features, layers, outputs and the sensitivities to all of them.
///
/// Component 0 of a quantity is its value, 1 its tangent ′, 2 + i its tangent along direction i, and
/// [`mixed(i)`](Pass::mixed) its mixed second derivative along i and ′ (theory.md, equation 9). The caller sets the
/// components of the features ([`Pass::set_feature`]) and then calls, in this order, [`Pass::forward`],
/// [`Pass::reverse`], [`Pass::forward_mixed`] and [`Pass::reverse_mixed`], as far as the derivatives are needed.
#[derive(Debug)]
pub struct Pass<T: Real> {
    samples: usize,
    components: usize,
    capacity: usize,
    x: Buffer<T>,
    x_width: usize,
    yx: Buffer<T>,
    v: Vec<T>,
    yv: Vec<T>,
    hessian: Vec<T>,
    /// Whether the running reverse pass has written the sensitivities to the features, then those to each layer.
    written: Vec<bool>,
    layers: Vec<LayerBuffers<T>>,
}

impl<T: Real> Pass<T> {
    /// Buffers for blocks of `samples` samples with up to `capacity` directions.
    #[must_use]
    pub fn new(net: &Net, samples: usize, capacity: usize) -> Self {
        let components = 2 + 2 * capacity;
        let rows = components * samples;
        let layer = |layer: &super::net::Layer| {
            let panels = panels::<T>(layer.width);
            let full = panels * rows * T::LANES;
            let some = if layer.activation.is_some() { full } else { 0 };
            let slope = || {
                Buffer::new(if some > 0 {
                    panels * samples * T::LANES
                } else {
                    0
                })
            };
            LayerBuffers {
                shape: Shape {
                    samples,
                    components,
                    capacity,
                    panels,
                },
                z: Buffer::new(full),
                a: Buffer::new(some),
                ya: Buffer::new(some),
                yz: Buffer::new(full),
                slopes: [slope(), slope(), slope()],
            }
        };
        let x_size = panels::<T>(net.features) * rows * T::LANES;
        Self {
            samples,
            components,
            capacity,
            x: Buffer::new(x_size),
            x_width: net.features,
            yx: Buffer::new(x_size),
            v: vec![T::default(); rows * net.velocities],
            yv: vec![T::default(); samples * net.velocities],
            hessian: vec![T::default(); samples * capacity * (capacity + 1)],
            written: vec![false; net.layers.len() + 1],
            layers: net.layers.iter().map(layer).collect(),
        }
    }

    /// Number of samples of a block.
    #[inline]
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Number of rows of every matrix: components times samples.
    pub(super) fn rows(&self) -> usize {
        self.components * self.samples
    }

    /// Sensitivity to the pre-activations of layer `l`.
    pub(super) fn sensitivity(&self, l: usize) -> &[T] {
        &self.layers[l].yz
    }

    /// Matrix of a source, as the layers read it.
    pub(super) fn input(&self, source: Source) -> &[T] {
        match source {
            Source::Features => &self.x,
            Source::Layer(l) => self.layers[l].output(),
        }
    }

    /// Adds `weight` times component `c` of the sensitivities to the pre-activations of layer `l` in sample `s` to `to`.
    pub fn add_sensitivity(&self, l: usize, (c, s): (usize, usize), weight: f64, to: &mut [f64]) {
        let from = self.sensitivity(l);
        for (u, to) in to.iter_mut().enumerate() {
            *to += weight * from[self.index(c, s, u)].f64();
        }
    }

    /// Number of values in the matrix of the widest layer, which scratch buffers must hold.
    #[must_use]
    pub fn widest(&self) -> usize {
        self.layers.iter().map(|l| l.yz.len()).max().unwrap_or(0)
    }

    /// The component i′ of direction `i`.
    #[inline]
    #[must_use]
    pub fn mixed(&self, i: usize) -> usize {
        component::tangent(self.capacity) + i
    }

    /// Sets feature `i` of component `c` of sample `s`.
    #[inline]
    pub fn set_feature(&mut self, c: usize, s: usize, i: usize, x: T) {
        let at = self.index(c, s, i);
        self.x[at] = x;
    }

    /// Feature `i` of component `c` of sample `s`.
    #[must_use]
    #[inline]
    pub fn feature(&self, c: usize, s: usize, i: usize) -> T {
        self.x[self.index(c, s, i)]
    }

    /// Sets feature `i` of the mixed component of direction `d` of sample `s`.
    #[inline]
    pub fn set_mixed_feature(&mut self, d: usize, s: usize, i: usize, x: T) {
        self.set_feature(self.mixed(d), s, i, x);
    }

    /// Sets velocity `j` of the mixed component of direction `d` of sample `s` (networks with gates).
    #[inline]
    pub fn set_mixed_velocity(&mut self, d: usize, s: usize, j: usize, x: T) {
        self.set_velocity(self.mixed(d), s, j, x);
    }

    /// Index of unit `i` of component `c` of sample `s` in a matrix of this block.
    pub(super) fn index(&self, c: usize, s: usize, i: usize) -> usize {
        (i / T::LANES * self.rows() + c * self.samples + s) * T::LANES + i % T::LANES
    }

    /// Sets velocity `j` of component `c` of sample `s` (networks with gates).
    #[inline]
    pub fn set_velocity(&mut self, c: usize, s: usize, j: usize, x: T) {
        let n = self.v.len() / (self.components * self.samples);
        self.v[(c * self.samples + s) * n + j] = x;
    }

    /// Component `c` of output `o` of sample `s`.
    #[must_use]
    pub fn output(&self, net: &Net, c: usize, s: usize, o: usize) -> T {
        let (layer, o) = net.output_at(o);
        self.layers[layer].output()[self.index(c, s, o)]
    }

    /// ∂output/∂(feature i) of sample `s`, after [`Pass::reverse`].
    #[must_use]
    pub fn feature_gradient(&self, s: usize, i: usize) -> T {
        self.feature_sensitivity(0, s, i)
    }

    /// ∂output/∂(velocity j) of sample `s` through the gates, after [`Pass::reverse`].
    #[must_use]
    pub fn velocity_gradient(&self, s: usize, j: usize) -> T {
        self.yv[s * (self.yv.len() / self.samples) + j]
    }

    /// Component `c` of the sensitivity to feature `i` of sample `s`, after [`Pass::reverse_features`].
    #[must_use]
    pub fn feature_sensitivity(&self, c: usize, s: usize, i: usize) -> T {
        self.yx[self.index(c, s, i)]
    }

    /// The mixed component of direction `d` of the sensitivity to feature `i` of sample `s`, after
    /// [`Pass::reverse_features`].
    #[must_use]
    pub fn mixed_feature_sensitivity(&self, d: usize, s: usize, i: usize) -> T {
        self.feature_sensitivity(self.mixed(d), s, i)
    }

    /// Mixed component of direction `d` of the sensitivity to velocity `j` of sample `s` through the gates: the
    /// product y g of the truncated algebra, after [`Pass::reverse_mixed`].
    #[must_use]
    pub fn mixed_velocity_sensitivity(&self, net: &Net, d: usize, s: usize, j: usize) -> T {
        let pairs = [
            (0, self.mixed(d)),
            (1, 2 + d),
            (2 + d, 1),
            (self.mixed(d), 0),
        ];
        let mut sum = T::default();
        for (layer, buffers) in net.layers.iter().zip(&self.layers) {
            let Kind::Gate { gates } = layer.kind else {
                continue;
            };
            let g = self.layers[gates].output();
            for u in 0..layer.width {
                for (y, c) in pairs {
                    sum = sum
                        + buffers.yz[self.index(y, s, u)]
                            * g[self.index(c, s, j * layer.width + u)];
                }
            }
        }
        sum
    }

    /// Second derivative of the output of sample `s` along directions i and j, or along i and ′ where `j` is `None`,
    /// after [`Pass::reverse`] with this number of `directions` (theory.md, equation 14).
    #[must_use]
    pub fn second_derivative(&self, s: usize, i: usize, j: Option<usize>, directions: usize) -> T {
        let (i, j) = j.map_or((i, directions), |j| (i.max(j), i.min(j)));
        self.hessian[(s * directions + i) * (directions + 1) + j]
    }
}

impl<T: Real> LayerBuffers<T> {
    fn output(&self) -> &[T] {
        if self.a.is_empty() { &self.z } else { &self.a }
    }
    fn sensitivity_mut(&mut self) -> &mut Buffer<T> {
        if self.a.is_empty() {
            &mut self.yz
        } else {
            &mut self.ya
        }
    }
    /// Output and sensitivity of a gate, which has no activation.
    fn output_and_sensitivity(&mut self) -> (&[T], &mut Buffer<T>) {
        (&self.z, &mut self.yz)
    }
}
