//! What improves the parameters of a run: an optimiser a file, and both of them under the rollout loss.

mod adam;
mod natural;
mod rollout;

pub(super) use adam::AdamEngine;
pub(super) use natural::NaturalEngine;
pub(super) use rollout::{AdamRollouts, NaturalRollouts, Parts};

use super::batch::{Samples, Value};
use super::checkpoint::Checkpoint;

/// An optimiser at work.
pub(super) trait Engine {
    /// One step on a batch at this share of the budget; returns the loss before it and its rate.
    fn step(
        &mut self,
        state: &mut Checkpoint,
        share: f64,
        batch: (&Samples, &[usize]),
    ) -> (Value, f64);
    /// Writes what it keeps to itself between two looks.
    fn save(&self, state: &mut Checkpoint);
    /// Takes it back, perhaps changed.
    fn load(&mut self, state: &Checkpoint);
}
