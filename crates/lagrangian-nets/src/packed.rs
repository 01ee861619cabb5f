//! Weights and their gradient in the memory layout of the kernels: in panels of 64 bytes.
//!
//! A matrix `[rows, columns]` is stored in panels of LANES columns, each `[rows, LANES]`, zero beyond its last column. A bias
//! is a matrix of one row.

use super::net::{Input, Kind, Layer, Net};
use super::simd::{AddTo, Buffer, Init, Real, SumOfSquares, dispatch};

pub(super) fn panels<T: Real>(width: usize) -> usize {
    width.div_ceil(T::LANES)
}

/// A matrix among the parameters of a network.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Index of its first value, row-major.
    at: usize,
    rows: usize,
    columns: usize,
}

impl Place {
    fn of(layer: &Layer, input: &Input) -> Self {
        Self {
            at: input.at,
            rows: layer.width,
            columns: input.width,
        }
    }

    fn of_bias(layer: &Layer, at: usize) -> Self {
        Self {
            at,
            rows: 1,
            columns: layer.width,
        }
    }

    pub(super) fn size<T: Real>(&self) -> usize {
        panels::<T>(self.columns) * self.rows * T::LANES
    }

    /// Calls `f(begin among the parameters, begin in the panels, length)` for each row of each panel.
    #[inline(always)]
    fn each<T: Real>(&self, mut f: impl FnMut(usize, usize, usize)) {
        for p in 0..panels::<T>(self.columns) {
            let length = T::LANES.min(self.columns - p * T::LANES);
            for r in 0..self.rows {
                let flat = self.at + r * self.columns + p * T::LANES;
                f(flat, (p * self.rows + r) * T::LANES, length);
            }
        }
    }

    /// Copies the matrix from the parameters to panels of T.
    pub(super) fn copy_in<T: Real, E: Copy>(
        &self,
        flat: &[f64],
        panels: &mut [E],
        round: impl Fn(f64) -> E,
    ) {
        self.each::<T>(|from, to, length| {
            let to = &mut panels[to..to + length];
            for (to, &x) in to.iter_mut().zip(&flat[from..from + length]) {
                *to = round(x);
            }
        });
    }

    /// Applies `take` to each of the parameters and its value in panels of T.
    pub(super) fn copy_out<T: Real, E: Copy>(
        &self,
        panels: &[E],
        flat: &mut [f64],
        take: impl Fn(&mut f64, E),
    ) {
        self.each::<T>(|to, from, length| {
            let to = &mut flat[to..to + length];
            for (to, &x) in to.iter_mut().zip(&panels[from..from + length]) {
                take(to, x);
            }
        });
    }

    /// Sets the values beyond the last column to zero.
    fn clear_padding<T: Real>(&self, panels: &mut [T]) {
        let length = self.columns % T::LANES;
        if length == 0 {
            return;
        }
        let last = (self.columns / T::LANES * self.rows) * T::LANES;
        for row in panels[last..].chunks_exact_mut(T::LANES) {
            row[length..].fill(T::default());
        }
    }
}

/// Matrices of a layer: those of its inputs, then its bias.
pub(super) fn places(layer: &Layer) -> impl Iterator<Item = Place> {
    let (inputs, bias) = match &layer.kind {
        Kind::Dense { inputs, bias } => (inputs.as_slice(), *bias),
        Kind::Gate { .. } => (&[][..], None),
    };
    let bias = bias.map(|at| Place::of_bias(layer, at));
    inputs.iter().map(|i| Place::of(layer, i)).chain(bias)
}

/// Parameters of a network in the layout of the kernels: every matrix and its transpose in panels.
#[derive(Debug, Clone)]
pub struct Packed<T: Real> {
    layers: Vec<PackedLayer<T>>,
}

#[derive(Debug, Clone)]
struct PackedLayer<T: Real> {
    /// Wᵀ of each input, in panels of outputs.
    forward: Vec<Buffer<T>>,
    /// W of each input, in panels of inputs; then the bias.
    reverse: Vec<Buffer<T>>,
    /// Zero bias for layers without a bias.
    zero: Buffer<T>,
}

impl<T: Real> Packed<T> {
    /// Panels of zeros for the parameters of `net`.
    #[must_use]
    pub fn new(net: &Net) -> Self {
        let layer = |layer: &Layer| {
            let inputs = match &layer.kind {
                Kind::Dense { inputs, .. } => inputs.as_slice(),
                Kind::Gate { .. } => &[],
            };
            let row = panels::<T>(layer.width) * T::LANES;
            PackedLayer {
                forward: inputs.iter().map(|i| Buffer::new(row * i.width)).collect(),
                reverse: places(layer).map(|p| Buffer::new(p.size::<T>())).collect(),
                zero: Buffer::new(row),
            }
        };
        Self {
            layers: net.layers.iter().map(layer).collect(),
        }
    }

    /// Panels of the given `parameters` of `net`.
    ///
    /// # Errors
    /// The errors of [`Net::check`].
    pub fn of(net: &Net, parameters: &[f64]) -> crate::Result<Self> {
        net.check(parameters)?;
        let mut packed = Self::new(net);
        packed.set(net, parameters);
        Ok(packed)
    }

    /// Wᵀ of input `k` of layer `l`.
    pub(super) fn forward(&self, l: usize, k: usize) -> &[T] {
        &self.layers[l].forward[k]
    }

