//! Tiles of J Jᵀ between two blocks of samples, from the factors of their Jacobians (theory.md, equation 20).
//!
//! The factors may be rounded to single precision: the products of two blocks then take half the time, and their sum over
//! the layers is still in double precision.

use std::ops::Range;

use super::factors::{Terms, used};
use super::net::{Kind, Net, Source};
use super::packed::panels;
use super::pass::Pass;
use super::simd::{Buffer, Gemm, GramTile, Init, Real, dispatch};

/// Factors of the Jacobian of one block of samples, for products with those of other blocks.
#[derive(Debug)]
pub struct Factors<S: Real> {
    samples: usize,
    /// Number of components times samples.
    rows: usize,
    /// Sensitivities y to each layer.
    y: Vec<Sides<S>>,
    /// Values a of each source, features first.
    a: Vec<Sides<S>>,
}

/// A matrix with a row for each component and sample, and its transpose, both in panels of columns.
#[derive(Debug)]
struct Sides<S: Real> {
    left: Buffer<S>,
    right: Buffer<S>,
}

/// Scratch memory for one tile of J Jᵀ.
#[derive(Debug)]
pub struct TileScratch<S: Real> {
    y: Buffer<S>,
    a: Buffer<S>,
}

impl<S: Real> TileScratch<S> {
    /// Scratch memory for tiles between blocks whose factors have the size of `factors`.
    #[must_use]
    pub fn new(factors: &Factors<S>) -> Self {
        let rows = factors.rows;
        let size = rows.next_multiple_of(S::LANES) * rows;
        Self {
            y: Buffer::new(size),
            a: Buffer::new(size),
        }
    }
}

fn slot(source: Source) -> usize {
    match source {
        Source::Features => 0,
        Source::Layer(l) => l + 1,
    }
}

impl<S: Real> Factors<S> {
    /// Buffers for the factors of a pass like `pass`, whose blocks hold a multiple of [`Real::LANES`] samples.
    #[must_use]
    pub fn new<T: Real>(net: &Net, pass: &Pass<T>) -> Self {
        let rows = pass.rows();
        let sides = |width: usize| Sides {
            left: Buffer::new(panels::<S>(width) * rows * S::LANES),
            right: Buffer::new(rows.next_multiple_of(S::LANES) * width),
        };
        let mut a = vec![sides(net.features)];
        a.extend(net.layers.iter().map(|l| sides(l.width)));
        Self {
            samples: pass.samples(),
            rows,
            y: net.layers.iter().map(|l| sides(l.width)).collect(),
            a,
        }
    }

    /// Copies the factors of a pass after its last reverse pass.
    pub fn set<T: Real>(&mut self, net: &Net, pass: &Pass<T>, terms: &Terms) {
        let (ys, as_) = terms.used();
        let rows = |components: Range<usize>| components.end * pass.samples();
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            let size = (pass.rows(), rows(ys.clone()), layer.width);
            self.y[l].set(pass.sensitivity(l), size);
            for input in inputs.iter().filter(|i| i.last_reader) {
                let size = (pass.rows(), rows(as_.clone()), input.width);
                self.a[slot(input.source)].set(pass.input(input.source), size);
            }
        }
    }

    /// Writes the tile of J Jᵀ between this block and another to `tile`, `[n · samples, n · samples]` for n raw outputs,
    /// with row i · samples + s for raw output i of sample s.
    pub fn tile(
        &self,
        net: &Net,
        other: &Self,
        terms: &Terms,
        scratch: &mut TileScratch<S>,
        tile: &mut [f64],
    ) {
        tile.fill(0.0);
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, bias } = &layer.kind else {
                continue;
            };
            let pairs = terms.at(net, l);
            let (ys, as_) = used(pairs);
            let y = (&self.y[l], &other.y[l], layer.width);
            self.products(y, &ys, &mut scratch.y, Init::Zero);
            for (k, input) in inputs.iter().enumerate() {
                let init = if k == 0 { Init::Zero } else { Init::Add };
                let source = slot(input.source);
                let a = (&self.a[source], &other.a[source], input.width);
                self.products(a, &as_, &mut scratch.a, init);
            }
            if bias.is_some() && as_.start == 0 {
                self.add_one(&mut scratch.a);
            }
            dispatch(GramTile {
                samples: self.samples,
                rows: self.rows,
                pairs,
                y: &scratch.y,
                a: &scratch.a,
                tile,
            });
        }
    }

    /// Products of some components of both blocks, in panels of columns with a row for each of all components.
    fn products(
        &self,
        (left, right, width): (&Sides<S>, &Sides<S>, usize),
        components: &Range<usize>,
        c: &mut [S],
        init: Init<'_, S>,
    ) {
        let used = components.start * self.samples..components.end * self.samples;
        let first = used.start / S::LANES;
        dispatch(Gemm::along_rows(
            &left.left,
            self.rows,
            &right.right[first * width * S::LANES..],
            width,
            &mut c[first * self.rows * S::LANES..],
            self.rows,
            used.clone(),
            used.len() / S::LANES,
            init,
        ));
    }

    /// Adds the product of the bias inputs, 1 · 1, for the values of both blocks.
    fn add_one(&self, a: &mut [S]) {
        let panels = a.chunks_exact_mut(self.rows * S::LANES);
        for panel in panels.take(self.samples / S::LANES) {
            for x in &mut panel[..self.samples * S::LANES] {
                *x = *x + S::of(1.0);
            }
        }
    }
}

