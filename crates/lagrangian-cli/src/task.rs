//! A long task: a line on standard error now and then, and an end at Ctrl-C or when its time is up.

use std::fs;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::Result;
use lagrangian::score::time_for;

use crate::failure::FAILED;
use crate::interrupt;
use crate::progress::duration;

/// A task shorter than this prints nothing.
const FIRST_LINE: Duration = Duration::from_secs(1);
/// The time between two lines.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// The time between two checks of Ctrl-C and of the clock.
const LOOK: Duration = Duration::from_millis(50);
/// The time in which a task must end with its present result after a request to end.
const GRACE: Duration = Duration::from_millis(700);

/// Time for any other task, for each byte that it reads, and for each sample that it computes, s: on a slow machine a tenth of
/// it is enough.
const ANY_TASK: f64 = 120.0;
const BYTE: f64 = 2e-5;
const COMPUTED: f64 = 2e-2;

/// The size of a task, from which its time follows.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Size {
    bytes: u64,
    samples: f64,
}

impl Size {
    /// The size of a task that reads the content of these files.
    pub(crate) fn of_files(files: &[PathBuf]) -> Self {
        let length = |path: &PathBuf| fs::metadata(path).map_or(0, |about| about.len());
        Self {
            bytes: files.iter().map(length).sum(),
            samples: 0.0,
        }
    }

    /// Adds computed samples to the size.
    pub(crate) fn with_samples(self, samples: f64) -> Self {
        Self { samples, ..self }
    }

    fn budget(self) -> Duration {
        let seconds = ANY_TASK + BYTE * self.bytes as f64 + COMPUTED * self.samples;
        // OK because no task is that long: flags are bounded where they are used.
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}

/// The end of a task after a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// It checks [`interrupt::stop`] everywhere, and the command waits for it.
    Waited,
    /// Parts of it do not check: after [`GRACE`] the command ends, whatever it is doing.
    Forced,
}

/// A task under way, which ends when this is dropped. Results that are of use in part are written after that.
pub(crate) struct Task {
    done: Option<Sender<()>>,
    lines: Option<JoinHandle<()>>,
}

impl Task {
    /// A task of this size; it ends at Ctrl-C and when its time is up, with its present result or without one.
    pub(crate) fn start(label: &'static str, quiet: bool, size: Size) -> Result<Self> {
        Self::with_budget(label, quiet, size.budget(), End::Forced)
    }

    /// The predictions of this number of samples: they end when their time is up, or at Ctrl-C.
    pub(crate) fn of_predictions(label: &'static str, quiet: bool, samples: usize) -> Result<Self> {
        Self::with_budget(label, quiet, time_for(samples), End::Waited)
    }

    /// Output to standard output, as slowly as it is read: it ends at Ctrl-C alone.
    pub(crate) fn of_output(label: &'static str) -> Result<Self> {
        Self::with_budget(label, true, Duration::MAX, End::Forced)
    }

    fn with_budget(label: &'static str, quiet: bool, budget: Duration, end: End) -> Result<Self> {
        interrupt::listen()?;
        let (done, ended) = channel();
        Ok(Self {
            done: Some(done),
            lines: Some(thread::spawn(move || {
                watch(label, quiet, (budget, end), &ended);
            })),
        })
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        self.done = None;
        // OK to ignore: the thread only writes lines.
        let _ = self.lines.take().map(JoinHandle::join);
    }
}

/// Writes lines until the task has ended, and asks it to end when its time is up.
fn watch(label: &str, quiet: bool, (budget, end): (Duration, End), ended: &Receiver<()>) {
    let (start, mut next, mut asked) = (Instant::now(), FIRST_LINE, None);
    while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        let elapsed = start.elapsed();
        if asked.is_none() && elapsed >= budget {
            interrupt::time_is_up();
            let limit = duration(budget);
            note!("note: {label}: its time is up ({limit}); what is left is omitted");
        } else if asked.is_none() && elapsed >= next && !quiet {
            next += LINE_EVERY;
            let (elapsed, limit) = (duration(elapsed), duration(budget));
            note!("{label}: {elapsed} so far, at most {limit}");
        }
        if interrupt::stop().is_asked() {
            let since = asked.get_or_insert_with(Instant::now).elapsed();
            if end == End::Forced && since >= GRACE {
                note!("{label}: ended before it was done; files that are not complete are removed");
                interrupt::end_now(match interrupt::is_pressed() {
                    true => interrupt::INTERRUPTED,
                    false => FAILED,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_task_grows_with_what_it_reads_and_computes() {
        let none = Size::default();
        assert_eq!(none.budget(), Duration::from_secs_f64(ANY_TASK));
        assert!(none.with_samples(1e6).budget() > none.with_samples(1e3).budget());
        assert_eq!(none.with_samples(f64::MAX).budget(), Duration::MAX);
        let read = Size {
            bytes: 1 << 30,
            ..none
        };
        assert!(read.budget() > Duration::from_secs(3600));
    }
}
