//! The order of the samples.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::dataset::shuffle;

/// The order of the samples: a new random one for each pass, a function of seed and step alone.
pub(crate) struct Order {
    seed: u64,
    epoch: Option<usize>,
    indices: Vec<usize>,
    drawn: Vec<usize>,
}

impl Order {
    pub(crate) fn new(len: usize, seed: u64) -> Self {
        Self {
            seed,
            epoch: None,
            indices: (0..len).collect(),
            drawn: Vec::new(),
        }
    }

    /// The indices of the samples of a step; the remainder at the end of a pass is skipped.
    pub(crate) fn batch(&mut self, step: usize, batch: usize) -> &[usize] {
        let steps = (self.indices.len() / batch).max(1);
        let epoch = step / steps;
        if self.epoch != Some(epoch) {
            self.epoch = Some(epoch);
            self.indices.sort_unstable();
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(1 + epoch as u64);
            shuffle(&mut self.indices, &mut rng);
        }
        let start = step % steps * batch;
        self.drawn.clear();
        self.drawn
            .extend_from_slice(&self.indices[start..start + batch]);
        &self.drawn
    }
}
