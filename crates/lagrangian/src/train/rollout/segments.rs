//! The starts of segments, and the units of their errors.

use super::config::{Observe, RolloutLoss, Start};
use crate::dataset::{Dataset, Momenta, Timeline};
use lagrangian_motion::Coordinates;
use lagrangian_motion::Samples;

/// The recorded motion that segments are cut from.
#[derive(Clone, Copy)]
pub(crate) struct Recorded<'a> {
    pub(crate) coordinates: &'a Coordinates,
    pub(crate) samples: &'a Samples,
    pub(crate) times: &'a Timeline,
    /// The source of the momenta, where states are (q, p).
    pub(super) momenta: Option<&'a Momenta>,
}

impl<'a> Recorded<'a> {
    pub(crate) fn train(dataset: &'a Dataset, momenta: Option<&'a Momenta>) -> Self {
        Self::of(dataset, momenta, (&dataset.train, &dataset.train_times))
    }

    /// The samples that models are compared on.
    pub(crate) fn compared(dataset: &'a Dataset) -> Self {
        match dataset.validation.is_empty() {
            true => Self::train(dataset, None),
            false => Self::validation(dataset, None),
        }
    }

    pub(super) fn validation(dataset: &'a Dataset, momenta: Option<&'a Momenta>) -> Self {
        let held = (&dataset.validation, &dataset.validation_times);
        Self::of(dataset, momenta, held)
    }

    fn of(
        dataset: &'a Dataset,
        momenta: Option<&'a Momenta>,
        (samples, times): (&'a Samples, &'a Timeline),
    ) -> Self {
        Self {
            coordinates: &dataset.coordinates,
            samples,
            times,
            momenta,
        }
    }

    /// The samples that start segments of `horizon` samples, `stride` apart within each trajectory.
    pub(super) fn starts(&self, horizon: usize, stride: usize) -> Vec<usize> {
        let runs = self.times.runs();
        let of_run = |run: std::ops::Range<usize>| {
            let end = run.end.saturating_sub(horizon);
            (run.start..end).step_by(stride.max(1))
        };
        runs.flat_map(of_run).collect()
    }

    /// Component `c` of the recorded state at sample `i`.
    pub(crate) fn state(&self, i: usize, c: usize) -> f64 {
        let (n, samples) = (self.samples.n, self.samples);
        if c < n {
            return samples.q[i * n + c];
        }
        let at = i * n + c - n;
        match self.momenta {
            Some(Momenta::Recorded) => samples.p[at],
            Some(Momenta::Masses(masses)) => masses[c - n] * samples.qd[at],
            Some(Momenta::Velocities) | None => samples.qd[at],
        }
    }

    /// The measured value of component `c` at sample `i`, where the state there is smoothed.
    pub(crate) fn measured(&self, i: usize, c: usize) -> f64 {
        let n = self.samples.n;
        let all = &self.times.measured[c / n];
        let measured = all.get(i * n + c % n);
        measured.map_or_else(|| self.state(i, c), |value| *value)
    }

    /// a − b of component `c`, angles on the circle.
    pub(crate) fn difference(&self, c: usize, a: f64, b: f64) -> f64 {
        use std::f64::consts::{PI, TAU};
        let difference = a - b;
        if c < self.samples.n && self.coordinates.is_circle(c) && difference.is_finite() {
            (difference + PI).rem_euclid(TAU) - PI
        } else {
            difference
        }
    }

    /// Weights of the components of a state, `[2n]`: one over the deviation of each (of an angle at most that of a
    /// uniform one), and over the distance that a state moves within the horizon in these units, so that a loss of 1 is that of a
    /// system at rest.
    pub(super) fn weights(&self, horizon: usize) -> Vec<f64> {
        let d = 2 * self.samples.n;
        let mut weights: Vec<f64> = (0..d).map(|c| 1.0 / self.deviation(c)).collect();
        let (mut sum, mut count) = (0.0, 0.0);
        for i in self.starts(horizon, horizon.div_ceil(4)) {
            for (c, weight) in weights.iter().enumerate() {
                for j in 1..=horizon {
                    let moved = self.difference(c, self.state(i + j, c), self.state(i, c));
                    sum += (weight * moved).powi(2);
                    count += 1.0;
                }
            }
        }
        let moved = (sum / f64::max(count, 1.0)).sqrt();
        let moved = if moved > 1e-6 { moved } else { 1.0 };
        weights.iter_mut().for_each(|w| *w /= moved);
        weights
    }

    pub(crate) fn deviation(&self, c: usize) -> f64 {
        let m = self.samples.len().max(1) as f64;
        let values = || (0..self.samples.len()).map(|i| self.state(i, c));
        let mean = values().sum::<f64>() / m;
        let squares = values().map(|x| (x - mean).powi(2)).sum::<f64>();
        let mut deviation = (squares / m).sqrt();
        if c < self.samples.n && self.coordinates.is_circle(c) {
            deviation = deviation.min(std::f64::consts::PI / 3f64.sqrt());
        }
        if deviation > 1e-150 { deviation } else { 1.0 }
    }
}

/// The residuals of a segment in the order of time.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    pub(super) horizon: usize,
    /// The number of components that are compared at each sample: n or 2n.
    pub(super) seen: usize,
    /// Whether the start is compared with the recording too.
    pub(super) start: bool,
}

impl Rows {
    pub(super) fn new(config: &RolloutLoss, horizon: usize, n: usize) -> Self {
        Self {
            horizon,
            seen: match config.observe {
                Observe::States => 2 * n,
                Observe::Positions => n,
            },
            start: config.start == Start::Free,
        }
    }

    /// The number of residuals of a segment.
    pub(super) fn count(&self) -> usize {
        self.first(self.horizon + 1)
    }

    /// The first residual of sample `j` of a segment, j = 0…horizon; their number for j = horizon + 1.
    pub(super) fn first(&self, j: usize) -> usize {
        match (self.start, j) {
            (_, 0) => 0,
            (true, j) => j * self.seen,
            (false, j) => (j - 1) * self.seen,
        }
    }
}
