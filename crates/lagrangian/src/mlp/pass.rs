//! A block of samples on its way through a network, forward and backward over the truncated algebra.

use std::ops::Range;

use super::net::{Kind, Net, Source};
use super::packed::{Gradient, Packed, panels};
use super::simd::{
    Buffer, Combine, Contract, GateForward, GateReverse, Gates, Gemm, Init, PointForward,
    PointReverse2, PointReverseTangents, PointSecond, PointTangent, Real, Shape, SumRows, dispatch,
};

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

/// What goes forward.
#[derive(Clone, Copy, PartialEq)]
enum Forward {
    /// The value, and tangents with it.
    Value,
    /// Tangents alone.
    Tangents,
    /// Mixed second derivatives.
    Mixed,
}

/// What goes backward.
#[derive(Clone, Copy)]
enum Backward {
    /// The value's sensitivity, with second derivatives along pairs of so many tangents.
    Value { directions: usize },
    /// Those of so many outputs, one a component.
    Outputs(usize),
    /// The components ′, i and i′ of one output's.
    Mixed { directions: usize },
    /// Those of so many scalars of the value and its tangents.
    Tangents { directions: usize },
}

/// The buffers of one block of samples; see the module for the components.
///
/// The caller writes [`Pass::features_mut`] and [`Pass::velocities_mut`], then calls the passes in order.
#[derive(Debug)]
pub(crate) struct Pass<T: Real> {
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
    pub(crate) fn new(net: &Net, samples: usize, room: usize) -> Self {
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

    pub(crate) fn samples(&self) -> usize {
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

    /// Writes component `c` of what the dense layer `l` reads in sample `s`, a 1 behind it for its bias.
    pub(crate) fn read_input(&self, net: &Net, l: usize, (c, s): (usize, usize), to: &mut [f64]) {
        let Kind::Dense { inputs, bias } = &net.layers[l].kind else {
            return;
        };
        let (row, lanes, rows) = (c * self.samples + s, T::LANES, self.rows());
        let mut first = 0;
        for input in inputs {
            let from = self.input(input.source);
            for u in 0..input.width {
                to[first + u] = from[(u / lanes * rows + row) * lanes + u % lanes].f64();
            }
            first += input.width;
        }
        if bias.is_some() {
            to[first] = if c == 0 { 1.0 } else { 0.0 };
        }
    }

    /// Adds `weight` times component `c` of the sensitivity to the pre-activations of layer `l` in sample `s`.
    pub(crate) fn add_sensitivity(
        &self,
        l: usize,
        (c, s): (usize, usize),
        weight: f64,
        to: &mut [f64],
    ) {
        let (row, lanes, rows) = (c * self.samples + s, T::LANES, self.rows());
        let from = self.sensitivity(l);
        for (u, to) in to.iter_mut().enumerate() {
            *to += weight * from[(u / lanes * rows + row) * lanes + u % lanes].f64();
        }
    }

    /// Numbers in the matrix of the widest layer.
    pub(crate) fn widest(&self) -> usize {
        self.layers.iter().map(|l| l.yz.len()).max().unwrap_or(0)
    }

    pub(crate) fn mixed(&self, i: usize) -> usize {
        2 + self.room + i
    }

    /// Sets feature `i` of component `c` of sample `s`.
    #[inline]
    pub(crate) fn set_feature(&mut self, c: usize, s: usize, i: usize, x: T) {
        let at = self.feature_at(c, s, i);
        self.x[at] = x;
    }

    /// Feature `i` of component `c` of sample `s`.
    #[inline]
    pub(crate) fn feature(&self, c: usize, s: usize, i: usize) -> T {
        self.x[self.feature_at(c, s, i)]
    }

    /// Sets feature `i` of the mixed component of direction `d` of sample `s`.
    #[inline]
    pub(crate) fn set_mixed_feature(&mut self, d: usize, s: usize, i: usize, x: T) {
        self.set_feature(self.mixed(d), s, i, x);
    }

    /// Sets velocity `j` of the mixed component of direction `d` of sample `s` (networks with gates).
    #[inline]
    pub(crate) fn set_mixed_velocity(&mut self, d: usize, s: usize, j: usize, x: T) {
        self.set_velocity(self.mixed(d), s, j, x);
    }

    fn feature_at(&self, c: usize, s: usize, i: usize) -> usize {
        let rows = self.components * self.samples;
        (i / T::LANES * rows + c * self.samples + s) * T::LANES + i % T::LANES
    }

    /// Sets velocity `j` of component `c` of sample `s` (networks with gates).
    #[inline]
    pub(crate) fn set_velocity(&mut self, c: usize, s: usize, j: usize, x: T) {
        let n = self.v.len() / (self.components * self.samples);
        self.v[(c * self.samples + s) * n + j] = x;
    }

    /// Forward: the value and the tangents ′ and i < `directions` (only the value if `directions` is `None`).
    pub(crate) fn forward(&mut self, net: &Net, packed: &Packed<T>, directions: Option<usize>) {
        let components = 0..directions.map_or(1, |d| 2 + d);
        self.propagate(net, packed, components, (Forward::Value, usize::MAX));
    }

    /// Forward, where [`Pass::reverse`] tells the rest: of the output only its first `components`, the value or nothing.
    pub(crate) fn forward_for_reverse(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        directions: usize,
        components: usize,
    ) {
        self.propagate(net, packed, 0..2 + directions, (Forward::Value, components));
    }

    /// Forward: the mixed second derivatives i′ for i < `directions`, after [`Pass::forward`]; not those of the output,
    /// which the sensitivities do not need.
    pub(crate) fn forward_mixed(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        let components = self.mixed(0)..self.mixed(directions);
        self.propagate(net, packed, components, (Forward::Mixed, 0));
    }

    /// Forward: the tangents i < `directions` alone, after a [`Pass::forward`] without them.
    pub(crate) fn forward_tangents(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.propagate(
            net,
            packed,
            2..2 + directions,
            (Forward::Tangents, usize::MAX),
        );
    }

    fn propagate(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        components: Range<usize>,
        (stage, outputs): (Forward, usize),
    ) {
        let rows = self.components * self.samples;
        for (l, layer) in net.layers.iter().enumerate() {
            let components = match net.outputs.contains(&l) {
                true => components.start..components.end.min(outputs),
                false => components.clone(),
            };
            if components.is_empty() {
                continue;
            }
            let (before, rest) = self.layers.split_at_mut(l);
            let buffers = &mut rest[0];
            let shape = buffers.shape;
            match &layer.kind {
                Kind::Dense { inputs, .. } => {
                    for (k, input) in inputs.iter().enumerate() {
                        let a: &[T] = match input.source {
                            Source::Features => &self.x,
                            Source::Layer(l) => before[l].output(),
                        };
                        // The bias belongs to the value alone.
                        let init = match (k, stage) {
                            (0, Forward::Value) => Init::Rows(packed.bias(l), self.samples),
                            (0, _) => Init::Zero,
                            _ => Init::Add,
                        };
                        let part = components.start * self.samples..components.end * self.samples;
                        dispatch(Gemm::along_rows(
                            a,
                            rows,
                            packed.forward(l, k),
                            input.width,
                            &mut buffers.z,
                            rows,
                            part,
                            shape.panels,
                            init,
                        ));
                    }
                }
                Kind::Gate { gates } => dispatch(GateForward {
                    gates: Gates {
                        shape,
                        n: net.velocities,
                        g: before[*gates].output(),
                        v: &self.v,
                    },
                    components: components.clone(),
                    z: &mut buffers.z,
                }),
            }
            let Some(activation) = layer.activation else {
                continue;
            };
            let LayerBuffers {
                z,
                a,
                slopes: [s1, s2, s3],
                ..
            } = buffers;
            if stage == Forward::Mixed {
                let (directions, slopes) = (components.len(), [&s1[..], &s2[..]]);
                dispatch(PointSecond {
                    shape,
                    directions,
                    slopes,
                    z,
                    a,
                });
                continue;
            }
            if stage == Forward::Value {
                dispatch(PointForward {
                    shape,
                    activation,
                    z,
                    a,
                    slopes: [s1, s2, s3],
                });
            }
            dispatch(PointTangent {
                shape,
                components: components.start.max(1)..components.end,
                first: s1,
                input: z,
                output: a,
            });
        }
    }

    /// Component `c` of output `o` of sample `s`.
    pub(crate) fn output(&self, net: &Net, c: usize, s: usize, o: usize) -> T {
        let rows = self.components * self.samples;
        let (layer, o) = net.output_at(o);
        let out = self.layers[layer].output();
        out[(o / T::LANES * rows + c * self.samples + s) * T::LANES + o % T::LANES]
    }

    /// Backward: the value component of the sensitivities of the (only) output, its gradient by features and
    /// velocities, and its second derivatives along pairs of the first `directions` tangents and ′.
    pub(crate) fn reverse(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.seed(net, 0..1, |_, _, _| T::of(1.0));
        self.hessian.fill(T::default());
        self.yv.fill(T::default());
        self.back(net, packed, Backward::Value { directions });
    }

    /// Backward: the value component of the sensitivities of Σ `seed(s, o)` output o, and its gradient by the
    /// features.
    pub(crate) fn reverse_sum(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        seed: impl Fn(usize, usize) -> T,
    ) {
        self.seed(net, 0..1, |_, s, o| seed(s, o));
        self.back(net, packed, Backward::Value { directions: 0 });
    }

    /// Backward: the components ′, i and i′ of the sensitivities, after [`Pass::reverse`] and
    /// [`Pass::forward_mixed`].
    pub(crate) fn reverse_mixed(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        let mixed = self.mixed(0)..self.mixed(directions);
        let rows = self.rows();
        let step = self.samples * T::LANES;
        for &l in &net.outputs {
            for panel in self.layers[l].yz.chunks_exact_mut(rows * T::LANES) {
                panel[step..(2 + directions) * step].fill(T::default());
                panel[mixed.start * step..mixed.end * step].fill(T::default());
            }
        }
        self.back(net, packed, Backward::Mixed { directions });
    }

    /// Backward: `directions` scalars that depend on the outputs, their tangents ′ and one tangent i each. `seed(c,
    /// s, o)` is the sensitivity to component ′ of output o for c < directions, to its value for the others; those
    /// to the tangents i are what [`Pass::reverse_sum`] left.
    pub(crate) fn reverse_tangents(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        directions: usize,
        seed: impl Fn(usize, usize, usize) -> T,
    ) {
        self.seed(net, 1..1 + 2 * directions, |c, s, o| seed(c - 1, s, o));
        self.back(net, packed, Backward::Tangents { directions });
    }

    /// Backward, one component per output: component c holds the sensitivities of output c (plain networks).
    pub(crate) fn reverse_outputs(&mut self, net: &Net, packed: &Packed<T>, outputs: usize) {
        let unit = |c, _, o| if c == o { T::of(1.0) } else { T::default() };
        self.seed(net, 0..outputs, unit);
        self.back(net, packed, Backward::Outputs(outputs));
    }

    /// Backward: component 0 holds the sensitivities of Σ `weights[s, o]` output o (plain networks).
    pub(crate) fn reverse_weighted(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        outputs: usize,
        weights: &[T],
    ) {
        self.seed(net, 0..1, |_, s, o| weights[s * outputs + o]);
        self.back(net, packed, Backward::Outputs(1));
    }

    /// Sets the sensitivity of component `c` of sample `s` to output `o`; 0 in the padding of the last panels.
    fn seed(
        &mut self,
        net: &Net,
        components: Range<usize>,
        seed: impl Fn(usize, usize, usize) -> T,
    ) {
        let rows = self.components * self.samples;
        let mut first = 0;
        for &l in &net.outputs {
            let (layer, width) = (&mut self.layers[l], net.layers[l].width);
            for p in 0..layer.shape.panels {
                for c in components.clone() {
                    for s in 0..self.samples {
                        let at = (p * rows + c * self.samples + s) * T::LANES;
                        let row = &mut layer.yz[at..at + T::LANES];
                        row.fill(T::default());
                        for (lane, y) in row.iter_mut().take(width - p * T::LANES).enumerate() {
                            *y = seed(c, s, first + p * T::LANES + lane);
                        }
                    }
                }
            }
            first += width;
        }
    }

    /// Carries sensitivities from the outputs down, to the features where the value's are carried.
    fn back(&mut self, net: &Net, packed: &Packed<T>, way: Backward) {
        let mixed = |directions| self.mixed(0)..self.mixed(directions);
        let parts = match way {
            Backward::Value { .. } => [0..1, 0..0],
            Backward::Outputs(outputs) => [0..outputs, 0..0],
            Backward::Mixed { directions } => [1..2 + directions, mixed(directions)],
            Backward::Tangents { directions } => [1..1 + 2 * directions, 0..0],
        };
        let curved = match way {
            Backward::Value { directions } if directions > 0 => Some(directions),
            _ => None,
        };
        let value = matches!(way, Backward::Value { .. });
        let mixed = matches!(way, Backward::Mixed { .. });
        self.heard.fill(false);
        for (l, layer) in net.layers.iter().enumerate().rev() {
            let (before, rest) = self.layers.split_at_mut(l);
            let buffers = &mut rest[0];
            let shape = buffers.shape;
            if layer.activation.is_some() {
                let LayerBuffers {
                    z,
                    ya,
                    yz,
                    slopes: [s1, s2, s3],
                    ..
                } = buffers;
                match way {
                    Backward::Value { .. } | Backward::Outputs(_) => {
                        dispatch(PointTangent {
                            shape,
                            components: parts[0].clone(),
                            first: s1,
                            input: ya,
                            output: yz,
                        });
                        if let Some(directions) = curved {
                            dispatch(Contract {
                                shape,
                                directions,
                                second: s2,
                                z,
                                ya,
                                hessian: &mut self.hessian[..],
                            });
                        }
                    }
                    Backward::Mixed { directions } => dispatch(PointReverse2 {
                        shape,
                        directions,
                        slopes: [s1, s2, s3],
                        z,
                        ya,
                        yz,
                        value_only: !self.heard[l + 1],
                    }),
                    Backward::Tangents { directions } => dispatch(PointReverseTangents {
                        shape,
                        directions,
                        slopes: [s1, s2],
                        z,
                        ya,
                        yz,
                    }),
                }
            }
            match &layer.kind {
                Kind::Dense { inputs, .. } => {
                    let rows = self.components * self.samples;
                    for (k, input) in inputs.iter().enumerate() {
                        let w = packed.reverse(l, k);
                        let (slot, bent) = match input.source {
                            Source::Features => (0, false),
                            Source::Layer(l) => (l + 1, net.layers[l].activation.is_some()),
                        };
                        // Only the value's sensitivity to the features is ever read; and of mixed components the
                        // outputs have none, which an activation below them knows.
                        let silent = mixed && bent && net.outputs.contains(&l);
                        if (slot == 0 && !value) || silent || input.width == 0 {
                            continue;
                        }
                        let target = match input.source {
                            Source::Features => &mut self.yx,
                            Source::Layer(l) => before[l].sensitivity_mut(),
                        };
                        let init = match std::mem::replace(&mut self.heard[slot], true) {
                            true => Init::Add,
                            false => Init::Zero,
                        };
                        for c in parts.clone() {
                            let part = c.start * self.samples..c.end * self.samples;
                            if !part.is_empty() {
                                dispatch(Gemm::along_rows(
                                    &buffers.yz,
                                    rows,
                                    w,
                                    layer.width,
                                    target,
                                    rows,
                                    part,
                                    panels::<T>(input.width),
                                    init,
                                ));
                            }
                        }
                    }
                }
                Kind::Gate { gates } => {
                    let (g, yg) = before[*gates].output_and_sensitivity();
                    for components in parts.clone() {
                        if components.is_empty() {
                            continue;
                        }
                        dispatch(GateReverse {
                            gates: Gates {
                                shape,
                                n: net.velocities,
                                g,
                                v: &self.v,
                            },
                            components,
                            yz: &buffers.yz,
                            yg: &mut yg[..],
                            yv: value.then_some(&mut self.yv[..]),
                            hessian: curved.map(|d| (&mut self.hessian[..], d)),
                        });
                    }
                }
            }
        }
    }

    /// ∂output/∂(feature i) of sample `s`, after [`Pass::reverse`].
    pub(crate) fn feature_gradient(&self, s: usize, i: usize) -> T {
        self.yx[self.feature_at(0, s, i)]
    }

    /// ∂output/∂(velocity j) of sample `s` through the gates, after [`Pass::reverse`].
    pub(crate) fn velocity_gradient(&self, s: usize, j: usize) -> T {
        self.yv[s * (self.yv.len() / self.samples) + j]
    }

    /// Carries the sensitivities of these components of the samples from the layers down to the features, after a
    /// reverse pass that left them there.
    pub(crate) fn reverse_features(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        components: Range<usize>,
    ) {
        let rows = self.components * self.samples;
        let part = components.start * self.samples..components.end * self.samples;
        let mut init = Init::Zero;
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            for (k, input) in inputs.iter().enumerate() {
                let w = packed.reverse(l, k);
                if input.source != Source::Features {
                    continue;
                }
                dispatch(Gemm::along_rows(
                    &self.layers[l].yz,
                    rows,
                    w,
                    layer.width,
                    &mut self.yx,
                    rows,
                    part.clone(),
                    panels::<T>(input.width),
                    init,
                ));
                init = Init::Add;
            }
        }
    }

    /// Component `c` of the sensitivity to feature `i` of sample `s`, after [`Pass::reverse_features`].
    pub(crate) fn feature_sensitivity(&self, c: usize, s: usize, i: usize) -> T {
        self.yx[self.feature_at(c, s, i)]
    }

    /// The same of the mixed component of direction `d`.
    pub(crate) fn mixed_feature_sensitivity(&self, d: usize, s: usize, i: usize) -> T {
        self.feature_sensitivity(self.mixed(d), s, i)
    }

    /// Mixed component of direction `d` of the sensitivity to velocity `j` of sample `s` through the gates: the
    /// product y g of the truncated algebra, after [`Pass::reverse_mixed`].
    pub(crate) fn mixed_velocity_sensitivity(&self, net: &Net, d: usize, s: usize, j: usize) -> T {
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
    pub(crate) fn second_derivative(
        &self,
        s: usize,
        i: usize,
        j: Option<usize>,
        directions: usize,
    ) -> T {
        let (i, j) = j.map_or((i, directions), |j| (i.max(j), i.min(j)));
        self.hessian[(s * directions + i) * (directions + 1) + j]
    }

    /// Replaces tangents by linear combinations, sample by sample: ′ becomes ′ + Σ `along[s, i]` i, and where
    /// `onto` is given, direction 0 becomes Σ `onto[s, i]` i (both `[samples, directions]`).
    pub(crate) fn combine(
        &mut self,
        net: &Net,
        directions: usize,
        along: &[T],
        onto: Option<&[T]>,
    ) {
        for (buffers, layer) in self.layers.iter_mut().zip(&net.layers) {
            let shape = buffers.shape;
            let LayerBuffers { z, a, .. } = buffers;
            for buffer in [z, a]
                .into_iter()
                .take(1 + usize::from(layer.activation.is_some()))
            {
                dispatch(Combine {
                    shape,
                    directions,
                    along,
                    onto,
                    buffer,
                });
            }
        }
        let shape = Shape {
            samples: self.samples,
            components: self.components,
            room: self.room,
            panels: panels::<T>(self.x_width),
        };
        dispatch(Combine {
            shape,
            directions,
            along,
            onto,
            buffer: &mut self.x,
        });
        self.combine_velocities(net.velocities, directions, along, onto);
    }

    fn combine_velocities(&mut self, n: usize, directions: usize, along: &[T], onto: Option<&[T]>) {
        let at = |c: usize, s: usize| (c * self.samples + s) * n;
        for s in 0..self.samples {
            for j in 0..n {
                let sum = |weights: &[T], v: &[T]| {
                    let terms =
                        (0..directions).map(|i| weights[s * directions + i] * v[at(2 + i, s) + j]);
                    terms.fold(T::default(), |x, y| x + y)
                };
                let step = sum(along, &self.v);
                let direction = onto.map(|onto| sum(onto, &self.v));
                self.v[at(1, s) + j] = self.v[at(1, s) + j] + step;
                if let Some(direction) = direction {
                    self.v[at(2, s) + j] = direction;
                }
            }
        }
    }

    /// Adds the gradient by the parameters of `Σ_samples` (mixed component of direction 0) to `gradient`.
    pub(crate) fn add_gradient(&self, net: &Net, gradient: &mut Gradient<T>) {
        let mixed = self.mixed(0);
        // At the outputs only the value is not zero.
        let pairs = [(0, mixed), (1, 2), (2, 1), (mixed, 0)];
        self.add_products_at(net, |output| &pairs[..if output { 1 } else { 4 }], gradient);
    }

    /// Adds Σ over `pairs` of (component of yz) ⊗ (component of a), summed over the samples, to `gradient`.
    pub(crate) fn add_products(
        &self,
        net: &Net,
        pairs: &[(usize, usize)],
        gradient: &mut Gradient<T>,
    ) {
        self.add_products_at(net, |_| pairs, gradient);
    }

    /// The same with pairs that depend on whether a layer is an output.
    fn add_products_at<'p>(
        &self,
        net: &Net,
        pairs: impl Fn(bool) -> &'p [(usize, usize)],
        gradient: &mut Gradient<T>,
    ) {
        let rows = self.components * self.samples;
        let step = self.samples * T::LANES;
        let init = gradient.begin();
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let pairs = pairs(net.outputs.contains(&l));
            let mut pieces = [(0, 0); 8];
            for (piece, &(y, a)) in pieces.iter_mut().zip(pairs) {
                *piece = (y * step, a * step);
            }
            let yz = &self.layers[l].yz;
            let (matrices, sums) = gradient.layer(l, inputs.len());
            for (input, matrix) in inputs.iter().zip(matrices) {
                let a = self.input(input.source);
                let pieces = &pieces[..pairs.len()];
                dispatch(Gemm::along_columns(
                    yz,
                    rows,
                    a,
                    rows,
                    pieces,
                    self.samples,
                    matrix,
                    layer.width,
                    panels::<T>(input.width),
                    init,
                ));
            }
            if bias.is_some() {
                if matches!(init, Init::Zero) {
                    sums.fill(T::default());
                }
                // The bias multiplies 1, whose components other than the value are 0.
                for &(y, _) in pairs.iter().filter(|p| p.1 == 0) {
                    self.add_rows(yz, y, sums);
                }
            }
        }
    }

    /// Adds component `c` of `matrix`, summed over the samples, to `sums`.
    pub(super) fn add_rows(&self, matrix: &[T], c: usize, sums: &mut [T]) {
        let lanes = T::LANES;
        let panels = matrix.chunks_exact(self.rows() * lanes);
        for (panel, sums) in panels.zip(sums.chunks_exact_mut(lanes)) {
            let rows = &panel[c * self.samples * lanes..][..self.samples * lanes];
            dispatch(SumRows { rows, sums });
        }
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
