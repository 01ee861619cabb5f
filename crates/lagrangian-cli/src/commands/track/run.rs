//! One motion of a robot along a reference.

use lagrangian_control::online::{Event, EventKind, Record};
use lagrangian_control::{Driven, Followed, Following, LoopOutcome};
use serde_json::json;

/// One motion along the reference.
pub(super) struct Run {
    pub(super) key: &'static str,
    pub(super) name: &'static str,
    pub(super) followed: Followed,
    /// The errors that are judged: those of the last part of the motion where a model was learned during it.
    pub(super) judged: Following,
    /// Seconds of motion that were simulated in a second.
    pub(super) real_time: f64,
}

/// Parts of a motion that are shown one by one where a model is learned during it.
pub(super) const PARTS: usize = 5;

/// A drive cannot give more than this multiple of the largest torque that a motion needs.
const BEYOND: f64 = 20.0;

impl Run {
    /// The reason why a robot that needs these torques did not follow the motion at all.
    pub(super) fn lost(&self, needed: &[f64]) -> Option<String> {
        let Driven {
            trajectory,
            outcome,
            ..
        } = &self.followed.driven;
        let largest = |torques: &[f64]| torques.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let (asked, needed) = (largest(&trajectory.tau), largest(needed));
        let name = self.name;
        match outcome {
            LoopOutcome::Diverged { t } => {
                Some(format!("with {name} the robot diverged after {t} s"))
            }
            LoopOutcome::Finished if asked > BEYOND * needed => Some(format!(
                "with {name} the drives would give up to {asked:.3e} N·m (N), where the motion needs {needed:.3e}"
            )),
            LoopOutcome::Finished => None,
        }
    }

    /// Reports failures and limits.
    pub(super) fn warn(&self) {
        let driven = &self.followed.driven;
        if let LoopOutcome::Diverged { t } = driven.outcome {
            let name = self.name;
            note!(
                "note: with {name} the robot diverged after {t} s; lower the gains, or raise --rate"
            );
        }
        let name = self.name;
        let lost = match &self.followed.record {
            Some(record) => {
                note!("note: {}", learned(name, record));
                driven.not_finite
            }
            None => self.followed.without_model + driven.not_finite,
        };
        if lost > 0 {
            note!("note: with {name}, {lost} torques were not finite and are omitted");
        }
    }

    /// The root mean square of the error over all joints; infinite for a robot that was lost.
    pub(super) fn overall(&self) -> f64 {
        let rmse = &self.followed.following.rmse;
        match self.followed.driven.outcome {
            LoopOutcome::Diverged { .. } => f64::INFINITY,
            LoopOutcome::Finished => over_joints(rmse),
        }
    }

    /// The root mean square of the error over all joints in each part of the motion.
    pub(super) fn parts(&self) -> Vec<f64> {
        let part = |k| over_joints(&self.followed.part(k, PARTS, &[]).rmse);
        (0..PARTS).map(part).collect()
    }

    pub(super) fn as_json(&self) -> serde_json::Value {
        let driven = &self.followed.driven;
        json!({
            "rmse": self.followed.following.rmse,
            "largest": self.followed.following.largest,
            "at_limit": self.followed.following.at_limit,
            "latency": driven.latency.quantiles(),
            "parts": self.parts(),
            "online": self.followed.record,
            "real_time": self.real_time,
            "ending": driven.outcome,
            "without_model": self.followed.without_model,
            "not_finite": driven.not_finite,
        })
    }
}

/// When a learned model came to drive.
fn learned(name: &str, record: &Record) -> String {
    let first = |event: &&Event| event.kind == EventKind::FirstModel;
    match record.events.iter().find(first) {
        Some(Event { t, .. }) => format!(
            "{name} drives from {t:.2} s on; before, feedback alone; renewed {} times",
            record.handed_over.saturating_sub(1)
        ),
        None => format!("{name} never predicted well enough to drive: feedback alone did"),
    }
}

fn over_joints(rmse: &[f64]) -> f64 {
    (lagrangian::mechanics::dot(rmse, rmse) / rmse.len() as f64).sqrt()
}
