//! How far an experiment of many parts has come.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Result, bail};
use lagrangian::train::{self, Observer};

use crate::interrupt;
use crate::progress::Progress;

/// The progress of an experiment whose parts have weights (expected seconds, say); it also knows of Ctrl-C.
///
/// As the observer of a fit it moves within its part.
pub(crate) struct Course {
    bar: Progress,
    start: Instant,
    part: String,
    /// Weights: of all parts, of those that are done, of the one at work.
    total: f64,
    done: f64,
    weight: f64,
    interrupted: Arc<AtomicBool>,
    quiet: bool,
}

impl Course {
    /// Begins, with one part of all the weight until [`Course::plan`] says more.
    pub(super) fn start(name: &str, quiet: bool) -> Result<Self> {
        Ok(Self {
            bar: Progress::start(format!("experiment {name}"), quiet),
            start: Instant::now(),
            part: String::new(),
            total: 1.0,
            done: 0.0,
            weight: 0.0,
            interrupted: interrupt::flag()?,
            quiet,
        })
    }

    /// Says the weight of all parts together.
    pub(crate) fn plan(&mut self, total: f64) {
        self.total = total.max(f64::MIN_POSITIVE);
    }

    /// Ends the part before and begins one of this weight.
    ///
    /// # Errors
    /// Where the user has interrupted the experiment.
    pub(crate) fn begin(&mut self, part: impl Into<String>, weight: f64) -> Result<()> {
        self.done += self.weight;
        (self.part, self.weight) = (part.into(), weight);
        self.move_to(0.0, "");
        self.check()
    }

    /// Moves to a share of the part at work.
    pub(crate) fn move_to(&mut self, share: f64, news: &str) {
        let fraction = (self.done + share.clamp(0.0, 1.0) * self.weight) / self.total;
        let dot = if news.is_empty() { "" } else { " · " };
        self.bar
            .update(fraction, &format!("{}{dot}{news}", self.part));
    }

    /// Says something that a reader should know before the work goes on.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Whether Ctrl-C was pressed: work in hand should end.
    pub(crate) fn interrupted(&self) -> bool {
        self.interrupted.load(Ordering::SeqCst)
    }

    /// Ends the experiment where Ctrl-C was pressed.
    ///
    /// # Errors
    /// That it was.
    pub(crate) fn check(&self) -> Result<()> {
        if self.interrupted() {
            bail!("interrupted in the part '{}'", self.part);
        }
        Ok(())
    }

    /// Ends; the seconds that all took.
    pub(super) fn finish(self) -> f64 {
        let seconds = self.start.elapsed().as_secs_f64();
        self.bar.finish("done");
        seconds
    }
}

impl Observer for Course {
    fn progress(&mut self, progress: &train::Progress) -> ControlFlow<()> {
        let news = format!("step {} · loss {:.1e}", progress.step, progress.loss);
        self.move_to(progress.share, &news);
        if self.interrupted() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
