//! A block of samples on its way through a network, forward and backward over the truncated algebra.

mod backward;
mod forward;
mod planes;
mod products;

use super::net::{Kind, Net, Source};
use super::packed::panels;
use super::simd::{Buffer, Real, Shape};

#[derive(Debug)]
struct LayerBuffers<T: Real> {
    shape: Shape,
    z: Buffer<T>,
    /// Empty where the layer has no activation: then a is z, ya is yz.
    a: Buffer<T>,
    ya: Buffer<T>,
    yz: Buffer<T>,
    slopes: [Buffer<T>; 3],
}

/// The buffers of one block of samples; see the module for the components.
///
/// The caller writes [`Pass::features_mut`] and [`Pass::velocities_mut`], then calls the passes in order.
#[derive(Debug)]
pub struct Pass<T: Real> {
    samples: usize,
    components: usize,
    room: usize,
    x: Buffer<T>,
    x_width: usize,
    yx: Buffer<T>,
    v: Vec<T>,
    yv: Vec<T>,
    hessian: Vec<T>,
    /// Features first, then layers: whether sensitivities to them have been written on the way back.
    heard: Vec<bool>,
    layers: Vec<LayerBuffers<T>>,
}

impl<T: Real> Pass<T> {
    /// Room for blocks of `samples` samples and `room` directions.
    pub fn new(net: &Net, samples: usize, room: usize) -> Self {
        let components = 2 + 2 * room;
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
                    room,
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
            room,
            x: Buffer::new(x_size),
            x_width: net.features,
            yx: Buffer::new(x_size),
            v: vec![T::default(); rows * net.velocities],
            yv: vec![T::default(); samples * net.velocities],
            hessian: vec![T::default(); samples * room * (room + 1)],
            heard: vec![false; net.layers.len() + 1],
            layers: net.layers.iter().map(layer).collect(),
        }
    }

    /// The number of samples of a block.
    #[inline]
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Rows of every matrix: components times samples.
    pub(super) fn rows(&self) -> usize {
        self.components * self.samples
    }

    /// The sensitivity to the pre-activations of layer `l`.
    pub(super) fn sensitivity(&self, l: usize) -> &[T] {
        &self.layers[l].yz
    }

    /// What a source offers to the layers that read it.
    pub(super) fn input(&self, source: Source) -> &[T] {
        match source {
            Source::Features => &self.x,
            Source::Layer(l) => self.layers[l].output(),
        }
    }

    /// Adds `weight` times component `c` of the sensitivity to the pre-activations of layer `l` in sample `s`.
    pub fn add_sensitivity(&self, l: usize, (c, s): (usize, usize), weight: f64, to: &mut [f64]) {
        let (row, lanes, rows) = (c * self.samples + s, T::LANES, self.rows());
        let from = self.sensitivity(l);
        for (u, to) in to.iter_mut().enumerate() {
            *to += weight * from[(u / lanes * rows + row) * lanes + u % lanes].f64();
        }
    }

    /// Numbers in the matrix of the widest layer.
    pub fn widest(&self) -> usize {
        self.layers.iter().map(|l| l.yz.len()).max().unwrap_or(0)
    }

    /// The component i′ of direction `i`.
    #[inline]
    #[must_use]
    pub fn mixed(&self, i: usize) -> usize {
        2 + self.room + i
    }

    /// Sets feature `i` of component `c` of sample `s`.
    #[inline]
    pub fn set_feature(&mut self, c: usize, s: usize, i: usize, x: T) {
        let at = self.feature_at(c, s, i);
        self.x[at] = x;
    }

    /// Feature `i` of component `c` of sample `s`.
    #[inline]
    pub fn feature(&self, c: usize, s: usize, i: usize) -> T {
        self.x[self.feature_at(c, s, i)]
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

    fn feature_at(&self, c: usize, s: usize, i: usize) -> usize {
        let rows = self.components * self.samples;
        (i / T::LANES * rows + c * self.samples + s) * T::LANES + i % T::LANES
    }

    /// Sets velocity `j` of component `c` of sample `s` (networks with gates).
    #[inline]
    pub fn set_velocity(&mut self, c: usize, s: usize, j: usize, x: T) {
        let n = self.v.len() / (self.components * self.samples);
        self.v[(c * self.samples + s) * n + j] = x;
    }

    /// Component `c` of output `o` of sample `s`.
    pub fn output(&self, net: &Net, c: usize, s: usize, o: usize) -> T {
        let rows = self.components * self.samples;
        let (layer, o) = net.output_at(o);
        let out = self.layers[layer].output();
        out[(o / T::LANES * rows + c * self.samples + s) * T::LANES + o % T::LANES]
    }

    /// ∂output/∂(feature i) of sample `s`, after [`Pass::reverse`].
    pub fn feature_gradient(&self, s: usize, i: usize) -> T {
        self.yx[self.feature_at(0, s, i)]
    }

    /// ∂output/∂(velocity j) of sample `s` through the gates, after [`Pass::reverse`].
    pub fn velocity_gradient(&self, s: usize, j: usize) -> T {
        self.yv[s * (self.yv.len() / self.samples) + j]
    }

    /// Component `c` of the sensitivity to feature `i` of sample `s`, after [`Pass::reverse_features`].
    pub fn feature_sensitivity(&self, c: usize, s: usize, i: usize) -> T {
        self.yx[self.feature_at(c, s, i)]
    }

    /// The same of the mixed component of direction `d`.
    pub fn mixed_feature_sensitivity(&self, d: usize, s: usize, i: usize) -> T {
        self.feature_sensitivity(self.mixed(d), s, i)
    }

    /// Mixed component of direction `d` of the sensitivity to velocity `j` of sample `s` through the gates: the
    /// product y g of the truncated algebra, after [`Pass::reverse_mixed`].
    pub fn mixed_velocity_sensitivity(&self, net: &Net, d: usize, s: usize, j: usize) -> T {
        let pairs = [
            (0, self.mixed(d)),
            (1, 2 + d),
            (2 + d, 1),
            (self.mixed(d), 0),
        ];
        let rows = self.components * self.samples;
        let at = |c: usize, u: usize| {
            (u / T::LANES * rows + c * self.samples + s) * T::LANES + u % T::LANES
        };
        let mut sum = T::default();
        for (layer, buffers) in net.layers.iter().zip(&self.layers) {
            let Kind::Gate { gates } = layer.kind else {
                continue;
            };
            let g = self.layers[gates].output();
            for u in 0..layer.width {
                for (y, c) in pairs {
                    sum = sum + buffers.yz[at(y, u)] * g[at(c, j * layer.width + u)];
                }
            }
        }
        sum
    }

    /// Second derivative of the output along tangents i and j (or i and ′ where `j` is `None`), after
    /// [`Pass::reverse`] with `directions` of them.
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
    /// For gates, which have no activation.
    fn output_and_sensitivity(&mut self) -> (&[T], &mut Buffer<T>) {
        (&self.z, &mut self.yz)
    }
}
