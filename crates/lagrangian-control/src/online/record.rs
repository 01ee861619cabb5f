//! What happened while a model was learned online.

use serde::{Deserialize, Serialize};

/// Something that a reader of the run wants to know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When, s of motion.
    pub t: f64,
    /// Training steps up to there.
    pub step: usize,
    /// What.
    pub what: What,
}

/// The kinds of events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// The first model was handed over.
    FirstModel,
    /// A model was held back.
    Refused {
        /// Why.
        reason: String,
    },
    /// Training diverged; it went back to the last good model, which the loop has kept.
    FellBack,
    /// New samples contradict the model: older ones were forgotten.
    Forgot,
}

/// All counts of a run, and its events.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Record {
    /// Samples that were learned from.
    pub samples: u64,
    /// Rows that were dropped because they were not finite.
    pub not_finite: u64,
    /// Rows that the ring dropped because the learner was too slow.
    pub lost: u64,
    /// Training steps.
    pub steps: usize,
    /// Models handed over.
    pub handed_over: u64,
    /// Models held back by the guard.
    pub refused: u64,
    /// Times that training diverged.
    pub fell_back: u64,
    /// Events, the first of them: a run that goes wrong at every step does not fill the memory.
    pub events: Vec<Event>,
}

/// Events that are kept.
const KEPT: usize = 1000;

impl Record {
    /// Adds an event, unless there are too many.
    pub(crate) fn note(&mut self, t: f64, what: What) {
        if self.events.len() < KEPT {
            let step = self.steps;
            self.events.push(Event { t, step, what });
        }
    }
}
