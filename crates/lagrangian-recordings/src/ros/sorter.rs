//! Conversion of messages to rows: the numbers of the used joints in the order of the columns.

use super::super::columns::Resolved;
use super::super::rows::Rows;
use super::super::{Readings, Renamed};
use super::cdr::JointState;
use super::joints::Joints;
use super::renamed::Watch;
use super::survey::{Field, Survey};
use lagrangian_motion::{Error, Result};

/// Converts each message with all joints to a row; counts the others.
pub(super) struct Sorter {
    joints: Joints,
    stamped: bool,
    /// The field in each used column.
    fields: Vec<Field>,
    values: Vec<f64>,
    rows: Rows,
    pub(super) messages: usize,
    omitted: usize,
    watch: Watch,
    /// Time of the first row, ns: t counts from it, which keeps every digit of a stamp.
    start: Option<i64>,
}

impl Sorter {
    /// A sorter for the columns `resolved` among all `fields` of a topic.
    pub(super) fn new(survey: Survey, fields: &[Field], resolved: Resolved, name: &str) -> Self {
        let fields: Vec<Field> = resolved.numbers.iter().map(|&at| fields[at]).collect();
        Self {
            joints: survey.joints,
            stamped: survey.stamped,
            values: vec![0.0; fields.len()],
            fields,
            rows: Rows::new(resolved, name),
            messages: 0,
            omitted: 0,
            watch: Watch::default(),
            start: None,
        }
    }

    /// Adds a message that the recorder received at `log_time`, ns.
    pub(super) fn take(&mut self, state: &JointState<'_>, log_time: i64) -> Result<()> {
        self.messages += 1;
        self.joints.follow(&state.names);
        if !self.has_all_joints(state) {
            self.omit(state);
            return Ok(());
        }
        self.watch.read();
        let time = if self.stamped { state.stamp } else { log_time };
        let start = *self.start.get_or_insert(time);
        for (value, field) in self.values.iter_mut().zip(&self.fields) {
            let of = |values: &[f64], joint| {
                let at = self.joints.at(joint);
                at.and_then(|at| values.get(at))
                    .copied()
                    .unwrap_or(f64::NAN)
            };
            *value = match *field {
                Field::Time => time.saturating_sub(start) as f64 / 1e9,
                Field::Position(joint) => of(&state.position, joint),
                Field::Velocity(joint) => of(&state.velocity, joint),
                Field::Effort(joint) => of(&state.effort, joint),
            };
        }
        self.rows.push(None, &mut self.values)
    }

    /// Counts an omitted message.
    fn omit(&mut self, state: &JointState<'_>) {
        self.omitted += 1;
        let used: Vec<usize> = self.fields.iter().filter_map(Field::joint).collect();
        let lacks = |joint: &usize| self.joints.at(*joint).is_none();
        if !used.iter().any(lacks) {
            return; // The message has names without positions.
        }
        let has_some = !used.iter().all(lacks);
        let name = |joint: usize| self.joints.names[joint].clone();
        let mut missing: Vec<usize> = used.iter().copied().filter(lacks).collect();
        missing.sort_unstable();
        missing.dedup();
        let number = |own: &str| self.joints.names.iter().position(|name| name == own);
        let is_used = |own: &str| number(own).is_some_and(|joint| used.contains(&joint));
        let others = state.names.iter().filter(|name| !is_used(name));
        self.watch.omitted(has_some, || Renamed {
            message: self.messages,
            missing: missing.iter().copied().map(name).collect(),
            instead: others.clone().map(ToString::to_string).collect(),
            omitted: 0,
            messages: 0,
        });
    }

    /// Whether a message has the positions of all used joints.
    fn has_all_joints(&self, state: &JointState<'_>) -> bool {
        let mut joints = self.fields.iter().filter_map(Field::joint);
        !state.position.is_empty() && joints.all(|joint| self.joints.at(joint).is_some())
    }

    /// The rows, and the given notes with those on omitted messages appended.
    pub(super) fn finish(self, topic: &str, mut notes: Vec<String>) -> Result<Readings> {
        let (omitted, messages) = (self.omitted, self.messages);
        if omitted == messages {
            return Err(Error::Topic {
                finding: format!("no message of '{topic}' has the positions of all chosen joints"),
                found: format!("{topic}, with the joints {}", self.joints.names.join(", ")),
                remedy: "choose joints of one publisher with `q`".into(),
            });
        }
        if omitted > 0 {
            notes.push(format!(
                "{omitted} of {messages} messages of '{topic}' are omitted: they lack positions of some of the joints (all that are named: {}; `q` chooses)",
                self.joints.names.join(", ")
            ));
        }
        let mut readings = self.rows.finish()?;
        let renamed = self.watch.finish(omitted, messages);
        for recording in &mut readings.recordings {
            recording.columns.renamed.clone_from(&renamed);
        }
        Ok(Readings { notes, ..readings })
    }
}
