//! Every kernel on every instruction set of this machine against the portable one, over random shapes and values.

mod elementwise;
mod planes;
mod products;
mod rows;
mod updates;

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Buffer, Level, Real, Shape, levels};

/// Number of random shapes of each kernel.
const SHAPES: u64 = 12;

/// Shapes and values from a seed.
struct Draw(ChaCha8Rng);

impl Draw {
    fn size(&mut self, range: Range<usize>) -> usize {
        self.0.random_range(range)
    }

    fn values<T: Real>(&mut self, len: usize) -> Buffer<T> {
        let mut buffer = Buffer::new(len);
        for x in buffer.iter_mut() {
            *x = T::of(self.0.random_range(-1.5..1.5));
        }
        buffer
    }

    /// A layer of a block of samples, of any size.
    fn shape(&mut self) -> Shape {
        let samples = self.size(1..20);
        self.shape_of(samples)
    }

    fn shape_of(&mut self, samples: usize) -> Shape {
        let capacity = self.size(1..6);
        Shape {
            samples,
            components: 2 + 2 * capacity,
            capacity,
            panels: self.size(1..5),
        }
    }

    fn layer<T: Real>(&mut self, shape: &Shape) -> Buffer<T> {
        self.values(shape.panels * shape.components * shape.samples * T::LANES)
    }

    fn slopes<T: Real, const N: usize>(&mut self, shape: &Shape) -> [Buffer<T>; N] {
        std::array::from_fn(|_| self.values(shape.panels * shape.samples * T::LANES))
    }

    /// Pairs of components for some raw outputs, as in a factored Jacobian.
    fn terms(&mut self, shape: &Shape) -> Vec<Vec<(usize, usize)>> {
        let n = shape.capacity;
        (0..n)
            .map(|i| vec![(0, 2 + n + i), (1, 2 + i), (2 + i, 1), (2 + n + i, 0)])
            .collect()
    }
}

/// Asserts that the result of `run` on each level agrees with that on the portable one up to rounding.
fn agree<T: Real>(name: &str, run: impl Fn(Level) -> Vec<T>) {
    let portable = run(Level::Portable);
    let size = portable.iter().map(|x| x.f64().abs()).fold(1.0, f64::max);
    assert!(size.is_finite(), "{name}: {size}");
    // Some hundred roundings.
    let bound = if T::LANES == 8 { 1e-13 } else { 5e-5 } * size;
    for level in levels() {
        let found = run(level);
        assert_eq!(found.len(), portable.len());
        for (at, (x, y)) in found.iter().zip(&portable).enumerate() {
            let error = (x.f64() - y.f64()).abs();
            assert!(error <= bound, "{name} on {level}: {error:e} at {at}");
        }
    }
}

/// Runs a test of both precisions over random shapes.
fn each(test: impl Fn(&mut Draw)) {
    for seed in 0..SHAPES {
        test(&mut Draw(ChaCha8Rng::seed_from_u64(seed)));
    }
}

/// Joins all values of some buffers.
trait ConcatAll<T> {
    fn concat_all(&self) -> Vec<T>;
}

impl<T: Real, const N: usize> ConcatAll<T> for [Buffer<T>; N] {
    fn concat_all(&self) -> Vec<T> {
        self.iter().flat_map(|b| b.iter().copied()).collect()
    }
}
