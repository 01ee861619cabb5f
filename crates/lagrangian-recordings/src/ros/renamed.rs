//! Detection of the first message of a topic that names other joints.
//!
//! Messages of other joints among those that are read come from other publishers, and are not a fault. A message with only some of the
//! joints that are read is a fault, and so is an end after which the joints that are read do not return.

use super::super::Renamed;

/// A final run this many times as long as the longest earlier run of omitted messages is not a pause.
const PAUSE: usize = 10;

/// Tracks the messages that are omitted.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// The first message with only some of the joints.
    torn: Option<Renamed>,
    /// The first message of the current run of omitted ones, and the length of the run.
    run: Option<Renamed>,
    length: usize,
    /// Length of the longest earlier run of omitted messages.
    longest: usize,
}

impl Watch {
    /// Records that a message was read.
    pub(super) fn read(&mut self) {
        self.longest = self.longest.max(self.length);
        (self.run, self.length) = (None, 0);
    }

    /// Records that a message was omitted because it lacks joints; `has_some`: it has some of those that are read.
    pub(super) fn omitted(&mut self, has_some: bool, what: impl Fn() -> Renamed) {
        self.length += 1;
        if has_some {
            self.torn.get_or_insert_with(&what);
        }
        self.run.get_or_insert_with(what);
    }

    /// The finding for a topic of `messages` messages, of which `omitted` were omitted.
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
