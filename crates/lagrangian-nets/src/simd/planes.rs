//! Values of samples with the samples in the lanes, so that computations by sample process a vector of samples
//! at a time.
//!
//! A layer stores the units of one sample side by side, planes store one value of many samples side by side; square blocks
//! are transposed between the two by log₂ LANES rounds of [`Vector::zip`].

use super::{Buffer, Isa, Memory, Real, Shape, Task, Vector};

/// An equal number of values of every sample: value k of sample s is lane s mod LANES of vector k of group s / LANES.
#[derive(Debug, Clone)]
pub struct Planes<T> {
    values: usize,
    buffer: Buffer<T>,
}

impl<T: Real> Planes<T> {
    /// Zeros for `values` values of each of `samples` samples.
    #[must_use]
    pub fn new(values: usize, samples: usize) -> Self {
        Self {
            values,
            buffer: Buffer::new(samples.div_ceil(T::LANES) * values * T::LANES),
        }
    }

    #[inline(always)]
    fn at(&self, k: usize, s: usize) -> usize {
        (s / T::LANES * self.values + k) * T::LANES + s % T::LANES
    }

    /// Value `k` of sample `s`.
    #[inline(always)]
    pub fn number(&self, k: usize, s: usize) -> T {
        self.buffer[self.at(k, s)]
    }

    /// Sets value `k` of sample `s`.
    #[inline(always)]
    pub fn set(&mut self, k: usize, s: usize, x: T) {
        let at = self.at(k, s);
        self.buffer[at] = x;
    }

    /// Vectors of group `g`, in order.
    #[inline(always)]
    pub fn group(&self, g: usize) -> &[T] {
        &self.buffer[g * self.values * T::LANES..][..self.values * T::LANES]
    }

    /// Vectors of group `g`, in order, for writing.
    #[inline(always)]
    pub fn group_mut(&mut self, g: usize) -> &mut [T] {
        &mut self.buffer[g * self.values * T::LANES..][..self.values * T::LANES]
    }

    /// Sets value `k` of the eight samples from `s` on, a multiple of eight, rounding from double precision.
    #[inline(always)]
    pub fn set_eight<V: Vector<Elem = f64>>(&mut self, k: usize, s: usize, x: V) {
        let mut lanes = [0.0; 8];
        x.store(&mut lanes);
        let at = self.at(k, s);
        let to = &mut self.buffer[at..at + 8];
        for (to, x) in to.iter_mut().zip(lanes) {
            *to = T::of(x);
        }
    }
}

/// Vector `k` of a group.
#[inline(always)]
pub fn vector<V: Vector>(group: &[V::Elem], k: usize) -> V {
    V::load(&group[k * V::LANES..])
}

/// Sets vector `k` of a group.
#[inline(always)]
pub fn set_vector<V: Vector>(group: &mut [V::Elem], k: usize, x: V) {
    x.store(&mut group[k * V::LANES..]);
}

/// Transpose of the first LANES rows of LANES values each.
#[inline(always)]
fn transpose<V: Vector>(mut rows: [V; 16]) -> [V; 16] {
    let half = V::LANES / 2;
    let mut round = 1;
    while round < V::LANES {
        let from = rows;
        for i in 0..half {
            (rows[2 * i], rows[2 * i + 1]) = from[i].zip(from[i + half]);
        }
        round *= 2;
    }
    rows
}

/// Copies the units of one component of a layer to planes: unit u becomes value `first` + u.
pub(crate) struct ToPlanes<'a, T> {
    pub shape: Shape,
    pub component: usize,
    pub width: usize,
    pub layer: &'a [T],
    pub first: usize,
    pub planes: &'a mut Planes<T>,
}

impl<T: Real> Task for ToPlanes<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (shape, lanes) = (self.shape, T::LANES);
        for first in (0..shape.samples).step_by(lanes) {
            let rows = lanes.min(shape.samples - first);
            let group = self.planes.group_mut(first / lanes);
            for p in 0..shape.panels {
                let panel = &self.layer[shape.at::<T>(p, self.component, first)..];
                let mut square = [T::Vec::<I>::of(0.0); 16];
                for (s, row) in square.iter_mut().enumerate().take(rows) {
                    *row = vector(panel, s);
                }
                let square = transpose(square);
                let units = lanes.min(self.width - p * lanes);
                for (u, &x) in square.iter().enumerate().take(units) {
                    set_vector(group, self.first + p * lanes + u, x);
                }
            }
        }
    }
}

/// Copies values of planes to the units of one component of a layer: value `first` + u becomes unit u, and the padding of
/// the last panel 0.
pub(crate) struct FromPlanes<'a, T> {
    pub shape: Shape,
    pub component: usize,
    pub width: usize,
    pub layer: &'a mut [T],
    pub first: usize,
    pub planes: &'a Planes<T>,
}

impl<T: Real> Task for FromPlanes<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let (shape, lanes) = (self.shape, T::LANES);
        for first in (0..shape.samples).step_by(lanes) {
            let rows = lanes.min(shape.samples - first);
            let group = self.planes.group(first / lanes);
            for p in 0..shape.panels {
                let mut square = [T::Vec::<I>::of(0.0); 16];
                let units = lanes.min(self.width - p * lanes);
                for (u, x) in square.iter_mut().enumerate().take(units) {
                    *x = vector(group, self.first + p * lanes + u);
                }
                let square = transpose(square);
                let panel = &mut self.layer[shape.at::<T>(p, self.component, first)..];
                for (s, &row) in square.iter().enumerate().take(rows) {
                    set_vector(panel, s, row);
                }
            }
        }
    }
}
