//! The contents of a topic (joints, signals and stamps) and the columns that a file of them would have.

use super::super::Layout;
use super::super::columns::Resolved;
use super::cdr::JointState;
use super::joints::Joints;
use lagrangian_motion::Signal;

/// Largest number of joints of one topic.
const MOST_JOINTS: usize = 1000;

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Field {
    Time,
    /// Position of the joint with this number; likewise the next two.
    Position(usize),
    Velocity(usize),
    Effort(usize),
}

impl Field {
    /// The joint whose number it is.
    pub(super) fn joint(&self) -> Option<usize> {
        match *self {
            Self::Time => None,
            Self::Position(joint) | Self::Velocity(joint) | Self::Effort(joint) => Some(joint),
        }
    }
}

/// Facts about a topic, from all its messages.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub(super) joints: Joints,
    pub(super) messages: usize,
    /// Whether any message has a time stamp.
    pub(super) stamped: bool,
    /// Number of joints in the first message that names some; they come first.
    first: usize,
    /// Whether a finite velocity, or effort, was recorded for each joint.
    velocities: Vec<bool>,
    efforts: Vec<bool>,
}

impl Survey {
    /// Adds a message; the error describes the fault.
    pub(super) fn take(&mut self, state: &JointState<'_>) -> Result<(), String> {
        self.messages += 1;
        self.stamped |= state.stamp != 0;
        self.joints.follow(&state.names);
        let count = self.joints.names.len();
        if count > MOST_JOINTS {
            return Err(format!(
                "with it, messages name more than {MOST_JOINTS} joints"
            ));
        }
        if self.first == 0 {
            self.first = count;
        }
        self.velocities.resize(count, false);
        self.efforts.resize(count, false);
        for joint in 0..count {
            let Some(at) = self.joints.at(joint) else {
                continue;
            };
            let is_known = |values: &[f64]| values.get(at).is_some_and(|x| x.is_finite());
            self.velocities[joint] |= is_known(&state.velocity);
            self.efforts[joint] |= is_known(&state.effort);
        }
        Ok(())
    }

    /// Names and fields of the columns: the time, a position of each joint under its name, and the recorded
    /// velocities and efforts.
    pub(super) fn columns(&self) -> (Vec<String>, Vec<Field>) {
        let joints = || self.joints.names.iter().enumerate();
        let positions = joints().map(|(joint, name)| (name.clone(), Field::Position(joint)));
        let velocities = joints().filter(|(joint, _)| self.velocities[*joint]);
        let velocities = velocities.map(|(joint, name)| (velocity(name), Field::Velocity(joint)));
        let efforts = joints().filter(|(joint, _)| self.efforts[*joint]);
        let efforts = efforts.map(|(joint, name)| (effort(name), Field::Effort(joint)));
        std::iter::once(("t".into(), Field::Time))
            .chain(positions)
            .chain(velocities)
            .chain(efforts)
            .unzip()
    }

    /// The layout, completed by default columns: all joints of the first message, and their velocities and
    /// efforts if all of them were recorded.
    pub(super) fn completed(&self, layout: &Layout) -> Layout {
        let mut layout = layout.clone();
        let columns = &mut layout.columns;
        if columns.q.is_empty() {
            columns.q = self.joints.names[..self.first].to_vec();
        }
        if columns.qd.is_empty() {
            columns.qd = self.all(&columns.q, &self.velocities, velocity);
        }
        if columns.tau.is_empty() {
            let driven = match layout.actuated.is_empty() {
                true => &columns.q,
                false => &layout.actuated,
            };
            columns.tau = self.all(driven, &self.efforts, effort);
        }
        layout
    }

    /// The columns of a signal of these joints; empty if one of them was not recorded.
    fn all(&self, joints: &[String], recorded: &[bool], column: fn(&str) -> String) -> Vec<String> {
        let has = |name: &String| {
            let joint = self.joints.names.iter().position(|own| own == name);
            joint.is_some_and(|joint| recorded[joint])
        };
        match joints.iter().all(has) {
            true => joints.iter().map(|name| column(name)).collect(),
            false => Vec::new(),
        }
    }

    /// Notes for the user on the topic as a whole.
    pub(super) fn notes(&self) -> Vec<String> {
        let note =
            "no message bears a time stamp: the times at which the recorder received them are used";
        (!self.stamped).then(|| note.into()).into_iter().collect()
    }

    /// Notes on the signals that are not known, with the joints that lack them.
    pub(super) fn omitted(&self, resolved: &Resolved) -> Vec<String> {
        let signals = &resolved.columns.signals;
        let of = |signal: Signal, what: &str, recorded: &[bool]| {
            if !signals.get(signal).is_empty() {
                return None;
            }
            let is_missing = |name: &&String| {
                let joint = self.joints.names.iter().position(|own| own == *name);
                joint.is_some_and(|joint| !recorded[joint])
            };
            let missing: Vec<&str> = signals
                .q
                .iter()
                .filter(is_missing)
                .map(String::as_str)
                .collect();
            let missing = missing.join(", ");
            Some(format!(
                "no {what} of {missing} are recorded: {} is not known",
                signal.name()
            ))
        };
        let velocities = of(Signal::Qd, "velocities", &self.velocities);
        velocities
            .into_iter()
            .chain(of(Signal::Tau, "efforts", &self.efforts))
            .collect()
    }
}

fn velocity(joint: &str) -> String {
    format!("{joint} velocity")
}

fn effort(joint: &str) -> String {
    format!("{joint} effort")
}
