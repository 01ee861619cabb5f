//! The factors of the states of a block, one state at a time.

use super::{DelanShape, Factor};
use nets::simd::Real;
use nets::{Packed, Pass};

/// The factors of a block, and the seeds of its reverse passes.
#[derive(Debug, Default)]
pub(crate) struct Factors {
    /// The factor of each sample.
    pub(crate) each: Vec<Factor>,
    /// ∂(L/E)/∂o of each sample, `[samples, outputs]`.
    seeds: Vec<f64>,
}

/// The part of the outputs of a pass that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outputs {
    /// Their values alone; they do not change.
    Values,
    /// Their values and their change along ′.
    Moving,
}

impl Factors {
    /// Reads the factors of all samples of a pass at the scaled velocities `v(s, i)`, and carries their seeds back to the
    /// features.
    pub(crate) fn read<T: Real>(
        &mut self,
        shape: &DelanShape,
        packed: &Packed<T>,
        pass: &mut Pass<T>,
        outputs: Outputs,
        v: impl Fn(usize, usize) -> f64,
    ) {
        self.read_weighted(shape, packed, pass, (outputs, v, |_| 1.0));
    }

    /// Reads the factors and carries back their seeds, those of sample s times `weight(s)`.
    pub(crate) fn read_weighted<T: Real>(
        &mut self,
        shape: &DelanShape,
        packed: &Packed<T>,
        pass: &mut Pass<T>,
        (outputs, v, weight): (Outputs, impl Fn(usize, usize) -> f64, impl Fn(usize) -> f64),
    ) {
        let (net, width, samples) = (&shape.net, shape.factor_outputs(), pass.samples());
        if self.each.len() < samples {
            self.each.resize(samples, shape.factor());
            self.seeds.resize(samples * width, 0.0);
        }
        let rows = self.seeds.chunks_exact_mut(width);
        for (s, (factor, seeds)) in self.each.iter_mut().zip(rows).enumerate().take(samples) {
            let output = |c: usize, o: usize| match c == 1 && outputs == Outputs::Values {
                true => 0.0,
                false => pass.output(net, c, s, o).f64(),
            };
            factor.read(output, |i| v(s, i));
            factor.seeds::<f64>(seeds);
        }
        let seeds = &self.seeds;
        pass.reverse_sum(net, packed, |s, o| T::of(weight(s) * seeds[s * width + o]));
    }
}
