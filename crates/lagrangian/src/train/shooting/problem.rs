//! The recordings as segments, and their residuals.

use rayon::prelude::*;

use super::normal::{Reduced, eliminate};
use super::path::{At, Path, Wanted};
use crate::dataset::{Dataset, Momenta};
use crate::train::learner::Learner;
use crate::train::rollout::Recorded;
use lagrangian_motion::solve::dot;

/// Segments that are followed at once.
pub(super) const BLOCK: usize = 4;

/// A stretch of a recording that one rollout follows.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// The first sample.
    pub(super) begin: usize,
    pub(super) samples: usize,
    /// The state at the first sample, `[2n]`.
    pub(super) start: Vec<f64>,
}

/// What is refined, and on what.
pub(crate) struct Problem<'a> {
    pub(super) learner: &'a dyn Learner<f64>,
    pub(super) recorded: Recorded<'a>,
    /// The noise of the components of a state that are compared, `[n]` or `[2n]`.
    pub(super) noise: &'a [f64],
    /// The deviation of each component of a state, `[2n]`.
    deviations: Vec<f64>,
    amplification: f64,
    substeps: usize,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        learner: &'a dyn Learner<f64>,
        (dataset, momenta): (&'a Dataset, Option<&'a Momenta>),
        noise: &'a [f64],
        config: &super::Shooting,
    ) -> Self {
        let recorded = Recorded::train(dataset, momenta);
        Self {
            deviations: (0..2 * learner.dof())
                .map(|c| recorded.deviation(c))
                .collect(),
            learner,
            recorded,
            noise,
            amplification: config.amplification,
            substeps: config.substeps,
        }
    }

    /// The length d of a state.
    pub(super) fn state(&self) -> usize {
        2 * self.learner.dof()
    }

    pub(super) fn at(&self, theta: &[f64]) -> At<'_> {
        At::new(self.learner, self.recorded, theta, self.substeps)
    }

    /// The numbers of residuals and of components of starts.
    pub(super) fn counts(&self, segments: &[Segment]) -> (usize, usize) {
        let samples: usize = segments.iter().map(|s| s.samples).sum();
        (samples * self.noise.len(), segments.len() * self.state())
    }

    /// The recorded states, `[samples, d]`.
    pub(super) fn recorded_states(&self) -> Vec<f64> {
        let (d, samples) = (self.state(), self.recorded.samples.len());
        (0..samples * d)
            .map(|at| self.recorded.state(at / d, at % d))
            .collect()
    }

    /// Segments of about `horizon` samples that start at these states, halved while a state depends too much on the start.
    pub(super) fn segments(&self, theta: &[f64], horizon: usize, states: &[f64]) -> Vec<Segment> {
        let (d, at) = (self.state(), self.at(theta));
        let segment = |begin: usize, end: usize| Segment {
            begin,
            samples: end - begin,
            start: states[begin * d..][..d].to_vec(),
        };
        let runs = self.recorded.times.runs().filter(|run| run.len() > 1);
        let mut segments: Vec<Segment> = runs
            .flat_map(|run| {
                let parts = ((run.len() + horizon / 2) / horizon).max(1);
                let cut = move |k: usize| run.start + run.len() * k / parts;
                (0..parts)
                    .map(move |k| segment(cut(k), cut(k + 1)))
                    .collect::<Vec<_>>()
            })
            .collect();
        loop {
            let blocks = segments.par_chunks(BLOCK);
            let chaotic: Vec<bool> = blocks
                .flat_map_iter(|block| self.chaotic(&at, block))
                .collect();
            let halves = |(s, chaotic): (&Segment, &bool)| {
                let (middle, end) = (s.begin + s.samples / 2, s.begin + s.samples);
                match *chaotic && s.samples >= 8 {
                    true => vec![segment(s.begin, middle), segment(middle, end)],
                    false => vec![s.clone()],
                }
            };
            let halved: Vec<Segment> = segments.iter().zip(&chaotic).flat_map(halves).collect();
            if halved.len() == segments.len() {
                return segments;
            }
            segments = halved;
        }
    }

    /// Whether a state of each segment depends on its start by more than the bound.
    fn chaotic(&self, at: &At<'_>, block: &[Segment]) -> Vec<bool> {
        let (d, bound, unit) = (self.state(), self.amplification, &self.deviations);
        let path = Path::of(at, block, Wanted::Starts(d));
        let each = path.slopes.iter().zip(&path.failed);
        let exceeds = |slopes: &[f64]| {
            let entries = slopes.iter().enumerate();
            entries.into_iter().any(|(at, x)| {
                let (to, from) = (at / d % d, at % d);
                !((x * unit[from] / unit[to]).abs() <= bound)
            })
        };
        each.map(|(slopes, failed)| *failed || exceeds(slopes))
            .collect()
    }

    /// The residuals of a segment along these states.
    fn residuals(&self, segment: &Segment, states: &[f64]) -> Vec<f64> {
        let (d, noise) = (self.state(), self.noise);
        let of_sample = |(j, x): (usize, &[f64])| -> Vec<f64> {
            let seen = |c: usize| self.recorded.state(segment.begin + j, c);
            let error = |c: usize| self.recorded.difference(c, x[c], seen(c));
            noise
                .iter()
                .enumerate()
                .map(|(c, sigma)| error(c) / sigma)
                .collect()
        };
        states
            .chunks_exact(d)
            .enumerate()
            .flat_map(of_sample)
            .collect()
    }

    /// χ² of each segment, ∞ where its rollout fails.
    fn values(&self, theta: &[f64], segments: &[Segment]) -> Vec<f64> {
        let at = self.at(theta);
        let of_block = |block: &[Segment]| -> Vec<f64> {
            let path = Path::of(&at, block, Wanted::States);
            let each = block.iter().zip(&path.states).zip(&path.failed);
            let value = |((segment, states), failed): ((&Segment, &Vec<f64>), &bool)| {
                let r = self.residuals(segment, states);
                let value = dot(&r, &r);
                if *failed || value.is_nan() {
                    f64::INFINITY
                } else {
                    value
                }
            };
            each.map(value).collect()
        };
        segments.par_chunks(BLOCK).flat_map_iter(of_block).collect()
    }

    /// One step of each start alone, where it helps; returns χ².
    pub(super) fn improve_starts(&self, theta: &[f64], segments: &mut [Segment]) -> f64 {
        let at = self.at(theta);
        let of_block = |block: &[Segment]| -> Vec<(Segment, f64)> {
            match self.reduced(&at, block, false) {
                Some(reduced) => {
                    let each = block.iter().zip(&reduced);
                    each.map(|(s, r)| (r.start.of(s, &[]), r.value())).collect()
                }
                None => block.iter().map(|s| (s.clone(), f64::INFINITY)).collect(),
            }
        };
        let blocks = segments.par_chunks(BLOCK);
        let (moved, before): (Vec<_>, Vec<_>) = blocks.flat_map_iter(of_block).unzip();
        let after = self.values(theta, &moved);
        let each = segments
            .iter_mut()
            .zip(moved)
            .zip(before.iter().zip(&after));
        each.filter(|(_, (before, after))| after < before)
            .for_each(|((segment, moved), _)| *segment = moved);
        before.iter().zip(&after).map(|(b, a)| b.min(*a)).sum()
    }

    /// Segments without their starts, linearised in the parameters where these are to change.
    pub(super) fn reduced(
        &self,
        at: &At<'_>,
        block: &[Segment],
        parameters: bool,
    ) -> Option<Vec<Reduced>> {
        let (d, seen) = (self.state(), self.noise.len());
        let count = if parameters {
            self.learner.parameters()
        } else {
            0
        };
        let wanted = if parameters {
            Wanted::All(seen)
        } else {
            Wanted::Starts(seen)
        };
        let path = Path::of(at, block, wanted);
        if path.failed.contains(&true) {
            return None;
        }
        let each = block.iter().zip(&path.states).zip(path.slopes);
        let reduced = each.map(|((segment, states), mut rows)| {
            let scaled = rows
                .chunks_exact_mut(count + d)
                .zip(self.noise.iter().cycle());
            scaled.for_each(|(row, sigma)| row.iter_mut().for_each(|x| *x /= sigma));
            eliminate(rows, self.residuals(segment, states), count, d)
        });
        Some(reduced.collect())
    }

    /// Writes the states along the segments to `states`, `[samples, d]`.
    pub(super) fn write_states(&self, theta: &[f64], segments: &[Segment], states: &mut [f64]) {
        let at = self.at(theta);
        for block in segments.chunks(BLOCK) {
            let path = Path::of(&at, block, Wanted::States);
            for (segment, x) in block.iter().zip(&path.states) {
                states[segment.begin * self.state()..][..x.len()].copy_from_slice(x);
            }
        }
    }
}
