//! Who watches a run, and what it is told.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::checkpoint::Checkpoint;
use crate::Result;

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Steps done.
    pub step: usize,
    /// Share of the budget used, 0…1.
    pub share: f64,
    /// Seconds of training, over all parts of a resumed run.
    pub seconds: f64,
    /// Mean loss of the last batch, before its step.
    pub loss: f64,
    /// Mean loss on the validation samples, where this step looked at them.
    pub validation: Option<f64>,
    /// Rate of the step.
    pub rate: f64,
    /// Samples of the batch that were left out for a singular mass matrix.
    pub singular: usize,
}

/// Watches a run; printing, plotting and files are its business.
///
/// A fit calls it on a thread of the pool that it runs in.
pub trait Observer: Send {
    /// After each step; `Break` ends the run and keeps the best weights.
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()>;

    /// After each look at the validation samples: everything that a later run needs to go on to the same bits.
    ///
    /// # Errors
    /// Any error ends the run with it.
    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        let _ = checkpoint;
        Ok(())
    }
}

/// Watches nothing.
impl Observer for () {
    fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The budget was used.
    Finished,
    /// The validation loss had not improved for the given patience.
    Converged,
    /// The observer ended it.
    Interrupted,
}
