//! The files that a fit writes to its folder while it runs: metrics and checkpoints.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use lagrangian::{Checkpoint, Observer, Progress};

use crate::error::{Error, Result};
use crate::folder::{CHECKPOINT, RunFolder};
use crate::metrics::{Metrics, figures};

/// The time between two lines of the metrics without a validation.
const METRICS_EVERY: Duration = Duration::from_millis(200);

/// The time between two checkpoints on disk.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(5);

/// Watches one fit and writes its run folder, beside another observer that shows it and may end it.
pub struct Watch<'a> {
    folder: &'a RunFolder,
    metrics: Metrics,
    shown: &'a mut dyn Observer,
    measured: Option<Instant>,
    saved: Option<Instant>,
    pending: Option<Checkpoint>,
    failure: Option<Error>,
}

impl<'a> Watch<'a> {
    /// An observer of a fit that begins.
    pub fn new(folder: &'a RunFolder, metrics: Metrics, shown: &'a mut dyn Observer) -> Self {
        Self {
            folder,
            metrics,
            shown,
            measured: None,
            saved: None,
            pending: None,
            failure: None,
        }
    }

    /// Writes the last checkpoint.
    ///
    /// # Errors
    /// The first failure to write, which ended the fit.
    pub fn finish(mut self) -> Result<()> {
        self.save();
        self.failure.map_or(Ok(()), Err)
    }

    fn measure(&mut self, progress: &Progress) -> Result<()> {
        let due = self.measured.is_none_or(|at| at.elapsed() >= METRICS_EVERY);
        if !due && progress.validation.is_none() {
            return Ok(());
        }
        self.measured = Some(Instant::now());
        let step = progress.step as u64;
        self.metrics.add(step, progress.seconds, &figures(progress))
    }

    fn save(&mut self) {
        let Some(checkpoint) = self.pending.take() else {
            return;
        };
        self.saved = Some(Instant::now());
        let bytes = checkpoint.to_bytes().map_err(Error::from);
        let written = bytes.and_then(|bytes| self.folder.write(CHECKPOINT, &bytes));
        if let Err(failure) = written {
            self.failure.get_or_insert(failure);
        }
    }
}

impl Observer for Watch<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let shown = self.shown.progress(progress);
        if let Err(failure) = self.measure(progress) {
            self.failure.get_or_insert(failure);
        }
        match self.failure {
            Some(_) => ControlFlow::Break(()),
            None => shown,
        }
    }

    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        self.shown.stage(what, share)
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> lagrangian::Result<()> {
        self.pending = Some(checkpoint.clone());
        if self.saved.is_none_or(|at| at.elapsed() >= CHECKPOINT_EVERY) {
            self.save();
        }
        self.shown.checkpoint(checkpoint)
    }
}
