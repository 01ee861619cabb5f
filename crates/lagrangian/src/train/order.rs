//! The order of the samples.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::dataset::shuffle;

/// The order in which samples are visited: a new random one for each pass, a function of seed and step alone.
pub(crate) struct Order {
    seed: u64,
    epoch: Option<usize>,
    numbers: Vec<usize>,
    wrapped: Vec<usize>,
}

impl Order {
    pub(crate) fn new(len: usize, seed: u64) -> Self {
        Self {
            seed,
            epoch: None,
            numbers: (0..len).collect(),
            wrapped: Vec::new(),
        }
    }

    /// The samples of a step; the few that are left at the end of a pass are skipped.
    pub(crate) fn batch(&mut self, step: usize, batch: usize) -> &[usize] {
        let steps = (self.numbers.len() / batch).max(1);
        let epoch = step / steps;
        if self.epoch != Some(epoch) {
            self.epoch = Some(epoch);
            self.numbers.sort_unstable();
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(1 + epoch as u64);
            shuffle(&mut self.numbers, &mut rng);
        }
        let start = step % steps * batch;
        self.wrapped.clear();
        self.wrapped
            .extend_from_slice(&self.numbers[start..start + batch]);
        &self.wrapped
    }
}
