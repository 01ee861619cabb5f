//! One state through a chain of dense layers: the derivatives that [`Pass`](super::Pass) computes for blocks of samples,
//! in one kernel that reads the weights of a layer once.
//!
//! Row 0 of a layer is the value, row 1 the tangent ′, followed by one row for each direction. A direction moves one feature, so
//! that it needs a column of the weights of the first layer, but no product.

use super::Activation;
use super::net::{Kind, Net, Source};
use super::packed::{Packed, panels};
use super::simd::{
    Arithmetic, Buffer, Isa, Memory, Pair, Rows, Task, Vector, Weights, collect, contract,
    dispatch, product, pull,
};

/// Number of values in a vector of f64.
const LANES: usize = 8;

/// Rows of one state in one layer, `[rows, stride]`.
#[derive(Debug)]
struct Units {
    stride: usize,
    z: Buffer<f64>,
    a: Buffer<f64>,
    /// σ′ and σ″.
    first: Buffer<f64>,
    second: Buffer<f64>,
    /// Sensitivities of the output to a, then to z.
    y: Buffer<f64>,
    /// σ″ times the sensitivities to a.
    weight: Buffer<f64>,
}

/// One state in a network whose layers form a chain: its value, gradient and second derivatives in double precision.
#[derive(Debug)]
pub struct Chain {
    /// Feature that direction 0 moves; direction d moves feature `moved` + d.
    moved: usize,
    /// Change of its feature along each direction.
    slopes: Vec<f64>,
    /// Value and tangent ′ of the features.
    x: Buffer<f64>,
    x_stride: usize,
    layers: Vec<Units>,
    yx: Buffer<f64>,
    /// Vectors whose sums are second derivatives, and those sums.
    vectors: Buffer<f64>,
    hessian: Buffer<f64>,
    /// Value of a single output.
    value: f64,
}

impl Chain {
    /// Buffers for a network whose layers read one another in order and end in one without activation; `None` for other
    /// networks. Direction d moves feature `moved` + d.
    #[must_use]
    pub fn new(net: &Net, moved: usize, directions: usize) -> Option<Self> {
        let last = net.layers.len().checked_sub(1).filter(|last| *last > 0)?;
        let chained = net.layers.iter().enumerate().all(|(l, layer)| {
            let source = match l {
                0 => Source::Features,
                l => Source::Layer(l - 1),
            };
            let dense = matches!(&layer.kind, Kind::Dense { inputs, .. }
                if matches!(&inputs[..], [input] if input.source == source));
            dense && layer.width > 0 && (l == last) == layer.activation.is_none()
        });
        if !chained || net.outputs != [last] || moved + directions > net.features {
            return None;
        }
        let units = |(l, width): (usize, usize)| {
            let stride = panels::<f64>(width) * LANES;
            let rows = if l == last { 2 } else { 2 + directions };
            Units {
                stride,
                z: Buffer::new(rows * stride),
                a: Buffer::new(rows * stride),
                first: Buffer::new(stride),
                second: Buffer::new(stride),
                y: Buffer::new(stride),
                weight: Buffer::new(stride),
            }
        };
        let x_stride = panels::<f64>(net.features) * LANES;
        let pairs = ((directions + 1) * (directions + 2) / 2).next_multiple_of(LANES);
        Some(Self {
            moved,
            slopes: vec![0.0; directions],
            x: Buffer::new(2 * x_stride),
            x_stride,
            layers: net
                .layers
                .iter()
                .map(|l| l.width)
                .enumerate()
                .map(units)
                .collect(),
            yx: Buffer::new(x_stride),
            vectors: Buffer::new(pairs * LANES),
            hessian: Buffer::new(pairs),
            value: 0.0,
        })
    }

    /// Sets the value of feature `i` and its tangent ′.
    #[inline]
    pub fn set_feature(&mut self, i: usize, value: f64, prime: f64) {
        self.x[i] = value;
        self.x[self.x_stride + i] = prime;
    }

    /// Sets the change of its feature along direction `d`.
    #[inline]
    pub fn set_slope(&mut self, d: usize, slope: f64) {
        self.slopes[d] = slope;
    }

    /// Computes the value, the gradient by the features and the second derivatives along ′ and the directions, for a
    /// network with one output.
    pub fn second_order(&mut self, net: &Net, packed: &Packed<f64>) {
        self.run(net, packed, Order::Second);
    }

