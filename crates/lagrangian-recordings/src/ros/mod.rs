//! Joint states of ROS 2 bags: a row for each message of one topic, with positions as q, velocities as q̇ and efforts as τ
//! of the joints that are selected by name (feature `ros`).
//!
//! A bag is visited twice: once to list its topics, joints and signals, and once for the rows.

mod cdr;
mod joints;
mod mcap;
mod records;
mod renamed;
mod sorter;
mod sqlite;
mod survey;

use std::collections::BTreeMap;
use std::io::{Read, Seek};

use super::columns::resolve;
use super::{Layout, Readings};
use cdr::JointState;
use lagrangian_motion::error::shortened;
use lagrangian_motion::{Error, Result};
use sorter::Sorter;
use survey::Survey;

/// Type of the messages that are read, and their serialisation.
const JOINT_STATE: &str = "sensor_msgs/msg/JointState";
const ENCODING: &str = "cdr";

/// Largest number of topics that a message lists.
const MOST_LISTED: usize = 40;

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Topic {
    name: String,
    /// The type of its messages.
    kind: String,
    /// Their serialisation.
    encoding: String,
}

impl Topic {
    fn has_joint_states(&self) -> bool {
        self.kind == JOINT_STATE && self.encoding == ENCODING
    }
}

/// A message as it was recorded.
struct Message<'a> {
    /// Time at which the recorder received it, ns.
    log_time: i64,
    data: &'a [u8],
}

/// A container of messages.
trait Bag {
    /// Name of the format in errors.
    const FORMAT: &'static str;

    /// Passes on the messages of the wanted topics, each topic in the order in which it was recorded; returns all
    /// topics.
    fn visit(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        take: &mut dyn FnMut(&Topic, Message<'_>) -> Result<()>,
    ) -> Result<Vec<Topic>>;
}

/// Reads the joint states of a bag in `SQLite`.
///
/// # Errors
/// [`Error::Topic`] where the topic is ambiguous, or its joints never appear together; [`Error::Columns`]
/// for joints that it does not have; [`Error::Malformed`] for a file that is not a bag, or a damaged one.
pub(super) fn read_db3(source: impl Read + Seek, name: &str, layout: &Layout) -> Result<Readings> {
    read(sqlite::Database::open(source)?, name, layout)
}

/// Reads the joint states of a bag in MCAP.
///
/// # Errors
/// As [`read_db3`].
pub(super) fn read_mcap(source: impl Read + Seek, name: &str, layout: &Layout) -> Result<Readings> {
    read(mcap::Log::new(source), name, layout)
}

fn read<B: Bag>(mut bag: B, name: &str, layout: &Layout) -> Result<Readings> {
    let (topic, survey, others) = survey(&mut bag, layout)?;
    let (headers, fields) = survey.columns();
    let mut notes = survey.notes();
    if !others.is_empty() {
        notes.push(format!("topics not used: {}", listed(&others)));
    }
    let layout = survey.completed(layout);
    let resolved = resolve(&headers, &layout)?;
    let omitted = survey.omitted(&resolved);
    let mut sorter = Sorter::new(survey, &fields, resolved, name);
    let wanted = |t: &Topic| t.has_joint_states() && t.name == topic;
    bag.visit(&wanted, &mut |topic, message| {
        let state = decoded::<B>(topic, sorter.messages + 1, &message)?;
        sorter.take(&state, message.log_time)
    })?;
    sorter.finish(&topic, notes.into_iter().chain(omitted).collect())
}

/// The one topic that is read, its contents, and the other topics.
fn survey<B: Bag>(bag: &mut B, layout: &Layout) -> Result<(String, Survey, Vec<Topic>)> {
    let named = |topic: &Topic| layout.topic.as_ref().is_none_or(|name| *name == topic.name);
    let mut surveys: BTreeMap<String, Survey> = BTreeMap::new();
    let wanted = |topic: &Topic| topic.has_joint_states() && named(topic);
    let mut topics = bag.visit(&wanted, &mut |topic, message| {
        let survey = surveys.entry(topic.name.clone()).or_default();
        let number = survey.messages + 1;
        let state = decoded::<B>(topic, number, &message)?;
        let taken = survey.take(&state);
        taken.map_err(|reason| malformed::<B>(topic, number, &reason))
    })?;
    match (surveys.len(), surveys.pop_first()) {
        (1, Some((name, survey))) => {
            topics.retain(|topic| topic.name != name);
            Ok((name, survey, topics))
        }
        (count, _) => Err(no_choice(&topics, count, layout)),
    }
}

/// The error for a bag without a unique topic; `filled` topics have joint states.
fn no_choice(topics: &[Topic], filled: usize, layout: &Layout) -> Error {
    let is_old = |t: &Topic| t.kind == "sensor_msgs/JointState" || t.encoding == "ros1";
    let (finding, remedy) = match &layout.topic {
        Some(name) => (unreadable(topics, name), "name another with `topic`"),
        None if filled > 1 => (
            format!("{filled} topics of the bag hold joint states"),
            "choose one with `topic`",
        ),
        None if topics.iter().any(is_old) => (
            "the messages of the bag are those of ROS 1".into(),
            "convert it to ROS 2 with `rosbags-convert`",
        ),
        None => (
            format!("the bag has no message of type {JOINT_STATE}"),
            "record a topic of joint states, or convert the messages to CSV",
        ),
    };
    Error::Topic {
        finding,
        found: match topics.is_empty() {
            true => "none".into(),
            false => listed(topics),
        },
        remedy: remedy.into(),
    }
}

/// A readable list of topics with their types.
fn listed(topics: &[Topic]) -> String {
    let shown = |t: &Topic| format!("{} ({})", shortened(&t.name), shortened(&t.kind));
    let mut text: Vec<String> = topics.iter().take(MOST_LISTED).map(shown).collect();
    if topics.len() > MOST_LISTED {
        text.push(format!("… {} in all", topics.len()));
    }
    text.join(", ")
}

/// The error for a named topic without joint states.
fn unreadable(topics: &[Topic], name: &str) -> String {
    match topics.iter().find(|t| t.name == name) {
        None => format!("the bag has no topic '{name}'"),
        Some(topic) if topic.has_joint_states() => format!("topic '{name}' has no message"),
        Some(Topic { kind, encoding, .. }) => {
            format!("topic '{name}' holds {kind} ({encoding}), no {JOINT_STATE} ({ENCODING})")
        }
    }
}

fn decoded<'a, B: Bag>(
    topic: &Topic,
    number: usize,
    message: &Message<'a>,
) -> Result<JointState<'a>> {
    JointState::decode(message.data).map_err(|reason| malformed::<B>(topic, number, &reason))
}

fn malformed<B: Bag>(topic: &Topic, number: usize, reason: &str) -> Error {
    let reason = format!("message {number} of '{}': {reason}", shortened(&topic.name));
    Error::malformed(B::FORMAT, reason)
}
