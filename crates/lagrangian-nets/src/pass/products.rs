//! Linear combinations of tangents, and the gradient by the weights.

use super::super::net::{Kind, Net};
use super::super::packed::{Gradient, panels};
use super::super::simd::{Combine, Gemm, Init, Real, SumRows, dispatch};
use super::{LayerBuffers, Pass};

impl<T: Real> Pass<T> {
    /// Replaces tangents by linear combinations, sample by sample: ′ becomes ′ + Σ `along[s, i]` i, and if
    /// `onto` is given, direction 0 becomes Σ `onto[s, i]` i (both `[samples, directions]`).
    pub fn combine(&mut self, net: &Net, directions: usize, along: &[T], onto: Option<&[T]>) {
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
        let shape = self.shape_of(self.x_width);
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

    /// Adds the gradient by the parameters of `Σ_samples` (mixed component of direction 0 of the output) to `gradient`,
    /// after [`Pass::reverse_mixed`] (theory.md, equation 18).
    pub fn add_gradient(&self, net: &Net, gradient: &mut Gradient<T>) {
        let mixed = self.mixed(0);
        // At the outputs only the value is nonzero.
        let pairs = [(0, mixed), (1, 2), (2, 1), (mixed, 0)];
        self.add_products_at(net, |output| &pairs[..if output { 1 } else { 4 }], gradient);
    }

    /// Adds `Σ_samples Σ_(c, k)` `y_c` ⊗ `a_k` to `gradient`, for the given `pairs` (c, k) of a component of the
    /// sensitivities y to a layer and a component of the input a of that layer.
    pub fn add_products(&self, net: &Net, pairs: &[(usize, usize)], gradient: &mut Gradient<T>) {
        self.add_products_at(net, |_| pairs, gradient);
    }

    /// Adds the outer products of pairs of components that depend on whether a layer is an output.
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
                // The bias multiplies the constant 1, whose components other than the value are 0.
                for &(y, _) in pairs.iter().filter(|p| p.1 == 0) {
                    self.add_rows(yz, y, sums);
                }
            }
        }
    }

    /// Adds component `c` of `matrix`, summed over the samples, to `sums`.
    pub(crate) fn add_rows(&self, matrix: &[T], c: usize, sums: &mut [T]) {
        let lanes = T::LANES;
        let panels = matrix.chunks_exact(self.rows() * lanes);
        for (panel, sums) in panels.zip(sums.chunks_exact_mut(lanes)) {
            let rows = &panel[c * self.samples * lanes..][..self.samples * lanes];
            dispatch(SumRows { rows, sums });
        }
    }
}
