//! The joints of a topic by name, independent of their order in a message.

use std::collections::HashMap;

/// The joints that messages name, in the order of their first appearance.
#[derive(Debug, Default)]
pub(super) struct Joints {
    pub(super) names: Vec<String>,
    numbers: HashMap<String, usize>,
    /// The names of the last message.
    last: Vec<String>,
    /// Index of each joint in the last message.
    at: Vec<Option<usize>>,
}

impl Joints {
    /// Finds the joints of a message, for use by [`Joints::at`].
    pub(super) fn follow(&mut self, names: &[&str]) {
        if self.last == names {
            return;
        }
        self.at.fill(None);
        for (place, name) in names.iter().enumerate() {
            let joint = self.number(name);
            self.at[joint] = Some(place);
        }
        self.last = names.iter().map(ToString::to_string).collect();
    }

    fn number(&mut self, name: &str) -> usize {
        if let Some(&joint) = self.numbers.get(name) {
            return joint;
        }
        let joint = self.names.len();
        self.names.push(name.into());
        self.numbers.insert(name.into(), joint);
        self.at.push(None);
        joint
    }

    /// Index of a joint in the last message, if it is present.
    pub(super) fn at(&self, joint: usize) -> Option<usize> {
        self.at[joint]
    }
}
