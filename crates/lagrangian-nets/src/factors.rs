//! Products with the residual Jacobian of a batch by the parameters, which is kept as factors and never formed.
//!
//! The raw output `S_i` of a sample depends on a matrix of weights W through `∂S_i/∂W` = Σ_(c, k) `y_c` ⊗ `a_k`, over a few
//! pairs of a component c of the sensitivities y to its layer and a component k of the input a of its layer. Hence
//! J Jᵀ = `Σ_layers` `Σ_pairs` `Σ_pairs`' (`y_c` · `y_c`') (`a_k` · `a_k`'): two products of the width of the layer instead of one
//! of its square. Nothing of the size (batch × parameters) is stored (theory.md, equations 18 and 20).

use std::ops::Range;

use super::net::{Kind, Net};
use super::packed::{Gradient, Packed, panels};
use super::pass::Pass;
use super::simd::{Buffer, Gemm, Init, Real, RowDots, WeighRows, dispatch};

/// Factors of the Jacobian of each raw output of a sample: pairs of a component of the sensitivities to a layer and a
/// component of the input of that layer, whose outer products are summed (theory.md, equation 18).
#[derive(Debug, Clone)]
pub struct Terms {
    hidden: Vec<Vec<(usize, usize)>>,
    output: Vec<Vec<(usize, usize)>>,
}

impl Terms {
    /// The given `pairs` of every raw output, equal in all layers.
    #[must_use]
    pub fn new(pairs: Vec<Vec<(usize, usize)>>) -> Self {
        Self {
            output: pairs.clone(),
            hidden: pairs,
        }
    }

    /// The given `pairs` of every raw output of a network with one output of which only the value counts. The sensitivity
    /// to it is 1 in its value and 0 in all other components, so that the output layer keeps the pairs of the value.
    #[must_use]
    pub fn of_value(pairs: Vec<Vec<(usize, usize)>>) -> Self {
        let first =
            |pairs: &Vec<(usize, usize)>| pairs.iter().copied().filter(|p| p.0 == 0).collect();
        Self {
            output: pairs.iter().map(first).collect(),
            hidden: pairs,
        }
    }

    /// Number of raw outputs of a sample.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.hidden.len()
    }

    /// Components of sensitivities and of inputs that any layer uses.
    pub(super) fn used(&self) -> (Range<usize>, Range<usize>) {
        used(&self.hidden)
    }

    /// Pairs of every raw output in layer `l`.
    #[must_use]
    pub fn at(&self, net: &Net, l: usize) -> &[Vec<(usize, usize)>] {
        match net.outputs.contains(&l) {
            true => &self.output,
            false => &self.hidden,
        }
    }
}

/// Components of sensitivities and of inputs that pairs use: all from the first to the last.
pub(super) fn used(pairs: &[Vec<(usize, usize)>]) -> (Range<usize>, Range<usize>) {
    let range = |of: fn(&(usize, usize)) -> usize| {
        let all = || pairs.iter().flatten().map(of);
        all().min().unwrap_or(0)..all().max().map_or(0, |last| last + 1)
    };
    (range(|p| p.0), range(|p| p.1))
}

impl<T: Real> Pass<T> {
    /// Adds (J φ)`[s, i]`, with φ packed as parameters, to `out`, `[samples, raw outputs]`; `scratch` has
    /// [`widest`](Pass::widest) values (theory.md, section 7).
    pub fn push_forward(
        &self,
        net: &Net,
        phi: &Packed<T>,
        terms: &Terms,
        scratch: &mut Buffer<T>,
        out: &mut [f64],
    ) {
        let (rows, samples) = (self.rows(), self.samples());
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            let pairs = terms.at(net, l);
            let as_ = used(pairs).1;
            let width = panels::<T>(layer.width);
            for (k, input) in inputs.iter().enumerate() {
                let (a, w) = (self.input(input.source), phi.forward(l, k));
                let init = match k {
                    0 => Init::Rows(phi.bias(l), samples),
                    _ => Init::Add,
                };
                let (c, part) = (&mut scratch[..], as_.start * samples..as_.end * samples);
                dispatch(Gemm::along_rows(
                    a,
                    rows,
                    w,
                    input.width,
                    c,
                    rows,
                    part,
                    width,
                    init,
                ));
            }
            let shape = self.shape_of(layer.width);
            dispatch(RowDots {
                shape,
                pairs,
                y: self.sensitivity(l),
                a: scratch,
                out,
            });
        }
    }

    /// Writes ∂`S_i`/∂θ of sample `s`, `[parameters]`, to `out`; `scratch` is memory (theory.md, equation 18).
    pub fn jacobian_row(
        &self,
        net: &Net,
        terms: &Terms,
        (s, i): (usize, usize),
        scratch: &mut Vec<f64>,
        out: &mut [f64],
    ) {
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let (pairs, y) = (&terms.at(net, l)[i], self.sensitivity(l));
            if let Some(bias) = bias {
                let of_value = || pairs.iter().filter(|pair| pair.1 == 0);
                for (u, out) in out[*bias..][..layer.width].iter_mut().enumerate() {
                    *out = of_value()
                        .map(|pair| y[self.index(pair.0, s, u)].f64())
                        .sum();
                }
            }
            for input in inputs.iter().filter(|input| input.width > 0) {
                let a = self.input(input.source);
                scratch.clear();
                for &(_, k) in pairs {
                    scratch.extend((0..input.width).map(|u| a[self.index(k, s, u)].f64()));
                }
                let matrix = &mut out[input.at..][..layer.width * input.width];
                for (u, row) in matrix.chunks_exact_mut(input.width).enumerate() {
                    let mut first = true;
                    for (&(c, _), a) in pairs.iter().zip(scratch.chunks_exact(input.width)) {
                        let weight = y[self.index(c, s, u)].f64();
                        if std::mem::take(&mut first) {
                            row.iter_mut().zip(a).for_each(|(out, a)| *out = weight * a);
                        } else {
                            row.iter_mut()
                                .zip(a)
                                .for_each(|(out, a)| *out += weight * a);
                        }
                    }
                }
            }
        }
    }

    /// Adds Jᵀx = Σ `x[s, i]` ∂`S_i`/∂θ to `gradient`, with x `[samples, raw outputs]`; `scratch` has
    /// [`widest`](Pass::widest) values (theory.md, section 7).
    pub fn pull_back_factors(
        &self,
        net: &Net,
        terms: &Terms,
        x: &[f64],
        scratch: &mut Buffer<T>,
        gradient: &mut Gradient<T>,
    ) {
        let step = self.samples() * T::LANES;
        let init = gradient.begin();
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let shape = self.shape_of(layer.width);
            let pairs = terms.at(net, l);
            let as_ = used(pairs).1;
            let pieces: Vec<_> = as_.clone().map(|c| (c * step, c * step)).collect();
            dispatch(WeighRows {
                shape,
                pairs,
                components: as_.clone(),
                x,
                y: self.sensitivity(l),
                out: scratch,
            });
            let (matrices, sums) = gradient.layer(l, inputs.len());
            for (input, matrix) in inputs.iter().zip(matrices) {
                let (a, rows) = (self.input(input.source), self.rows());
                let width = panels::<T>(input.width);
                dispatch(Gemm::along_columns(
                    scratch,
                    rows,
                    a,
                    rows,
                    &pieces,
                    self.samples(),
                    matrix,
                    layer.width,
                    width,
                    init,
                ));
            }
            if bias.is_some() {
                if matches!(init, Init::Zero) {
                    sums.fill(T::default());
                }
                if as_.start == 0 {
                    self.add_rows(scratch, 0, sums);
                }
            }
        }
    }
}
