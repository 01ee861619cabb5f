//! Messages to rows: the numbers of the joints that are used, each where its column stands.

use super::super::Readings;
use super::super::columns::Resolved;
use super::super::rows::Rows;
use super::cdr::JointState;
use super::joints::Joints;
use super::survey::{Field, Survey};
use crate::{Error, Result};

/// Makes a row of each message that has all joints; counts the others.
pub(super) struct Sorter {
    joints: Joints,
    stamped: bool,
    /// What stands in each column that is used.
    fields: Vec<Field>,
    values: Vec<f64>,
    rows: Rows,
    pub(super) messages: usize,
    omitted: usize,
    /// The time of the first row, ns: t counts from it, which keeps every digit of a stamp.
    start: Option<i64>,
}

impl Sorter {
    /// For the columns `resolved` among all `fields` of a topic.
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
            start: None,
        }
    }

    /// Takes a message that the recorder received at `log_time`, ns.
    pub(super) fn take(&mut self, state: &JointState<'_>, log_time: i64) -> Result<()> {
        self.messages += 1;
        self.joints.follow(&state.names);
        if !self.has_all_joints(state) {
            self.omitted += 1;
            return Ok(());
        }
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

    /// Whether a message has the positions of all joints that are used.
    fn has_all_joints(&self, state: &JointState<'_>) -> bool {
        let has = |field: &Field| match *field {
            Field::Time => true,
            Field::Position(joint) | Field::Velocity(joint) | Field::Effort(joint) => {
                self.joints.at(joint).is_some()
            }
        };
        !state.position.is_empty() && self.fields.iter().all(has)
    }

    /// The rows, and notes of what was omitted after those that are there.
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
        let readings = self.rows.finish()?;
        Ok(Readings { notes, ..readings })
    }
}
