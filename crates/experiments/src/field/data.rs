//! Rings to learn from: random starts of a known field, rolled out.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Field;
use lagrangian::mechanics::Lagrangian;
use lagrangian::rollout::{free, times};
use lagrangian::{Model, Result, RolloutOptions, Trajectory, rollout};
use nets::normal;

/// The distribution of random rings: Fourier modes with normal amplitudes, equal for all wave numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RingStates {
    /// The mean of φ over the ring is uniform between ± this.
    pub(crate) mean: f64,
    /// Root mean square of φ about its mean; each ring has a uniform share of it.
    pub(crate) amplitude: f64,
    /// Root mean square of φ̇; each ring has a uniform share of it.
    pub(crate) rate: f64,
    /// An angle winds up to this many times around the circle along the ring, either way.
    pub(crate) windings: i32,
    /// Length of a motion, s, and its sample interval.
    pub(crate) seconds: f64,
    /// Time between two samples, s.
    pub(crate) interval: f64,
}

impl RingStates {
    /// A random field and its rate on a ring of `points`.
    pub(crate) fn sample(&self, points: usize, rng: &mut impl rand::Rng) -> (Vec<f64>, Vec<f64>) {
        let mean = self.mean * (2.0 * rng.random::<f64>() - 1.0);
        let turns = (f64::from(self.windings) * (2.0 * rng.random::<f64>() - 1.0)).round();
        let shares = [self.amplitude, self.rate].map(|x| x * rng.random::<f64>());
        let mut phi = modes(points, shares[0], rng);
        for (i, x) in phi.iter_mut().enumerate() {
            *x += mean + turns * std::f64::consts::TAU * i as f64 / points as f64;
        }
        (phi, modes(points, shares[1], rng))
    }
}

/// A sum of all modes but the mean, of this root mean square in expectation.
fn modes(points: usize, size: f64, rng: &mut impl rand::Rng) -> Vec<f64> {
    let white: Vec<f64> = (0..points).map(|_| size * normal(rng)).collect();
    let mean = white.iter().sum::<f64>() / points as f64;
    white.iter().map(|x| x - mean).collect()
}

/// `count` motions of `truth` from random states, with their accelerations.
pub(crate) fn ring_states<D: Lagrangian>(
    truth: &Field<D>,
    states: &RingStates,
    count: usize,
    seed: u64,
) -> Result<Vec<Trajectory>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let times = times(states.seconds, states.interval)?;
    let model: &dyn Model = truth;
    (0..count)
        .map(|_| {
            let (phi, phid) = states.sample(truth.points(), &mut rng);
            let options = RolloutOptions::default();
            Ok(rollout(model, &phi, &phid, &times, &free, &options)?.trajectory)
        })
        .collect()
}
