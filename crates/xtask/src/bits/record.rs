//! The record: an entry for each run of the command.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::options::Options;

/// Entries by their keys.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Record(BTreeMap<String, Value>);

impl Record {
    /// Reads a record.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = fs::read_to_string(path).map_err(|e| fail(&e))?;
        serde_json::from_str(&text).map(Self).map_err(|e| fail(&e))
    }

    /// Writes it, one line for each entry, so that a difference of two records can be read.
    pub(super) fn write(&self, path: &Path) -> Result<(), String> {
        fs::write(path, self.text()).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn text(&self) -> String {
        let lines = self.0.iter().map(|(key, entry)| {
            let key = Value::from(key.as_str());
            format!("{key}: {entry}")
        });
        format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"))
    }

    /// Adds an entry, whose key must be new.
    pub(super) fn insert(&mut self, key: String, entry: Value) -> Result<(), String> {
        match self.0.insert(key.clone(), entry) {
            None => Ok(()),
            Some(_) => Err(format!("two runs are called '{key}'")),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Keeps the entries with some keys.
    pub(super) fn retain(&mut self, keep: impl Fn(&str) -> bool) {
        self.0.retain(|key, _| keep(key));
    }

    /// This record with the entries that were asked for replaced.
    pub(super) fn with(mut self, now: Self, options: &Options) -> Self {
        self.retain(|key| !options.asks(key));
        self.0.extend(now.0);
        self
    }

    /// How an entry differs from the recorded one.
    pub(super) fn change(&self, key: &str, now: &Value) -> Option<String> {
        match self.0.get(key) {
            None => Some(format!("{key}\n  is not recorded")),
            Some(before) if before != now => Some(format!("{key}{}", difference("", before, now))),
            Some(_) => None,
        }
    }

    /// Says how many entries differ from this record, of which those that were run have been printed.
    pub(super) fn compare(&self, now: &Self, options: &Options) -> Result<(), String> {
        let asked = self.0.keys().filter(|key| options.asks(key));
        let missing: Vec<&String> = asked.filter(|key| !now.0.contains_key(*key)).collect();
        for key in &missing {
            println!("{key}\n  is recorded, and was not run");
        }
        let changes = now.0.iter().filter_map(|(key, now)| self.change(key, now));
        match missing.len() + changes.count() {
            0 => Ok(()),
            count => Err(format!(
                "differences from bench/bits.json in {count} entries: mend the change, or, if it is meant, give the reason in \
                 docs/adr/archive/0057-record-of-bits.md and record these entries anew (--record WORD…)"
            )),
        }
    }
}

/// The parts that differ, by their places.
fn difference(place: &str, before: &Value, now: &Value) -> String {
    if let (Value::Object(old), Value::Object(new)) = (before, now) {
        let mut text = String::new();
        let mut keys: Vec<&String> = old.keys().chain(new.keys()).collect();
        keys.sort();
        keys.dedup();
        for key in keys
            .into_iter()
            .filter(|key| old.get(*key) != new.get(*key))
        {
            let (old, new) = (&before[key], &now[key]);
            // Writing to a string cannot fail.
            let _ = write!(text, "{}", difference(&format!("{place}.{key}"), old, new));
        }
        return text;
    }
    format!(
        "\n  {}: {before} recorded, {now} now",
        &place[1.min(place.len())..]
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn record(entries: &[(&str, Value)]) -> Record {
        Record(
            entries
                .iter()
                .map(|(key, entry)| ((*key).into(), entry.clone()))
                .collect(),
        )
    }

    #[test]
    fn a_record_comes_back_from_its_text() {
        let record = record(&[("a \"b\"", json!({ "loss": 0.1 })), ("c", json!(1))]);
        assert_eq!(record.text().lines().count(), 4);
        let back = serde_json::from_str(&record.text()).map(Record).ok();
        assert_eq!(back, Some(record));
    }

    #[test]
    fn a_difference_is_named_by_its_place() {
        let entry = |loss: f64| json!({ "exit": 0, "figures": { "loss": loss } });
        let before = record(&[("a", entry(0.1)), ("b", json!(1))]);
        let change = before.change("a", &entry(0.2));
        let text = "a\n  figures.loss: 0.1 recorded, 0.2 now";
        assert_eq!(change.as_deref(), Some(text));
        assert_eq!(before.change("b", &json!(1)), None);
        let now = record(&[("a", entry(0.2)), ("c", json!(1))]);
        let outcome = before.compare(&now, &Options::default());
        assert!(outcome.is_err_and(|text| text.contains("in 3 entries")));
    }
}