    /// W of input `k` of layer `l`.
    pub(super) fn reverse(&self, l: usize, k: usize) -> &[T] {
        &self.layers[l].reverse[k]
    }

    /// Bias of layer `l`, zero where the layer has none.
    pub(super) fn bias(&self, l: usize) -> &[T] {
        let layer = &self.layers[l];
        layer
            .reverse
            .get(layer.forward.len())
            .unwrap_or(&layer.zero)
    }

    /// Matrix `k` of layer `l` in the layout of its gradient: W of its inputs, then its bias.
    pub(super) fn matrix_mut(&mut self, l: usize, k: usize) -> &mut [T] {
        &mut self.layers[l].reverse[k]
    }

    /// Copies `parameters` (in the order of [`Net`]) into the panels.
    pub fn set(&mut self, net: &Net, parameters: &[f64]) {
        for (l, layer) in net.layers.iter().enumerate() {
            for (k, place) in places(layer).enumerate() {
                place.copy_in::<T, T>(parameters, self.matrix_mut(l, k), T::of);
            }
        }
        self.transpose(net);
    }

    /// Computes Wᵀ from W.
    pub(super) fn transpose(&mut self, net: &Net) {
        for (layer, packed) in net.layers.iter().zip(&mut self.layers) {
            let pairs = packed.forward.iter_mut().zip(&packed.reverse);
            for (place, (forward, reverse)) in places(layer).zip(pairs) {
                transpose(reverse, (place.rows, place.columns), forward);
            }
        }
    }
}

/// Transposes a matrix in panels of its columns to panels of its rows, block by block.
fn transpose<T: Real>(from: &[T], (rows, columns): (usize, usize), to: &mut [T]) {
    let lanes = T::LANES;
    for i in (0..columns).step_by(lanes) {
        for o in (0..rows).step_by(lanes) {
            let (height, width) = (lanes.min(rows - o), lanes.min(columns - i));
            let from = &from[i * rows + o * lanes..][..height * lanes];
            let to = &mut to[o * columns + i * lanes..][..width * lanes];
            for (c, to) in to.chunks_exact_mut(lanes).enumerate() {
                for (to, from) in to.iter_mut().zip(from.chunks_exact(lanes)) {
                    *to = from[c];
                }
            }
        }
    }
}

/// Gradient by the parameters of a network, summed over blocks of samples, in panels.
#[derive(Debug, Clone)]
pub struct Gradient<T: Real> {
    /// Matrices and bias of each layer, as in [`Packed::matrix_mut`].
    layers: Vec<Vec<Buffer<T>>>,
    fresh: bool,
}

impl<T: Real> Gradient<T> {
    /// An empty sum of gradients by the parameters of `net`.
    #[must_use]
    pub fn new(net: &Net) -> Self {
        let layer = |layer| places(layer).map(|p| Buffer::new(p.size::<T>())).collect();
        Self {
            layers: net.layers.iter().map(layer).collect(),
            fresh: true,
        }
    }

    /// Initial content of the matrices when the next block is added.
    pub(super) fn begin(&mut self) -> Init<'static, T> {
        if std::mem::replace(&mut self.fresh, false) {
            Init::Zero
        } else {
            Init::Add
        }
    }

    /// Matrices of the inputs of layer `l`, and the gradient by its bias, empty for a layer without a bias.
    pub(super) fn layer(&mut self, l: usize, inputs: usize) -> (&mut [Buffer<T>], &mut [T]) {
        let (matrices, bias) = self.layers[l].split_at_mut(inputs);
        (matrices, bias.first_mut().map_or(&mut [], |b| &mut b[..]))
    }

    /// Matrix `k` of layer `l`.
    pub(super) fn matrix(&self, l: usize, k: usize) -> &[T] {
        &self.layers[l][k]
    }

    /// Starts a new sum.
    pub fn clear(&mut self) {
        self.fresh = true;
    }

    /// Adds the sum of another gradient.
    pub fn add(&mut self, other: &Self) {
        if other.fresh {
            return;
        }
        if self.fresh {
            self.clone_from(other);
            return;
        }
        let pairs = self
            .layers
            .iter_mut()
            .flatten()
            .zip(other.layers.iter().flatten());
        for (to, from) in pairs {
            dispatch(AddTo { from, to });
        }
    }

    /// Completes the sum (zero for an empty sum, and in the padding of the panels) and returns the sum of its
    /// squares.
    pub fn settle(&mut self, net: &Net) -> f64 {
        let mut sum = 0.0;
        for (layer, matrices) in net.layers.iter().zip(&mut self.layers) {
            for (place, matrix) in places(layer).zip(matrices) {
                if self.fresh {
                    matrix.fill(T::default());
                }
                place.clear_padding(matrix);
                dispatch(SumOfSquares {
                    of: &matrix[..],
                    sum: &mut sum,
                });
            }
        }
        self.fresh = false;
        sum
    }

    /// Adds the gradient to `out`, `[parameters]`.
    pub fn add_to(&self, net: &Net, out: &mut [f64]) {
        if self.fresh {
            return;
        }
        for (layer, matrices) in net.layers.iter().zip(&self.layers) {
            for (place, matrix) in places(layer).zip(matrices) {
                place.copy_out::<T, T>(matrix, out, |sum, x| *sum += x.f64());
            }
        }
    }
}
