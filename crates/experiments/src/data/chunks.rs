//! Short pieces of long motions, each of another motion: data that cover many states with few samples.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use lagrangian::mechanics::{Jet, Lagrangian};
use lagrangian::rollout::{free, rollout_many};
use lagrangian::{Model, Result, RolloutOptions, State, Trajectory};

/// Where motions are cut.
pub(crate) struct Cut {
    /// Time between two samples, s.
    pub(crate) interval: f64,
    /// Samples of a chunk.
    pub(crate) samples: usize,
    /// Chunks in a motion, one of which is taken.
    pub(crate) places: usize,
}

/// Chunks of motions.
#[derive(Debug, Clone)]
pub(crate) struct Chunks {
    /// The chunks to fit.
    pub(crate) train: Vec<Trajectory>,
    /// The chunks for validation.
    pub(crate) held: Vec<Trajectory>,
}

impl Chunks {
    /// All chunks, those to fit first.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Trajectory> {
        self.train.iter_mut().chain(&mut self.held)
    }

    /// The chunks that `change` makes of those to fit and of those for validation.
    pub(crate) fn map(
        &self,
        change: impl Fn(&[Trajectory]) -> Result<Vec<Trajectory>>,
    ) -> Result<Self> {
        Ok(Self {
            train: change(&self.train)?,
            held: change(&self.held)?,
        })
    }
}

/// A chunk of the free motion of `model` from each start, at a random place, with its accelerations. Motions that do not
/// reach their chunk are omitted.
pub(crate) fn chunks(
    model: &dyn Model,
    starts: &[State],
    cut: &Cut,
    options: &RolloutOptions,
    seed: u64,
) -> Result<Vec<Trajectory>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(1);
    let places = starts.iter().map(|_| rng.random_range(0..cut.places));
    let place: Vec<usize> = places.collect();
    let mut all: Vec<Option<Trajectory>> = vec![None; starts.len()];
    // Motions with the same place share their times.
    for at in 0..cut.places {
        let chosen: Vec<usize> = (0..starts.len()).filter(|&k| place[k] == at).collect();
        let begins: Vec<State> = chosen.iter().map(|&k| starts[k].clone()).collect();
        let first = at * cut.samples;
        let stamp = |k: usize| cut.interval * k as f64;
        let mut times: Vec<f64> = (first..first + cut.samples).map(stamp).collect();
        if at > 0 {
            times.insert(0, 0.0);
        }
        let rollouts = rollout_many(model, &begins, &times, &free, options)?;
        for (k, rollout) in chosen.into_iter().zip(rollouts) {
            if rollout.outcome.is_finished() {
                let mut chunk = rollout.trajectory.after(usize::from(at > 0));
                chunk.name = k.to_string();
                all[k] = Some(chunk);
            }
        }
    }
    Ok(all.into_iter().flatten().collect())
}

/// The same motions with momenta p = ∂L/∂q̇ and their rates, which are ∂L/∂q where no force acts.
pub(crate) fn with_momenta(lagrangian: &dyn Lagrangian, motions: &[Trajectory]) -> Vec<Trajectory> {
    let mut jets = lagrangian.jets();
    let mut jet = Jet::default();
    let mut one = |motion: &Trajectory| {
        jets.jet(&motion.q, &motion.qd, &mut jet);
        let mut motion = motion.clone();
        (motion.p, motion.pd) = (jet.momentum.clone(), jet.dl_dq.clone());
        motion
    };
    motions.iter().map(&mut one).collect()
}
