//! The operations on the vectors of samples of a [`Block`], between the passes through the network.

use super::{Balance, Block, Features};
use nets::simd::{
    Arithmetic, Isa, LARGEST_ANGLE, Memory, Real, Task, Vector, set_vector, sin_cos, vector,
};

/// The features of one coordinate.
#[derive(Debug, Clone, Copy)]
pub(super) enum Chart {
    /// cos q and sin q.
    Circle,
    /// (q − centre) / scale.
    Line { centre: f64, scale: f64 },
}

/// A step of the algebra on every vector of samples.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    /// Computes the features of q and their slopes.
    Features,
    /// Computes the tangent of the features along the direction in q.
    Tangent,
    /// Computes ∂(L/E)/∂q from the gradient by the features.
    Slope,
    /// Reads the factor from the outputs and their change along q̇, and computes the seeds.
    Read,
    /// Sets the acceleration of the factor.
    Accelerate,
    /// Computes π′/s − ∂(L/E)/∂q (theory.md, equation 30).
    Balance,
    /// Computes G Gᵀ, row by row up to the diagonal.
    Masses,
    /// Computes the sensitivities to the outputs and to their change along q̇.
    Sensitivities,
}

/// Runs a step of a block.
pub(super) struct Run<'a, T: Real> {
    pub(super) block: &'a mut Block<T>,
    pub(super) step: Step,
}

impl<T: Real> Task for Run<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self { block, step } = self;
        match step {
            Step::Features => block.features::<I>(),
            Step::Tangent => block.tangent::<I>(),
            Step::Slope => block.slope::<I>(),
            Step::Read => block.read::<I>(),
            Step::Accelerate => block.set_acceleration::<I>(),
            Step::Balance => block.take_balance::<I>(),
            Step::Masses => block.take_masses::<I>(),
            Step::Sensitivities => block.sensitivities::<I>(),
        }
    }
}

impl<T: Real> Block<T> {
    #[inline(always)]
    fn features<I: Isa>(&mut self) {
        let Features {
            charts,
            values,
            slopes,
            ..
        } = &mut self.features;
        for first in (0..self.samples).step_by(8) {
            let q = self.motion.q.group(first / 8);
            let mut at = 0;
            for (i, &chart) in charts.iter().enumerate() {
                let q: I::F64 = vector(q, i);
                match chart {
                    Chart::Circle => {
                        let (sin, cos) = circle(q);
                        values.set_eight(at, first, cos);
                        values.set_eight(at + 1, first, sin);
                        let minus = I::F64::of(0.0).sub(sin);
                        slopes.set_eight(at, first, minus);
                        slopes.set_eight(at + 1, first, cos);
                        at += 2;
                    }
                    Chart::Line { centre, scale } => {
                        let x = q.sub(I::F64::of(centre)).div(I::F64::of(scale));
                        values.set_eight(at, first, x);
                        slopes.set_eight(at, first, I::F64::of(1.0 / scale));
                        at += 1;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn tangent<I: Isa>(&mut self) {
        let features = &mut self.features;
        for g in 0..self.factors.len() {
            let (slopes, direction) = (features.slopes.group(g), self.motion.direction.group(g));
            let tangent = features.tangent.group_mut(g);
            for (f, &i) in features.coordinates.iter().enumerate() {
                let slope: T::Vec<I> = vector(slopes, f);
                set_vector(tangent, f, slope.mul(vector(direction, i)));
            }
        }
    }

    #[inline(always)]
    fn slope<I: Isa>(&mut self) {
        let features = &self.features;
        for g in 0..self.factors.len() {
            let (slopes, gradient) = (features.slopes.group(g), features.tangent.group(g));
            let to = self.balance.slope.group_mut(g);
            to.fill(T::default());
            for (f, &i) in features.coordinates.iter().enumerate() {
                let slope: T::Vec<I> = vector(slopes, f);
                let sum = slope.fma(vector(gradient, f), vector(to, i));
                set_vector(to, i, sum);
            }
        }
    }

    #[inline(always)]
    fn read<I: Isa>(&mut self) {
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let outputs = [self.outputs[0].group(g), self.outputs[1].group(g)];
            let v = self.motion.v.group(g);
            factor.read::<T::Vec<I>>(|c, o| vector(outputs[c], o), |i| vector(v, i));
            factor.seeds::<T::Vec<I>>(self.seeds[0].group_mut(g));
        }
    }

    #[inline(always)]
    fn set_acceleration<I: Isa>(&mut self) {
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let a = self.motion.a.group(g);
            factor.accelerate::<T::Vec<I>>(|i| vector(a, i));
        }
    }

    #[inline(always)]
    fn take_balance<I: Isa>(&mut self) {
        let Balance { slope, left, .. } = &mut self.balance;
        for (g, factor) in self.factors.iter().enumerate() {
            let (slope, left) = (slope.group(g), left.group_mut(g));
            for (i, &unit) in self.units.iter().enumerate() {
                let rate: T::Vec<I> = factor.momentum_rate(i);
                let scaled = rate.mul(T::Vec::<I>::of(unit));
                set_vector(left, i, scaled.sub(vector(slope, i)));
            }
        }
    }

    #[inline(always)]
    fn take_masses<I: Isa>(&mut self) {
        for (g, factor) in self.factors.iter().enumerate() {
            let masses = self.balance.masses.group_mut(g);
            for i in 0..self.units.len() {
                for j in 0..=i {
                    set_vector::<T::Vec<I>>(masses, i * (i + 1) / 2 + j, factor.mass(i, j));
                }
            }
        }
    }

    #[inline(always)]
    fn sensitivities<I: Isa>(&mut self) {
        let [to_rate, to_value] = &mut self.seeds;
        for (g, factor) in self.factors.iter_mut().enumerate() {
            let (beta, hat) = (self.motion.beta.group(g), self.outputs[0].group(g));
            let (rate, value) = (to_rate.group_mut(g), to_value.group_mut(g));
            factor.sensitivities::<T::Vec<I>>(beta, |o| vector(hat, o), rate, value);
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
