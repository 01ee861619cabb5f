//! Where the messages of a topic begin to name other joints.
//!
//! Messages of other joints between those that are read come from other publishers, and are no fault. A message that has some of the
//! joints that are read and lacks others is one, and so is an end after which the joints that are read do not return.

use super::super::Renamed;

/// So many times as many messages at the end as were ever omitted in a row before it are no pause.
const PAUSE: usize = 10;

/// Watches which messages are omitted.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// The first message that has some of the joints.
    torn: Option<Renamed>,
    /// The first message of those that are omitted now, and how many these are.
    run: Option<Renamed>,
    length: usize,
    /// The most messages that were omitted in a row before.
    longest: usize,
}

impl Watch {
    /// A message was read.
    pub(super) fn read(&mut self) {
        self.longest = self.longest.max(self.length);
        (self.run, self.length) = (None, 0);
    }

    /// A message was omitted, as it lacks joints; `has_some` of those that are read.
    pub(super) fn omitted(&mut self, has_some: bool, what: impl Fn() -> Renamed) {
        self.length += 1;
        if has_some {
            self.torn.get_or_insert_with(&what);
        }
        self.run.get_or_insert_with(what);
    }

    /// What is to be said of a topic with so many messages, of which so many were omitted.
    pub(super) fn finish(self, omitted: usize, messages: usize) -> Option<Renamed> {
        let ended = self.length > PAUSE * self.longest.max(1);
        let found = self.torn.or(self.run.filter(|_| ended))?;
        Some(Renamed {
            omitted,
            messages,
            ..found
        })
    }
}
