//! The recordings of a survey, divided into those to fit, to validate and to test.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::errors::pieces;
use super::field::FieldScale;
use lagrangian::{Coordinates, Dataset, Error, Result, State, Trajectory, split};

/// The parts of the recordings that are held out of all fits, and that validate the weights.
const HELD_OUT: f64 = 0.25;
const VALIDATION: f64 = 0.15;
/// Fewer samples than this cannot be divided into three.
const FEWEST_SAMPLES: usize = 100;
/// The number of motions along which the conditions of Helmholtz are tested.
const MOTIONS: usize = 24;

pub(super) struct Parts {
    pub(super) dataset: Dataset,
    train: Vec<Trajectory>,
    pub(super) validation: Vec<Trajectory>,
    /// Held-out recordings in pieces.
    pub(super) test: Vec<Trajectory>,
    /// The number of held-out recordings.
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
            let (what, needed) = ("the whole of the recordings".into(), FEWEST_SAMPLES);
            return Err(Error::TooShort {
                what,
                found,
                needed,
            });
        }
        let (rest, test) = split(recordings.to_vec(), HELD_OUT, seed)?;
        let (train, validation) = split(rest, VALIDATION, seed)?;
        let dataset = Dataset::new(coordinates.clone(), &train, &validation)?;
        // For its errors: they are those of recordings that cannot be used.
        Dataset::new(coordinates.clone(), &test, &[])?;
        let recordings = test.len();
        Ok(Self {
            dataset,
            train,
            validation,
            recordings,
            test: pieces(test),
        })
    }

    /// The training data once more: as many pieces, drawn from them with replacement (Efron 1979).
    pub(super) fn drawn(&self, seed: u64) -> Result<Dataset> {
        let (mut rng, from) = (ChaCha8Rng::seed_from_u64(seed), pieces(self.train.clone()));
        let one = |_| from[rng.random_range(0..from.len())].clone();
        let drawn: Vec<Trajectory> = (0..from.len()).map(one).collect();
        Dataset::new(self.dataset.coordinates.clone(), &drawn, &self.validation)
    }

    /// The scales of the data; the time is that in which the velocity turns, the root mean square of q̇ over that of q̈.
    pub(super) fn scale(&self) -> Result<FieldScale> {
        let (scaling, data) = (self.dataset.scaling(), &self.dataset.train);
        let unit = &scaling.qd_scale;
        let square = |(at, x): (usize, &f64)| (x / unit[at % unit.len()]).powi(2);
        let squares = |x: &[f64]| -> f64 { x.iter().enumerate().map(square).sum() };
        let time = (squares(&data.qd) / squares(&data.qdd)).sqrt();
        let scale = FieldScale {
            time,
            q: scaling.q_scale,
            qd: scaling.qd_scale,
        };
        scale.validate(self.dataset.coordinates.dof())?;
        Ok(scale)
    }

    /// Evenly chosen held-out states.
    pub(super) fn starts(&self) -> Vec<State> {
        let n = self.dataset.coordinates.dof();
        let samples: usize = self.test.iter().map(Trajectory::len).sum();
        let states = |t: &Trajectory| -> Vec<State> {
            let rows = t.q.chunks_exact(n).zip(t.qd.chunks_exact(n));
            rows.map(|(q, qd)| State::new(q.to_vec(), qd.to_vec()))
                .collect()
        };
        let all = self.test.iter().flat_map(states);
        all.step_by((samples / MOTIONS).max(1)).collect()
    }
}