    /// Computes all outputs and their tangents ′.
    pub fn forward(&mut self, net: &Net, packed: &Packed<f64>) {
        self.run(net, packed, Order::Forward);
    }

    /// Computes the gradient of `Σ_o seeds[o]` · output o by the features, after [`Chain::forward`].
    pub fn reverse(&mut self, net: &Net, packed: &Packed<f64>, seeds: &[f64]) {
        if let Some(last) = self.layers.last_mut() {
            last.y[..seeds.len()].copy_from_slice(seeds);
        }
        self.run(net, packed, Order::Reverse);
    }

    fn run(&mut self, net: &Net, packed: &Packed<f64>, order: Order) {
        dispatch(Run {
            chain: self,
            net,
            packed,
            order,
        });
    }

    /// Value of the only output, after [`Chain::second_order`].
    #[inline]
    #[must_use]
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Value (c = 0) or tangent ′ (c = 1) of output `o`, after [`Chain::forward`].
    #[inline]
    #[must_use]
    pub fn output(&self, c: usize, o: usize) -> f64 {
        let last = &self.layers[self.layers.len() - 1];
        last.z[c * last.stride + o]
    }

    /// Gradient by feature `i`, after [`Chain::second_order`] or [`Chain::reverse`].
    #[inline]
    #[must_use]
    pub fn feature_gradient(&self, i: usize) -> f64 {
        self.yx[i]
    }

    /// Second derivative along directions i and j, or along i and ′ where `j` is `None`, after
    /// [`Chain::second_order`].
    #[inline]
    #[must_use]
    pub fn second_derivative(&self, i: usize, j: Option<usize>) -> f64 {
        // The tangent ′ precedes the directions.
        let (r, q) = j.map_or((i + 1, 0), |j| (i.max(j) + 1, i.min(j) + 1));
        self.hessian[r * (r + 1) / 2 + q]
    }

    /// Computes layer `l`, with its σ if it has one, for `rows` rows: the value and its tangents.
    #[inline(always)]
    fn layer<I: Isa>(&mut self, net: &Net, packed: &Packed<f64>, l: usize, rows: usize) {
        let w = weights(net, packed, l);
        let (before, rest) = self.layers.split_at_mut(l);
        let own = &mut rest[0];
        let (values, stride, multiplied) = match before.last() {
            Some(before) => (&before.a[..], before.stride, rows),
            None => (&self.x[..], self.x_stride, rows.min(2)),
        };
        let mut z = Rows {
            values: &mut own.z[..],
            stride: own.stride,
        };
        let a = Rows { values, stride };
        product::<I>(&a, w, packed.bias(l), &mut z, multiplied);
        for (d, slope) in (multiplied..rows).zip(&self.slopes) {
            let slope = I::F64::splat(*slope);
            let row = own.z[d * own.stride..][..own.stride].chunks_exact_mut(LANES);
            for (p, z) in row.enumerate() {
                let column = w.column::<I>(p, self.moved + d - 2);
                column.mul(slope).store(z);
            }
        }
        if let Some(activation) = net.layers[l].activation {
            own.activate::<I>(activation, rows);
        }
    }

    /// Computes the sensitivities from layer `l` down to the features, and adds second derivatives along ′ and `directions`
    /// if requested.
    #[inline(always)]
    fn back<I: Isa>(
        &mut self,
        net: &Net,
        packed: &Packed<f64>,
        from: usize,
        directions: Option<usize>,
    ) {
        for l in (0..=from).rev() {
            let (before, rest) = self.layers.split_at_mut(l);
            let own = &mut rest[0];
            if net.layers[l].activation.is_some() {
                own.sensitivity::<I>();
                if let Some(directions) = directions {
                    let z = Rows {
                        values: &own.z[own.stride..],
                        stride: own.stride,
                    };
                    contract::<I>(&own.weight, &z, directions + 1, &mut self.vectors);
                }
            }
            let to = match before.last_mut() {
                Some(before) => &mut before.y,
                None => &mut self.yx,
            };
            pull::<I>(weights(net, packed, l), &own.y, to);
        }
    }
}

