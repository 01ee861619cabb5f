//! The learner on a separate thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_queue::ArrayQueue;

use super::rows::Rows;
use super::{Differentiator, OnlineLearner, Record};
use lagrangian::{Error, Learned, Result};

/// A learner on its thread, as the control loop sees it: no call waits.
pub struct OnlineThread {
    rows: Arc<Rows>,
    /// The newest model, until it is taken.
    newest: Arc<ArrayQueue<Arc<Learned>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Record>>>,
}

/// Maximum number of rows that wait for the learner.
const ROWS: usize = 8192;
/// Number of training steps between two hand-overs.
const STEPS: usize = 4;
/// Sleep time of the thread without new rows.
const IDLE: Duration = Duration::from_millis(2);

/// Starts a thread for a learner.
///
/// # Errors
/// [`Error::Io`] if the system cannot start a thread.
pub fn spawn(mut learner: OnlineLearner) -> Result<OnlineThread> {
    let rows = Arc::new(Rows::new(ROWS, Differentiator::width(learner.dof())));
    let newest = Arc::new(ArrayQueue::new(1));
    let (reader, publisher) = (rows.clone(), newest.clone());
    let stop = Arc::new(AtomicBool::new(false));
    let signal = stop.clone();
    let work = move || -> Result<Record> {
        while !signal.load(Ordering::Relaxed) {
            turn(&mut learner, &reader, &publisher)?;
        }
        Ok(learner.record())
    };
    let thread = std::thread::Builder::new()
        .name("learner".into())
        .spawn(work)?;
    Ok(OnlineThread {
        rows,
        newest,
        stop,
        thread: Some(thread),
    })
}

/// Processes the new rows, trains, and hands a model over.
fn turn(learner: &mut OnlineLearner, rows: &Rows, newest: &ArrayQueue<Arc<Learned>>) -> Result<()> {
    while let Some(observed) = rows.read(|row| learner.observe(row)) {
        observed?;
    }
    learner.set_lost(rows.lost());
    let before = learner.record().steps;
    learner.train(STEPS)?;
    if learner.record().steps == before {
        std::thread::sleep(IDLE);
        return Ok(());
    }
    if let Some(model) = learner.hand_over() {
        newest.force_push(Arc::new(model));
    }
    Ok(())
}

impl OnlineThread {
    /// Adds a row (t, q, q̇, τ) of the loop; the oldest one is dropped if the learner is too slow.
    pub fn push(&self, row: &[f64]) {
        self.rows.push(row);
    }

    /// Whether a model was handed over since the last was taken.
    #[must_use]
    pub fn has_new(&self) -> bool {
        !self.newest.is_empty()
    }

    /// The newest model, unless it was taken before.
    #[must_use]
    pub fn take(&self) -> Option<Arc<Learned>> {
        self.newest.pop()
    }

    /// Whether the learner still runs. A learner ends at its first error; the loop then keeps its last model.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|t| !t.is_finished())
    }

    /// Ends the thread and returns its record.
    ///
    /// # Errors
    /// The error that ended the learner early, if any.
    pub fn finish(mut self) -> Result<Record> {
        self.stop.store(true, Ordering::Relaxed);
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(record)) => record,
            _ => Err(Error::Io(std::io::Error::other(
                "the learner's thread panicked",
            ))),
        }
    }
}

impl Drop for OnlineThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The record of the learner is lost.
            let _ = thread.join();
        }
    }
}