impl<S: Real> Sides<S> {
    /// Copies the first `used` of `rows` rows and `width` columns of a matrix in panels.
    fn set<T: Real>(&mut self, from: &[T], (rows, used, width): (usize, usize, usize)) {
        for p in 0..panels::<T>(width) {
            let first = p * T::LANES;
            let count = T::LANES.min(width - first);
            let (panel, lane) = (first / S::LANES * rows, first % S::LANES);
            for r in 0..used {
                let row = &from[(p * rows + r) * T::LANES..][..count];
                let left = &mut self.left[(panel + r) * S::LANES + lane..][..count];
                let right = &mut self.right[(r / S::LANES * width + first) * S::LANES..];
                for (u, (&x, to)) in row.iter().zip(left).enumerate() {
                    let x = S::of(x.f64());
                    *to = x;
                    right[u * S::LANES + r % S::LANES] = x;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::net::Build;
    use super::super::packed::Packed;
    use super::*;
    use crate::Activation;
    use rand::{RngExt, SeedableRng};

    /// A pass of a network with two hidden layers and one output, linearised along two directions.
    fn linearised(seed: u64) -> (Net, Pass<f64>) {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut build = Build::new(4, 0);
        let softplus = Some(Activation::Softplus);
        let first = build.dense(20, &[Source::Features], softplus);
        let second = build.dense(11, &[first], softplus);
        build.dense(1, &[second], None);
        let net = build.finish();
        let packed = Packed::of(&net, &net.initialise(&mut rng)).unwrap_or_else(|e| panic!("{e}"));
        let mut pass = Pass::new(&net, 16, 2);
        for (c, s, i) in
            (0..6).flat_map(|c| (0..16).flat_map(move |s| (0..4).map(move |i| (c, s, i))))
        {
            pass.set_feature(c, s, i, rng.random_range(-1.0..1.0));
        }
        pass.forward(&net, &packed, Some(2));
        pass.reverse(&net, &packed, 2);
        pass.forward_mixed(&net, &packed, 2);
        pass.reverse_mixed(&net, &packed, 2);
        (net, pass)
    }

    fn pairs() -> Vec<Vec<(usize, usize)>> {
        (0..2)
            .map(|i| vec![(0, 4 + i), (1, 2 + i), (2 + i, 1), (4 + i, 0)])
            .collect()
    }

    fn tile<S: Real>(terms: &Terms) -> Vec<f64> {
        let ((net, left), (_, right)) = (linearised(1), linearised(2));
        let (mut a, mut b) = (
            Factors::<S>::new(&net, &left),
            Factors::<S>::new(&net, &right),
        );
        a.set(&net, &left, terms);
        b.set(&net, &right, terms);
        let mut out = vec![0.0; 32 * 32];
        a.tile(&net, &b, terms, &mut TileScratch::new(&a), &mut out);
        out
    }

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        let largest = a.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
        a.iter()
            .zip(b)
            .fold(0.0_f64, |w, (x, y)| w.max((x - y).abs()))
            / largest
    }

    #[test]
    fn factors_in_single_precision_give_the_same_tile_to_single_rounding() {
        let terms = Terms::of_value(pairs());
        let (double, single) = (tile::<f64>(&terms), tile::<f32>(&terms));
        let error = worst(&double, &single);
        assert!(error > 1e-12 && error < 1e-6, "{error}");
    }

    #[test]
    fn pairs_that_vanish_at_the_output_change_nothing() {
        let (all, few) = (Terms::new(pairs()), Terms::of_value(pairs()));
        assert!(worst(&tile::<f64>(&all), &tile::<f64>(&few)) < 1e-15);
    }
}
