//! Quantities of the links and joints of a robot, as tables.

use std::iter;

use lagrangian::rigid::{PartChange, Quantity};
use lagrangian_report::Table;
use lagrangian_report::draw::short;

/// The quantities of a link or joint with their standard errors, and their values where these were identified.
pub(crate) fn table(part: &PartChange, is_identified: bool) -> Table {
    let caption = match part.fixed.is_empty() {
        true => part.name.clone(),
        false => format!("{} (with {})", part.name, part.fixed.join(", ")),
    };
    let row = |q: &Quantity| {
        let values = [q.before.map_or_else(|| "–".into(), short), short(q.after)];
        let values = values.into_iter().filter(|_| is_identified);
        let known = match q.is_determined() {
            true => [
                short(q.standard_error),
                format!("{:.0} %", 100.0 * q.determined),
            ],
            false if is_identified => ["–".into(), "no: value of the prior".into()],
            false => ["–".into(), "no".into()],
        };
        let named = iter::once(q.name.to_string()).chain(values);
        named.chain([q.unit.into()]).chain(known).collect()
    };
    let values = ["before", "after"].into_iter().filter(|_| is_identified);
    let header = iter::once("quantity").chain(values);
    let header: Vec<&str> = header
        .chain(["unit", "standard error", "determined"])
        .collect();
    Table::new(caption, &header, part.quantities.iter().map(row).collect())
}
