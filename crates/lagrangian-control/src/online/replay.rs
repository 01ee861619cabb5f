//! The memory of a learner: all of the newest samples, and a random selection of the older ones.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Sample;
use lagrangian::trajectory::Samples;
use lagrangian::{Error, Result, Signals};

/// Settings of a [`Replay`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReplayConfig {
    /// Number of newest samples, all of which are kept.
    pub newest: usize,
    /// Number of older samples that are kept; each older sample is kept with equal probability.
    pub reservoir: usize,
    /// Fraction of a batch that is drawn from the newest samples.
    pub newest_part: f64,
}

impl Default for ReplayConfig {
    fn default() -> Self {
        Self {
            newest: 256,
            reservoir: 8192,
            newest_part: 0.25,
        }
    }
}

/// Samples that a learner keeps. The newest are held in a ring, and those that leave the ring enter a reservoir
/// (algorithm R, Vitter 1985).
#[derive(Debug, Clone)]
pub struct Replay {
    config: ReplayConfig,
    /// Ring of the newest samples, then the reservoir.
    samples: Samples,
    /// Number of samples in the ring, and index of the oldest.
    filled: usize,
    oldest: usize,
    /// Number of samples that were offered to the reservoir, and number of those in it.
    offered: u64,
    stored: usize,
    rng: ChaCha8Rng,
}

impl Replay {
    /// An empty memory for samples of `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`] for settings outside their domain.
    pub fn new(n: usize, config: ReplayConfig, seed: u64) -> Result<Self> {
        let size = config.newest.saturating_add(config.reservoir);
        if config.newest == 0 || size > 1 << 22 || !(0.0..=1.0).contains(&config.newest_part) {
            return Err(Error::argument(
                "replay",
                format!("{config:?}"),
                "at least one newest sample, at most 4194304 in all, and a part of the newest between 0 and 1",
            ));
        }
        let column = || vec![0.0; size * n];
        Ok(Self {
            samples: Samples::new(
                n,
                Signals {
                    q: column(),
                    qd: column(),
                    qdd: column(),
                    tau: column(),
                    ..Signals::default()
                },
            ),
            config,
            filled: 0,
            oldest: 0,
            offered: 0,
            stored: 0,
            rng: ChaCha8Rng::seed_from_u64(seed),
        })
    }

    /// Adds a sample.
    pub fn push(&mut self, sample: &Sample) {
        let place = if self.filled < self.config.newest {
            self.filled += 1;
            self.filled - 1
        } else {
            let place = self.oldest;
            self.keep(place);
            self.oldest = (self.oldest + 1) % self.config.newest;
            place
        };
        let n = self.samples.n;
        let row = place * n..(place + 1) * n;
        self.samples.q[row.clone()].copy_from_slice(&sample.q);
        self.samples.qd[row.clone()].copy_from_slice(&sample.qd);
        self.samples.qdd[row.clone()].copy_from_slice(&sample.qdd);
        self.samples.tau[row].copy_from_slice(&sample.tau);
    }

    /// Offers the sample at `place` to the reservoir.
    fn keep(&mut self, place: usize) {
        self.offered += 1;
        if self.config.reservoir == 0 {
            return;
        }
        let target = if self.stored < self.config.reservoir {
            self.stored += 1;
            self.stored - 1
        } else {
            let drawn = self.rng.random_range(0..self.offered);
            match usize::try_from(drawn) {
                Ok(drawn) if drawn < self.config.reservoir => drawn,
                _ => return,
            }
        };
        let n = self.samples.n;
        let to = (self.config.newest + target) * n;
        let Signals {
            q, qd, qdd, tau, ..
        } = &mut self.samples.signals;
        for signal in [q, qd, qdd, tau] {
            signal.copy_within(place * n..(place + 1) * n, to);
        }
    }

    /// Discards all but the last `keep` samples.
    pub fn keep_last(&mut self, keep: usize) {
        let keep = keep.min(self.filled);
        let ring = self.config.newest;
        let n = self.samples.n;
        // The newest precedes the oldest in the ring.
        let first = (self.oldest + self.filled - keep) % ring.max(1);
        let order: Vec<usize> = (0..keep).map(|k| (first + k) % ring).collect();
        let Signals {
            q, qd, qdd, tau, ..
        } = &mut self.samples.signals;
        for signal in [q, qd, qdd, tau] {
            let kept: Vec<f64> = order
                .iter()
                .flat_map(|&k| signal[k * n..(k + 1) * n].to_vec())
                .collect();
            signal[..kept.len()].copy_from_slice(&kept);
        }
        (self.filled, self.oldest, self.offered, self.stored) = (keep, 0, 0, 0);
    }

    /// All rows of the memory, some of which may be empty: only the indices of [`Replay::draw`] and
    /// [`Replay::newest`] are samples.
    #[must_use]
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.filled + self.stored
    }

    /// Whether the memory contains no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.filled == 0
    }

    /// Draws the indices of a batch: some from the newest samples, the others from the reservoir.
    pub fn draw(&mut self, batch: usize, indices: &mut Vec<usize>) {
        indices.clear();
        if self.is_empty() {
            return;
        }
        for k in 0..batch.min(self.len()) {
            let newest = self.stored == 0 || (k as f64) < self.config.newest_part * batch as f64;
            indices.push(if newest {
                self.rng.random_range(0..self.filled)
            } else {
                self.config.newest + self.rng.random_range(0..self.stored)
            });
        }
    }

    /// Writes the indices of the last `count` samples, oldest first.
    pub fn newest(&self, count: usize, indices: &mut Vec<usize>) {
        indices.clear();
        let count = count.min(self.filled);
        let first = self.oldest + self.filled - count;
        indices.extend((0..count).map(|k| (first + k) % self.config.newest));
    }
}