fn weights<'a>(net: &Net, packed: &'a Packed<f64>, l: usize) -> Weights<'a> {
    let terms = match l {
        0 => net.features,
        l => net.layers[l - 1].width,
    };
    Weights {
        panels: packed.forward(l, 0),
        terms,
    }
}

impl Units {
    #[inline(always)]
    fn activate<I: Isa>(&mut self, activation: Activation, rows: usize) {
        match activation {
            Activation::Softplus => self.apply::<I>(Activation::Softplus, rows),
            Activation::Tanh => self.apply::<I>(Activation::Tanh, rows),
            Activation::Gelu => self.apply::<I>(Activation::Gelu, rows),
            Activation::XTanh => self.apply::<I>(Activation::XTanh, rows),
            Activation::Square => self.apply::<I>(Activation::Square, rows),
            Activation::Exp => self.apply::<I>(Activation::Exp, rows),
        }
    }

    /// a = σ(z) and its slopes, and σ′ times the tangents (theory.md, equation 10).
    #[inline(always)]
    fn apply<I: Isa>(&mut self, activation: Activation, rows: usize) {
        let mut at = 0;
        // Two panels at a time, so that the sums of one do not wait for those of the other.
        while at + 2 * LANES <= self.stride {
            self.apply_at::<Pair<I::F64>>(activation, at, rows);
            at += 2 * LANES;
        }
        if at < self.stride {
            self.apply_at::<I::F64>(activation, at, rows);
        }
    }

    #[inline(always)]
    fn apply_at<V: Vector<Elem = f64>>(&mut self, activation: Activation, at: usize, rows: usize) {
        let d = activation.derivatives(V::load(&self.z[at..]));
        d.value.store(&mut self.a[at..]);
        d.first.store(&mut self.first[at..]);
        d.second.store(&mut self.second[at..]);
        for r in 1..rows {
            let at = r * self.stride + at;
            V::load(&self.z[at..]).mul(d.first).store(&mut self.a[at..]);
        }
    }

    /// y = σ′ y, and the weight σ″ y of the second derivatives (theory.md, equation 14).
    #[inline(always)]
    fn sensitivity<I: Isa>(&mut self) {
        for at in (0..self.stride).step_by(LANES) {
            let y = I::F64::load(&self.y[at..]);
            y.mul(I::F64::load(&self.first[at..]))
                .store(&mut self.y[at..]);
            y.mul(I::F64::load(&self.second[at..]))
                .store(&mut self.weight[at..]);
        }
    }
}

/// Results of a kernel.
enum Order {
    /// The value, the gradient and the second derivatives.
    Second,
    /// The outputs and their tangents ′.
    Forward,
    /// The gradient by the features.
    Reverse,
}

struct Run<'a> {
    chain: &'a mut Chain,
    net: &'a Net,
    packed: &'a Packed<f64>,
    order: Order,
}

impl Task for Run<'_> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let layers = self.chain.layers.len();
        match self.order {
            Order::Second => self.second_order::<I>(),
            Order::Forward => {
                // A loop: a closure would not be compiled for the instruction set.
                for l in 0..layers {
                    self.chain.layer::<I>(self.net, self.packed, l, 2);
                }
            }
            Order::Reverse => {
                let last = layers - 1;
                self.chain.back::<I>(self.net, self.packed, last, None);
            }
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    fn second_order<I: Isa>(self) {
        let Self {
            chain, net, packed, ..
        } = self;
        let Some(top) = chain.layers.len().checked_sub(2) else {
            return;
        };
        let directions = chain.slopes.len();
        for l in 0..=top {
            chain.layer::<I>(net, packed, l, 2 + directions);
        }
        // W of the only output, which is the sensitivity to its inputs.
        let output = packed.reverse(top + 1, 0);
        let units = &mut chain.layers[top];
        let mut sum = I::F64::splat(0.0);
        for at in (0..units.stride).step_by(LANES) {
            let w = I::F64::load(&output[at..]);
            w.store(&mut units.y[at..]);
            sum = I::F64::load(&units.a[at..]).fma(w, sum);
        }
        chain.value = packed.bias(top + 1)[0] + sum.sum();
        chain.vectors.fill(0.0);
        chain.back::<I>(net, packed, top, Some(directions));
        collect::<I>(&chain.vectors, &mut chain.hessian);
    }
}
