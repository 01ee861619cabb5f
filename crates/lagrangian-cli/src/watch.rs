//! What happens while a fit runs: progress, metrics, checkpoints, Ctrl-C.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use anyhow::Result;
use lagrangian::{Checkpoint, Observer, Progress};

use crate::interrupt;
use crate::progress;
use crate::run_folder::{CHECKPOINT, Metrics, RunFolder};

/// Between two lines of the metrics, where no validation brings one.
const METRICS_EVERY: Duration = Duration::from_millis(200);

/// Between two checkpoints on disk.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(5);

/// Watches one fit and writes its run folder.
pub(crate) struct Watch<'a> {
    folder: &'a RunFolder,
    metrics: Metrics,
    bar: progress::Progress,
    first_step: Option<(usize, Instant)>,
    measured: Option<Instant>,
    saved: Option<Instant>,
    pending: Option<Checkpoint>,
    failure: Option<anyhow::Error>,
}

impl<'a> Watch<'a> {
    /// An observer of a fit that begins.
    pub(crate) fn new(folder: &'a RunFolder, metrics: Metrics, bar: progress::Progress) -> Self {
        Self {
            folder,
            metrics,
            bar,
            first_step: None,
            measured: None,
            saved: None,
            pending: None,
            failure: None,
        }
    }

    /// Writes the last checkpoint, and returns the first failure.
    pub(crate) fn finish(mut self, result: &str) -> Result<()> {
        self.save();
        match self.failure {
            Some(failure) => Err(failure),
            None => {
                self.bar.finish(result);
                Ok(())
            }
        }
    }

    fn measure(&mut self, progress: &Progress) -> Result<()> {
        let due = self.measured.is_none_or(|at| at.elapsed() >= METRICS_EVERY);
        if !due && progress.validation.is_none() {
            return Ok(());
        }
        self.measured = Some(Instant::now());
        let mut figures = vec![
            ("loss/train", progress.loss),
            ("learning_rate", progress.rate),
            ("singular", progress.singular as f64),
        ];
        figures.extend(progress.validation.map(|loss| ("loss/validation", loss)));
        self.metrics
            .add(progress.step as u64, progress.seconds, &figures)
    }

    fn show(&mut self, progress: &Progress) {
        let (step, start) = *self
            .first_step
            .get_or_insert((progress.step, Instant::now()));
        let rate = (progress.step - step) as f64 / start.elapsed().as_secs_f64().max(1e-9);
        let news = format!(
            "step {} · {rate:.1} steps/s · loss {:.2e}",
            progress.step, progress.loss
        );
        self.bar.update(progress.share, &news);
    }

    fn save(&mut self) {
        let Some(checkpoint) = self.pending.take() else {
            return;
        };
        self.saved = Some(Instant::now());
        let written = checkpoint
            .to_bytes()
            .map_err(anyhow::Error::new)
            .and_then(|bytes| self.folder.write(CHECKPOINT, &bytes));
        if let Err(failure) = written {
            self.failure.get_or_insert(failure);
        }
    }
}

impl Observer for Watch<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.show(progress);
        if let Err(failure) = self.measure(progress) {
            self.failure.get_or_insert(failure);
        }
        if self.failure.is_some() || interrupt::is_pressed() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        self.bar.update(share, what);
        match interrupt::is_pressed() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> lagrangian::Result<()> {
        self.pending = Some(checkpoint.clone());
        if self.saved.is_none_or(|at| at.elapsed() >= CHECKPOINT_EVERY) {
            self.save();
        }
        Ok(())
    }
}
