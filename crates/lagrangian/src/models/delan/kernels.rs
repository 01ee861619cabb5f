//! What a [`Block`](super::Block) does to a vector of samples at a time, between the passes through the network.

use super::Factor;
use nets::simd::{Isa, LARGEST_ANGLE, Planes, Real, Task, Vector, set_vector, sin_cos, vector};

/// How the features of one coordinate follow from it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Chart {
    /// cos q and sin q.
    Circle,
    /// (q − centre) / scale.
    Line { centre: f64, scale: f64 },
}

/// Features with their slopes over the coordinates, which are `[n]` in double precision.
pub(super) struct Features<'a, T> {
    pub(super) samples: usize,
    pub(super) charts: &'a [Chart],
    pub(super) q: &'a Planes<f64>,
    pub(super) values: &'a mut Planes<T>,
    pub(super) slopes: &'a mut Planes<T>,
}

impl<T: Real> Task for Features<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for first in (0..self.samples).step_by(8) {
            let q = self.q.group(first / 8);
            let mut at = 0;
            for (i, &chart) in self.charts.iter().enumerate() {
                let q: I::F64 = vector(q, i);
                match chart {
                    Chart::Circle => {
                        let (sin, cos) = circle(q);
                        self.values.set_eight(at, first, cos);
                        self.values.set_eight(at + 1, first, sin);
                        let minus = I::F64::of(0.0).sub(sin);
                        self.slopes.set_eight(at, first, minus);
                        self.slopes.set_eight(at + 1, first, cos);
                        at += 2;
                    }
                    Chart::Line { centre, scale } => {
                        let x = q.sub(I::F64::of(centre)).div(I::F64::of(scale));
                        self.values.set_eight(at, first, x);
                        self.slopes.set_eight(at, first, I::F64::of(1.0 / scale));
                        at += 1;
                    }
                }
            }
        }
    }
}

/// (sin q, cos q); one by one where a lane is beyond the reduction of vectors.
#[inline(always)]
fn circle<V: Vector<Elem = f64>>(q: V) -> (V, V) {
    let mut lanes = [0.0; 8];
    q.store(&mut lanes);
    if lanes.iter().all(|q| q.abs() <= LARGEST_ANGLE) {
        return sin_cos(q);
    }
    let pairs = lanes.map(f64::sin_cos);
    (V::load(&pairs.map(|x| x.0)), V::load(&pairs.map(|x| x.1)))
}

/// The tangent of the features along a direction in q, and the slope over q from the gradient by the features.
pub(super) struct Tangent<'a, T> {
    pub(super) groups: usize,
    /// The coordinate of each feature.
    pub(super) coordinates: &'a [usize],
    pub(super) slopes: &'a Planes<T>,
    pub(super) direction: &'a Planes<T>,
    pub(super) tangent: &'a mut Planes<T>,
}

impl<T: Real> Task for Tangent<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for g in 0..self.groups {
            let (slopes, direction) = (self.slopes.group(g), self.direction.group(g));
            let tangent = self.tangent.group_mut(g);
            for (f, &i) in self.coordinates.iter().enumerate() {
                let slope: T::Vec<I> = vector(slopes, f);
                set_vector(tangent, f, slope.mul(vector(direction, i)));
            }
        }
    }
}

/// ∂(L/E)/∂q `[n]` from the gradient by the features.
pub(super) struct Slope<'a, T> {
    pub(super) groups: usize,
    pub(super) coordinates: &'a [usize],
    pub(super) slopes: &'a Planes<T>,
    pub(super) gradient: &'a Planes<T>,
    pub(super) slope: &'a mut Planes<T>,
}

impl<T: Real> Task for Slope<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for g in 0..self.groups {
            let (slopes, gradient) = (self.slopes.group(g), self.gradient.group(g));
            let to = self.slope.group_mut(g);
            to.fill(T::default());
            for (f, &i) in self.coordinates.iter().enumerate() {
                let slope: T::Vec<I> = vector(slopes, f);
                let sum = slope.fma(vector(gradient, f), vector(to, i));
                set_vector(to, i, sum);
            }
        }
    }
}

/// [`Factor::read`] and [`Factor::seeds`].
pub(super) struct Read<'a, T> {
    pub(super) factors: &'a mut [Factor<T>],
    /// Outputs and their change along q̇.
    pub(super) outputs: [&'a Planes<T>; 2],
    pub(super) v: &'a Planes<T>,
    pub(super) seeds: &'a mut Planes<T>,
}

impl<T: Real> Task for Read<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let outputs = self.outputs.map(|planes| planes.group(g));
            let v = self.v.group(g);
            factor.read::<T::Vec<I>>(|c, o| vector(outputs[c], o), |i| vector(v, i));
            factor.seeds::<T::Vec<I>>(self.seeds.group_mut(g));
        }
    }
}

/// [`Factor::accelerate`].
pub(super) struct Accelerate<'a, T> {
    pub(super) factors: &'a mut [Factor<T>],
    pub(super) a: &'a Planes<T>,
}

impl<T: Real> Task for Accelerate<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let a = self.a.group(g);
            factor.accelerate::<T::Vec<I>>(|i| vector(a, i));
        }
    }
}

/// π′/s − ∂(L/E)/∂q `[n]` (theory.md, equation 30).
pub(super) struct Balance<'a, T> {
    pub(super) factors: &'a [Factor<T>],
    /// 1/s.
    pub(super) units: &'a [f64],
    pub(super) slope: &'a Planes<T>,
    pub(super) left: &'a mut Planes<T>,
}

impl<T: Real> Task for Balance<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for (g, factor) in self.factors.iter().enumerate() {
            let (slope, left) = (self.slope.group(g), self.left.group_mut(g));
            for (i, &unit) in self.units.iter().enumerate() {
                let rate: T::Vec<I> = factor.momentum_rate(i);
                let scaled = rate.mul(T::Vec::<I>::of(unit));
                set_vector(left, i, scaled.sub(vector(slope, i)));
            }
        }
    }
}

/// G Gᵀ, row by row up to the diagonal.
pub(super) struct Masses<'a, T> {
    pub(super) n: usize,
    pub(super) factors: &'a [Factor<T>],
    pub(super) masses: &'a mut Planes<T>,
}

impl<T: Real> Task for Masses<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for (g, factor) in self.factors.iter().enumerate() {
            let masses = self.masses.group_mut(g);
            for i in 0..self.n {
                for j in 0..=i {
                    set_vector::<T::Vec<I>>(masses, i * (i + 1) / 2 + j, factor.mass(i, j));
                }
            }
        }
    }
}

/// [`Factor::sensitivities`].
pub(super) struct Sensitivities<'a, T> {
    pub(super) factors: &'a mut [Factor<T>],
    pub(super) beta: &'a Planes<T>,
    pub(super) hat: &'a Planes<T>,
    pub(super) to_rate: &'a mut Planes<T>,
    pub(super) to_value: &'a mut Planes<T>,
}

impl<T: Real> Task for Sensitivities<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let (beta, hat) = (self.beta.group(g), self.hat.group(g));
            let (rate, value) = (self.to_rate.group_mut(g), self.to_value.group_mut(g));
            factor.sensitivities::<T::Vec<I>>(beta, |o| vector(hat, o), rate, value);
        }
    }
}
