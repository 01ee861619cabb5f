//! The learner on a separate thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::ring::{Reader, Writer, ring};
use super::slot::{Publisher, Subscriber, slot};
use super::{Differentiator, OnlineLearner, Record};
use lagrangian::{Error, Learned, Result};

/// A learner on its thread, and the two ends for the control loop.
pub struct OnlineThread {
    /// Receives the rows (t, q, q̇, τ) of the loop.
    pub rows: Writer,
    /// Delivers the models.
    pub models: Subscriber<Learned>,
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
/// As [`ring`]; [`Error::Io`] if the system cannot start a thread.
pub fn spawn(mut learner: OnlineLearner) -> Result<OnlineThread> {
    let (rows, mut reader) = ring(ROWS, Differentiator::width(learner.dof()))?;
    let (mut publisher, models) = slot();
    let stop = Arc::new(AtomicBool::new(false));
    let signal = stop.clone();
    let work = move || -> Result<Record> {
        while !signal.load(Ordering::Relaxed) {
            turn(&mut learner, &mut reader, &mut publisher)?;
        }
        Ok(learner.record())
    };
    let thread = std::thread::Builder::new()
        .name("learner".into())
        .spawn(work)?;
    Ok(OnlineThread {
        rows,
        models,
        stop,
        thread: Some(thread),
    })
}

/// Processes the new rows, trains, and hands a model over.
fn turn(
    learner: &mut OnlineLearner,
    reader: &mut Reader,
    publisher: &mut Publisher<Learned>,
) -> Result<()> {
    let mut row = vec![0.0; Differentiator::width(learner.dof())];
    while let Some(row) = reader.pop(&mut row) {
        learner.observe(row)?;
    }
    learner.set_lost(reader.lost());
    let before = learner.record().steps;
    learner.train(STEPS)?;
    if learner.record().steps == before {
        std::thread::sleep(IDLE);
        return Ok(());
    }
    if let Some(model) = learner.hand_over() {
        publisher.publish(Arc::new(model));
    }
    Ok(())
}

impl OnlineThread {
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
