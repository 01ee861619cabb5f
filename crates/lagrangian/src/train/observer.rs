//! Observers of a run, and its progress.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::checkpoint::Checkpoint;
use lagrangian_motion::Result;

/// The progress of a run after a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The number of steps done.
    pub step: usize,
    /// The part of the budget that is used, 0…1.
    pub share: f64,
    /// The duration of the training, s, over all parts of a resumed run.
    pub seconds: f64,
    /// The mean loss of the last batch before its step.
    pub loss: f64,
    /// The mean loss on the validation samples, where this step was followed by a validation.
    pub validation: Option<f64>,
    /// The rate of the step.
    pub rate: f64,
    /// The number of samples of the batch that were omitted for a singular mass matrix.
    pub singular: usize,
}

/// Watches a run, to print, plot or write files.
///
/// A fit calls it on a thread of the pool that it runs in.
pub trait Observer: Send {
    /// Called after each step; `Break` ends the run, which keeps the best weights.
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()>;

    /// Called by a family that is solved for at once, with its present stage and the part of it that is done, 0…1; `Break` asks it
    /// to end with its present result.
    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        let _ = (what, share);
        ControlFlow::Continue(())
    }

    /// Called after each validation with everything that a later run needs to resume to the same bits.
    ///
    /// # Errors
    /// An error ends the run, which returns it.
    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        let _ = checkpoint;
        Ok(())
    }
}

/// An observer that does nothing.
impl Observer for () {
    fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// An observer that several threads tell of their work, one after another, with what is known of the work of all.
pub(crate) struct SharedObserver<'a, S> {
    held: Mutex<(&'a mut dyn Observer, S)>,
    ended: AtomicBool,
}

impl<'a, S> SharedObserver<'a, S> {
    pub(crate) fn new(observer: &'a mut dyn Observer, state: S) -> Self {
        Self {
            held: Mutex::new((observer, state)),
            ended: AtomicBool::new(false),
        }
    }

    /// Tells the observer, whose `Break` ends the work of all threads; returns whether the work continues.
    pub(crate) fn tell(
        &self,
        tell: impl FnOnce(&mut dyn Observer, &mut S) -> ControlFlow<()>,
    ) -> bool {
        if let Ok(mut held) = self.held.lock() {
            let (observer, state) = &mut *held;
            if tell(*observer, state).is_break() {
                self.ended.store(true, Ordering::Relaxed);
            }
        }
        !self.ended()
    }

    /// Whether the observer asked for the end.
    pub(crate) fn ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }
}

/// The reason for the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The budget is used up.
    Finished,
    /// The validation loss has not improved within the given patience.
    Converged,
    /// The observer ended the run.
    Interrupted,
}
