//! The recordings of a survey, divided into those for fitting, validation and testing.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::errors::pieces;
use super::field::{FieldScale, States, accelerations};
use lagrangian::analytic::normal;
use lagrangian::{Coordinates, Dataset, Error, Model, Result, Trajectory, split};

/// Fractions of the recordings that are held out of all fits, and that validate the weights.
const HELD_OUT: f64 = 0.25;
const VALIDATION: f64 = 0.15;
/// Minimum number of samples that can be divided into three parts.
const FEWEST_SAMPLES: usize = 100;

pub(super) struct Parts {
    pub(super) dataset: Dataset,
    train: Vec<Trajectory>,
    pub(super) validation: Vec<Trajectory>,
    /// Held-out recordings in pieces.
    pub(super) test: Vec<Trajectory>,
    /// Number of held-out recordings.
    pub(super) recordings: usize,
}

impl Parts {
    pub(super) fn new(
        coordinates: &Coordinates,
        recordings: &[Trajectory],
        seed: u64,
    ) -> Result<Self> {
        let found: usize = recordings.iter().map(Trajectory::len).sum();
        if found < FEWEST_SAMPLES {
            let what = "the whole of the recordings";
            return Err(Error::too_short(what, found, FEWEST_SAMPLES));
        }
        let (rest, test) = split(recordings.to_vec(), HELD_OUT, seed)?;
        let (train, validation) = split(rest, VALIDATION, seed)?;
        let dataset = Dataset::new(coordinates.clone(), &train, &validation)?;
        // Constructed only for its errors, those of recordings that cannot be used.
        Dataset::new(coordinates.clone(), &test, &[])?;
        Ok(Self {
            dataset,
            train,
            validation,
            recordings: test.len(),
            test: pieces(&test),
        })
    }

    /// Training data with pieces drawn with replacement, in equal number (Efron 1979).
    pub(super) fn drawn(&self, seed: u64) -> Result<Dataset> {
        let (mut rng, from) = (ChaCha8Rng::seed_from_u64(seed), pieces(&self.train));
        let one = |_| from[rng.random_range(0..from.len())].clone();
        let drawn: Vec<Trajectory> = (0..from.len()).map(one).collect();
        Dataset::new(self.dataset.coordinates.clone(), &drawn, &self.validation)
    }

    /// Training data that follow `model`: its accelerations at the same states, with noise of the size `noise`, `[n]`,
    /// that no fit explains.
    pub(super) fn imitated(&self, model: &dyn Model, noise: &[f64], seed: u64) -> Dataset {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut made = self.dataset.clone();
        let mut evaluator = model.evaluator();
        for samples in [&mut made.train, &mut made.validation] {
            let states = [&samples.q, &samples.qd, &samples.tau].map(Vec::clone);
            let own = accelerations(&mut *evaluator, &states);
            for (at, (qdd, own)) in samples.qdd.iter_mut().zip(own).enumerate() {
                let deviation = noise[at % noise.len()] * normal(&mut rng);
                // Accelerations at which the model fails are not imitated.
                if own.abs() <= 100.0 * qdd.abs().max(1.0) {
                    *qdd = own + deviation;
                }
            }
        }
        made
    }

    /// Scales of the data; the time is that in which the velocity turns, the root mean square of q̇ over that of q̈.
    ///
    /// # Errors
    /// [`Error::Argument`] for data at rest, or without accelerations.
    pub(super) fn scale(&self) -> Result<FieldScale> {
        let (scaling, data) = (self.dataset.scaling(), &self.dataset.train);
        let unit = &scaling.qd_scale;
        let square = |(at, x): (usize, &f64)| (x / unit[at % unit.len()]).powi(2);
        let squares = |x: &[f64]| -> f64 { x.iter().enumerate().map(square).sum() };
        let time = (squares(&data.qd) / squares(&data.qdd)).sqrt();
        if !(time.is_finite() && time > 0.0) {
            let name = "time in which the velocity turns";
            let must = "finite and above 0: give recordings that move and accelerate";
            return Err(Error::argument(name, time, must));
        }
        let tau = self.dataset.force_scale();
        Ok(FieldScale {
            signals: [scaling.q_scale, scaling.qd_scale, tau],
            time,
        })
    }
}

/// About `most` evenly chosen states of recordings; forces that were not recorded are 0.
pub(super) fn thinned(recordings: &[Trajectory], most: usize) -> States {
    let samples: usize = recordings.iter().map(Trajectory::len).sum();
    let rows = recordings.iter();
    let rows = rows.flat_map(|r| (0..r.len()).map(move |k| r.row(k)));
    let [mut q, mut qd, mut tau] = [const { Vec::new() }; 3];
    for row in rows.step_by((samples / most).max(1)) {
        q.extend_from_slice(row.q);
        qd.extend_from_slice(row.qd);
        tau.extend_from_slice(row.tau);
        tau.resize(q.len(), 0.0);
    }
    [q, qd, tau]
}
