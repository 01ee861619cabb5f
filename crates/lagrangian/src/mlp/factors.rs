//! The Jacobian of a batch by the parameters, kept as factors: never formed, only used.
//!
//! The raw output `S_i` of a sample depends on a weight matrix W through `dS_i` = Σ_(c, k) `y_c` ⊗ `a_k`, a few pairs of
//! components (`terms[i]`) of the sensitivity y and of the input a of its layer. Hence
//! J Jᵀ = `Σ_layers` `Σ_pairs` `Σ_pairs`' (`y_c` · `y_c`') (`a_k` · `a_k`'), two products of the width of the layer instead of one
//! of its square, and nothing of the size (batch × parameters) exists (theory.md, equations 18 and 20).

use super::net::{Kind, Net, Source};
use super::packed::{Gradient, Packed, panels};
use super::pass::Pass;
use super::simd::{Buffer, Gemm, GramTile, Init, Real, RowDots, Shape, WeighRows, dispatch};

/// Pairs (component of y, component of a) for each raw output of a sample.
pub(crate) type Terms = [Vec<(usize, usize)>];

/// How many components of y and of a the terms use.
fn used(terms: &Terms) -> (usize, usize) {
    let pairs = || terms.iter().flatten();
    (
        pairs().map(|p| p.0 + 1).max().unwrap_or(0),
        pairs().map(|p| p.1 + 1).max().unwrap_or(0),
    )
}

/// Transposed factors of one block, so that they can stand on the right of a product.
#[derive(Debug)]
pub(crate) struct Transposed<T: Real> {
    /// Per layer: yᵀ.
    y: Vec<Buffer<T>>,
    /// Per source, features first: aᵀ.
    a: Vec<Buffer<T>>,
}

/// Scratch for one tile of J Jᵀ.
#[derive(Debug)]
pub(crate) struct TileScratch<T: Real> {
    y: Buffer<T>,
    a: Buffer<T>,
}

fn slot(source: Source) -> usize {
    match source {
        Source::Features => 0,
        Source::Layer(l) => l + 1,
    }
}

impl<T: Real> TileScratch<T> {
    pub(crate) fn new(pass: &Pass<T>) -> Self {
        let rows = pass.rows();
        let size = rows.next_multiple_of(T::LANES) * rows;
        Self {
            y: Buffer::new(size),
            a: Buffer::new(size),
        }
    }
}

impl<T: Real> Transposed<T> {
    pub(crate) fn new(net: &Net, pass: &Pass<T>) -> Self {
        let buffer = |width: usize| Buffer::new(pass.rows().next_multiple_of(T::LANES) * width);
        let mut a = vec![buffer(net.features)];
        a.extend(net.layers.iter().map(|l| buffer(l.width)));
        Self {
            y: net.layers.iter().map(|l| buffer(l.width)).collect(),
            a,
        }
    }

    /// Copies the factors of a linearised pass.
    pub(crate) fn set(&mut self, net: &Net, pass: &Pass<T>, terms: &Terms) {
        let (ys, as_) = used(terms);
        let (y_rows, a_rows) = (ys * pass.samples(), as_ * pass.samples());
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            transpose(
                pass.sensitivity(l),
                pass.rows(),
                y_rows,
                layer.width,
                &mut self.y[l],
            );
            for input in inputs.iter().filter(|i| i.last_reader) {
                let target = &mut self.a[slot(input.source)];
                transpose(
                    pass.input(input.source),
                    pass.rows(),
                    a_rows,
                    input.width,
                    target,
                );
            }
        }
    }
}

/// Copies the first `used` rows and `width` columns of a matrix of `rows` rows, in panels, transposed.
fn transpose<T: Real>(from: &[T], rows: usize, used: usize, width: usize, to: &mut [T]) {
    let lanes = T::LANES;
    for u in 0..width {
        let column = &from[u / lanes * rows * lanes + u % lanes..];
        for r in 0..used {
            to[(r / lanes * width + u) * lanes + r % lanes] = column[r * lanes];
        }
    }
}

impl<T: Real> Pass<T> {
    /// Writes the tile of S-space J Jᵀ between this block and another to `tile`, `[n · samples, n · samples]` with
    /// row i · samples + s; blocks hold a multiple of LANES samples.
    pub(crate) fn gram_tile(
        &self,
        net: &Net,
        other: &Transposed<T>,
        terms: &Terms,
        scratch: &mut TileScratch<T>,
        tile: &mut [T],
    ) {
        tile.fill(T::default());
        let (ys, as_) = used(terms);
        let (rows, samples) = (self.rows(), self.samples());
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let multiply =
                |a: &[T], b: &[T], width: usize, components: usize, c: &mut [T], init| {
                    let used = components * samples;
                    let panels = used / T::LANES;
                    dispatch(Gemm::along_rows(
                        a,
                        rows,
                        b,
                        width,
                        c,
                        rows,
                        0..used,
                        panels,
                        init,
                    ));
                };
            multiply(
                self.sensitivity(l),
                &other.y[l],
                layer.width,
                ys,
                &mut scratch.y,
                Init::Zero,
            );
            for (k, input) in inputs.iter().enumerate() {
                let init = if k == 0 { Init::Zero } else { Init::Add };
                let right = &other.a[slot(input.source)];
                multiply(
                    self.input(input.source),
                    right,
                    input.width,
                    as_,
                    &mut scratch.a,
                    init,
                );
            }
            let one = T::of(if bias.is_some() { 1.0 } else { 0.0 });
            let shape = Shape {
                samples,
                components: rows / samples,
                room: 0,
                panels: 0,
            };
            dispatch(GramTile {
                shape,
                terms,
                one,
                y: &scratch.y,
                a: &scratch.a,
                tile,
            });
        }
    }

    /// Adds S-space J φ, for φ packed as parameters, to `out[s, i]`; `scratch` is as large as the widest layer.
    pub(crate) fn push_forward(
        &self,
        net: &Net,
        phi: &Packed<T>,
        terms: &Terms,
        scratch: &mut Buffer<T>,
        out: &mut [f64],
    ) {
        let (rows, samples) = (self.rows(), self.samples());
        let as_ = used(terms).1 * samples;
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            let width = panels::<T>(layer.width);
            for (k, input) in inputs.iter().enumerate() {
                let (a, w) = (self.input(input.source), phi.forward(l, k));
                let init = match k {
                    0 => Init::Rows(phi.bias(l), samples),
                    _ => Init::Add,
                };
                let (c, part) = (&mut scratch[..], 0..as_);
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
            let shape = Shape {
                samples,
                components: rows / samples,
                room: 0,
                panels: width,
            };
            dispatch(RowDots {
                shape,
                terms,
                y: self.sensitivity(l),
                a: scratch,
                out,
            });
        }
    }

    /// Adds Σ x[s, i] ∂`S_i/∂parameters` to `gradient`; `scratch` is as large as the widest layer.
    pub(crate) fn pull_back_factors(
        &self,
        net: &Net,
        terms: &Terms,
        x: &[f64],
        scratch: &mut Buffer<T>,
        gradient: &mut Gradient<T>,
    ) {
        let as_ = used(terms).1;
        let step = self.samples() * T::LANES;
        let pieces: Vec<_> = (0..as_).map(|c| (c * step, c * step)).collect();
        let init = gradient.begin();
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let shape = Shape {
                samples: self.samples(),
                components: self.rows() / self.samples(),
                room: 0,
                panels: panels::<T>(layer.width),
            };
            dispatch(WeighRows {
                shape,
                terms,
                components: as_,
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
                self.add_rows(scratch, 0, sums);
            }
        }
    }
}
