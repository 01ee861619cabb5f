//! A task that takes a while: a line on standard error now and then, and an end when its time is up.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::interrupt;
use crate::progress::duration;

/// A task shorter than this says nothing.
const FIRST_LINE: Duration = Duration::from_secs(1);
/// Between two lines.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Time for the predictions of any recordings, and for those of a sample, s; at most [`LONGEST`]. A usable model needs a
/// tenth of it.
const ANY: f64 = 30.0;
const SAMPLE: f64 = 2e-3;
const LONGEST: f64 = 600.0;

/// A task under way; it ends when this is dropped.
pub(crate) struct Task {
    done: Option<Sender<()>>,
    lines: Option<JoinHandle<()>>,
}

impl Task {
    /// Shows that a task is under way.
    pub(crate) fn start(label: &'static str, quiet: bool) -> Self {
        Self::within(label, quiet, None)
    }

    /// The predictions of so many samples: they end when their time is up, or at Ctrl-C.
    pub(crate) fn of_predictions(label: &'static str, quiet: bool, samples: usize) -> Result<Self> {
        interrupt::listen()?;
        let seconds = (ANY + SAMPLE * samples as f64).min(LONGEST);
        Ok(Self::within(
            label,
            quiet,
            Some(Duration::from_secs_f64(seconds)),
        ))
    }

    fn within(label: &'static str, quiet: bool, budget: Option<Duration>) -> Self {
        let (done, ended) = channel();
        Self {
            done: Some(done),
            lines: Some(thread::spawn(move || show(label, quiet, budget, &ended))),
        }
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        self.done = None;
        // OK to ignore: the thread only writes lines.
        let _ = self.lines.take().map(JoinHandle::join);
    }
}

/// Writes lines until the task has ended, and ends it when its time is up.
fn show(label: &str, quiet: bool, budget: Option<Duration>, ended: &Receiver<()>) {
    let start = Instant::now();
    let limit = budget.map_or(String::new(), |b| format!(", at most {}", duration(b)));
    let (mut next, mut deadline) = (FIRST_LINE, budget);
    loop {
        let due = deadline.map_or(next, |deadline| next.min(deadline));
        let wait = due.saturating_sub(start.elapsed());
        if ended.recv_timeout(wait) != Err(RecvTimeoutError::Timeout) {
            return;
        }
        if deadline.is_some_and(|deadline| start.elapsed() >= deadline) {
            deadline = None;
            interrupt::time_is_up();
            tell!("note: {label}: its time is up; what is left is omitted");
        } else if start.elapsed() >= next {
            next += LINE_EVERY;
            if !quiet {
                tell!("{label}: {} so far{limit}", duration(start.elapsed()));
            }
        }
    }
}
