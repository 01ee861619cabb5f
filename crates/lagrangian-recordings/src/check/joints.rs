//! Bags whose messages change the joints that they name.

use super::Item;
use crate::Recording;
use lagrangian_motion::error::shortened;

/// An item where messages of a bag begin to name other joints.
pub(super) fn renamed(recording: &Recording) -> Option<Item> {
    let renamed = recording.columns.renamed.as_ref()?;
    let listed = |names: &[String]| shortened(&names.join(", "));
    let instead = match renamed.instead.is_empty() {
        true => String::new(),
        false => format!(", but {}", listed(&renamed.instead)),
    };
    let finding = format!(
        "message {} of {} has no joint {}{instead}: {} messages are omitted",
        renamed.message,
        renamed.messages,
        listed(&renamed.missing),
        renamed.omitted
    );
    let remedy = "if a joint was renamed, give it one name in the whole bag; else choose with `q` the joints that all messages have";
    let item = Item::warn("joints", finding, remedy).value("message", renamed.message as f64);
    Some(item.value("omitted", renamed.omitted as f64))
}
