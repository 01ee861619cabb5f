//! The learner on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use super::ring::{Reader, Writer, ring};
use super::slot::{Giver, Taker, slot};
use super::{Differentiator, OnlineLearner, Record};
use lagrangian::train::Learned;
use lagrangian::{Error, Result};

/// A learner at work, and the two ends that the control loop holds.
pub struct OnlineThread {
    /// Takes the rows of the loop.
    pub rows: Writer,
    /// Gives it models.
    pub models: Taker<Learned>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Record>>>,
}

/// Rows that wait for the learner, at most.
const ROWS: usize = 8192;
/// Steps between two hand-overs.
const STEPS: usize = 4;
/// How long it sleeps where there is nothing to learn from.
const IDLE: Duration = Duration::from_millis(2);

/// Starts a thread for this learner.
///
/// # Errors
/// As [`ring`]; [`Error::Io`] where the system gives no thread.
pub fn spawn(mut learner: OnlineLearner) -> Result<OnlineThread> {
    let (rows, mut reader) = ring(ROWS, Differentiator::width(learner.dof()))?;
    let (mut giver, models) = slot();
    let stop = Arc::new(AtomicBool::new(false));
    let signal = stop.clone();
    let work = move || -> Result<Record> {
        while !signal.load(Ordering::Relaxed) {
            turn(&mut learner, &mut reader, &mut giver)?;
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

/// Takes what has come, learns, hands over.
fn turn(
    learner: &mut OnlineLearner,
    reader: &mut Reader,
    giver: &mut Giver<Learned>,
) -> Result<()> {
    let mut row = vec![0.0; Differentiator::width(learner.dof())];
    while reader.pop(&mut row) {
        learner.observe(&row)?;
    }
    learner.set_lost(reader.lost());
    let before = learner.record().steps;
    learner.train(STEPS)?;
    if learner.record().steps == before {
        std::thread::sleep(IDLE);
        return Ok(());
    }
    if let Some(model) = learner.hand_over() {
        giver.give(Arc::new(model));
    }
    Ok(())
}

impl OnlineThread {
    /// Whether the learner is still at work: one that met an error has ended, and the loop goes on with its last
    /// model.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|t| !t.is_finished())
    }

    /// Ends the thread; what it did.
    ///
    /// # Errors
    /// What ended it before, if it was an error.
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
            // Its record is lost with it.
            let _ = thread.join();
        }
    }
}
