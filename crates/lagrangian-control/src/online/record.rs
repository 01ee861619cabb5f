//! The record of a run of online learning.

use serde::{Deserialize, Serialize};

/// One event of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Time in the motion, s.
    pub t: f64,
    /// Number of training steps before the event.
    pub step: usize,
    /// Kind of event.
    pub kind: EventKind,
}

/// The kind of an [`Event`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The first model was handed over.
    FirstModel,
    /// The guard refused a model.
    Refused {
        /// Reason of the refusal.
        reason: String,
    },
    /// Training diverged and was rolled back to the last model that passed the guard, which the loop still uses.
    RolledBack,
    /// New samples contradicted the model, so that older samples were discarded.
    DiscardedSamples,
    /// New samples contradicted the model of a robot of known kinematics, so that what was known of its last body, which carries the
    /// load, was discarded.
    DiscardedBody,
}

/// Counts and events of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Record {
    /// Number of samples that were learned from.
    pub samples: u64,
    /// Number of rows that were dropped because they were not finite.
    pub not_finite: u64,
    /// Number of rows that the queue dropped because the learner was too slow.
    pub lost: u64,
    /// Number of training steps.
    pub steps: usize,
    /// Number of models that were handed over.
    pub handed_over: u64,
    /// Number of models that the guard refused.
    pub refused: u64,
    /// Number of times that training diverged and was rolled back.
    pub rollbacks: u64,
    /// The first thousand events, so that a run that fails at every step does not fill the memory.
    pub events: Vec<Event>,
}

/// Maximum number of events that are kept.
const KEPT: usize = 1000;

impl Record {
    /// Adds an event, unless the record is full.
    pub(crate) fn note(&mut self, t: f64, kind: EventKind) {
        if self.events.len() < KEPT {
            let step = self.steps;
            self.events.push(Event { t, step, kind });
        }
    }
}
