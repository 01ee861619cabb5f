//! What models learn from: chunks of motions of a known system, as each family reads them.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::Task;
use crate::chart::Chart;
use crate::data::{Chunks, column_sizes, with_accelerations, with_estimated_accelerations};
use lagrangian::analytic::{Rng, normal};
use lagrangian::trajectory::Signal;
use lagrangian::{Dataset, Model, Result, Signals, Trajectory};

/// How many chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Size {
    /// To learn from.
    pub(crate) train: usize,
    /// To choose the weights by.
    pub(crate) held: usize,
    /// To test on.
    pub(crate) test: usize,
}

/// What a family reads of the chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reads {
    /// States of free motion with accelerations (and momenta).
    Motions,
    /// States alone: the accelerations, which data must have for their scales, are estimated from them.
    States,
    /// Positions alone.
    Positions,
    /// States under random torques, with accelerations.
    Torques,
}

/// A known system and chunks of its motions, in the coordinates of its chart.
pub(crate) struct Lesson {
    /// What it is of.
    pub(crate) task: Task,
    /// The system in its chart.
    pub(crate) truth: Box<dyn Model>,
    /// The chart.
    pub(crate) chart: Chart,
    /// The same system in its own coordinates.
    pub(crate) system: Box<dyn Model>,
    /// Chunks to learn from, with accelerations and momenta.
    pub(crate) chunks: Chunks,
    /// Chunks to test on.
    pub(crate) test: Vec<Trajectory>,
    /// Time between two samples, s.
    pub(crate) interval: f64,
    /// Noise on what is learned from, see [`Lesson::noisy`].
    pub(crate) noise: f64,
}

impl Lesson {
    /// The data to fit without the `hidden` signals, as a family reads them.
    pub(crate) fn data(&self, hidden: &[Signal], reads: Reads, seed: u64) -> Result<Dataset> {
        let mut chunks = match reads {
            Reads::Torques => self.under_torques(seed),
            _ => self.chunks.clone(),
        };
        if self.noise > 0.0 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(2);
            self.disturb(&mut chunks.train, &mut rng);
            self.disturb(&mut chunks.held, &mut rng);
        }
        for motion in chunks.iter_mut() {
            hidden.iter().for_each(|s| motion.get_mut(*s).clear());
        }
        let coordinates = self.truth.coordinates().clone();
        let Chunks { train, held } = &chunks;
        match reads {
            Reads::Positions => Dataset::of_positions(coordinates, train, held, 1),
            Reads::States => {
                let estimated = match self.noise > 0.0 {
                    true => with_mean_accelerations,
                    false => with_estimated_accelerations,
                };
                Dataset::new(coordinates, &estimated(train), &estimated(held))
            }
            Reads::Motions | Reads::Torques => Dataset::new(coordinates, train, held),
        }
    }

    /// The same lesson with noise on all that is learned from but torques: `share` of a radian on angles, of the root mean
    /// square on lines, velocities, accelerations, momenta and their rates. Test data have none.
    pub(crate) fn noisy(self, share: f64) -> Self {
        Self {
            noise: share,
            ..self
        }
    }

    /// Adds the noise, the same for the same seed.
    fn disturb(&self, motions: &mut [Trajectory], rng: &mut dyn Rng) {
        let coordinates = self.truth.coordinates();
        let n = coordinates.dof();
        let mut q = column_sizes(n, motions.iter().map(|m| &m.q[..]));
        for (i, size) in q.iter_mut().enumerate() {
            if coordinates.is_circle(i) {
                *size = 1.0;
            }
        }
        let qd = column_sizes(n, motions.iter().map(|m| &m.qd[..]));
        let others = [Signal::Qdd, Signal::P, Signal::Pd];
        let size_of = |signal| column_sizes(n, motions.iter().filter_map(|m| m.values(signal)));
        let others = others.map(|signal| (signal, size_of(signal)));
        let mut add = |x: &mut [f64], size: &[f64]| {
            let places = x.iter_mut().enumerate();
            places.for_each(|(k, x)| *x += self.noise * size[k % n] * normal(rng));
        };
        for motion in motions {
            add(&mut motion.q, &q);
            add(&mut motion.qd, &qd);
            for (signal, size) in &others {
                add(motion.get_mut(*signal), size);
            }
        }
    }

    /// The same states under random torques of the size of the accelerations, N·m, with the accelerations that follow;
    /// these chunks are no motions any more.
    fn under_torques(&self, seed: u64) -> Chunks {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(3);
        let mut evaluator = self.truth.evaluator();
        let mut chunks = self.chunks.clone();
        for motion in chunks.iter_mut() {
            let size = motion.qdd.iter().fold(0.0, |m: f64, a| m.max(a.abs()));
            let tau: Vec<f64> = motion.q.iter().map(|_| size * normal(&mut rng)).collect();
            let Signals { q, qd, qdd, .. } = &mut motion.signals;
            let _ = evaluator.forward_dynamics(q, qd, &tau, qdd);
            (motion.tau, motion.pd) = (tau, Vec::new());
        }
        chunks
    }
}

/// The same motions, each with the slope of the line through its velocities as its acceleration: the polynomial through all
/// states of a piece would follow the noise.
fn with_mean_accelerations(motions: &[Trajectory]) -> Vec<Trajectory> {
    let slopes = |motion: &Trajectory| {
        let (n, len) = (motion.dof().max(1), motion.len().max(1) as f64);
        let mean = motion.t.iter().sum::<f64>() / len;
        let spread: f64 = motion.t.iter().map(|t| (t - mean).powi(2)).sum();
        let mut slope = vec![0.0; n];
        for (t, row) in motion.t.iter().zip(motion.qd.chunks_exact(n)) {
            let sums = slope.iter_mut().zip(row);
            sums.for_each(|(slope, v)| *slope += (t - mean) * v / spread);
        }
        slope.repeat(motion.len())
    };
    let estimated = |motion: &Trajectory| with_accelerations(motion, slopes(motion));
    motions.iter().map(estimated).collect()
}
