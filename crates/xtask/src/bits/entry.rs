//! What a run of the command leaves: its exit code, its figures, the bits of its weights and of its files.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::line::{Bench, Line, hash};

/// Figures that depend on the clock, names of files, units, and how a fit began and ended.
const LEFT_OUT: [&str; 15] = [
    "seconds",
    "train_seconds",
    "out",
    "report",
    "model",
    "plot",
    "gif",
    "pictures",
    "files",
    "command",
    "latency",
    "path",
    "unit",
    "estimates",
    "ending",
];

/// Numbers of an array that are recorded one by one; longer arrays are recorded by a hash.
const NUMBERS: usize = 8;

/// Length of the figures that are recorded in full; longer ones are recorded by a hash for each key.
const FIGURES: usize = 1500;

/// Runs a line and gathers what it leaves.
pub(super) fn of(bench: &Bench, line: &Line) -> Result<Value, String> {
    let run = line.run(bench)?;
    let mut entry = Map::new();
    entry.insert("exit".into(), json!(run.status.code()));
    if let Ok(figures) = serde_json::from_slice(&run.stdout) {
        entry.insert("figures".into(), bounded(&figures));
    }
    let output = bench.folder.join(line.output());
    if let Ok(bytes) = fs::read(output.join("model.safetensors")) {
        entry.insert("weights".into(), json!(weights(&bytes)?));
    } else if let Some(rows) = rows(&output) {
        entry.insert("rows".into(), json!(rows));
    }
    Ok(Value::Object(entry))
}

/// Figures of bounded length.
fn bounded(figures: &Value) -> Value {
    let figures = figures_of(figures).unwrap_or(Value::Null);
    match figures {
        Value::Object(all) if length(&all) > FIGURES => all
            .into_iter()
            .map(|(key, value)| {
                let text = value.to_string();
                let short = text.len() <= FIGURES / 4;
                (key, if short { value } else { json!(name(&text)) })
            })
            .collect(),
        figures => figures,
    }
}

fn length(figures: &Map<String, Value>) -> usize {
    figures.values().map(|value| value.to_string().len()).sum()
}

/// The figures alone, to the last bit: no times, paths and sentences.
fn figures_of(value: &Value) -> Option<Value> {
    match value {
        Value::String(text) if is_sentence(text) => None,
        Value::Array(items) => {
            let items: Value = items.iter().filter_map(figures_of).collect();
            Some(shortened(items))
        }
        Value::Object(all) => Some(
            all.iter()
                .filter(|(key, _)| !LEFT_OUT.contains(&key.as_str()))
                .filter_map(|(key, value)| Some((key.clone(), figures_of(value)?)))
                .collect(),
        ),
        other => Some(other.clone()),
    }
}

/// A sentence or a path; a word or a number is a figure.
fn is_sentence(text: &str) -> bool {
    text.contains([' ', '/', '.']) && text.parse::<f64>().is_err()
}

/// A long array by its length and a hash.
fn shortened(items: Value) -> Value {
    let count = items.as_array().map_or(0, Vec::len);
    let flat = items[0].is_number() || items[0].is_array() || items[0].is_null();
    if flat && count > NUMBERS {
        return json!(format!("{count} × {}", name(&items.to_string())));
    }
    items
}

fn name(text: &str) -> String {
    format!("{:016x}", hash(text.as_bytes()))
}

/// A hash of the tensors of a model, whatever their names and order.
fn weights(bytes: &[u8]) -> Result<String, String> {
    let broken = "a saved model is not in the format safetensors";
    let (length, rest) = bytes.split_first_chunk::<8>().ok_or(broken)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| broken)?;
    let (header, data) = rest.split_at_checked(length).ok_or(broken)?;
    let header: Map<String, Value> = serde_json::from_slice(header).map_err(|_| broken)?;
    let tensors = header.iter().filter(|(name, _)| *name != "__metadata__");
    let mut hashes = tensors
        .map(|(_, tensor)| {
            let end = |k: usize| usize::try_from(tensor["data_offsets"][k].as_u64()?).ok();
            Some(hash(data.get(end(0)?..end(1)?)?))
        })
        .collect::<Option<Vec<u64>>>()
        .ok_or(broken)?;
    hashes.sort_unstable();
    let all: Vec<u8> = hashes.iter().flat_map(|h| h.to_le_bytes()).collect();
    Ok(format!("{} × {:016x}", hashes.len(), hash(&all)))
}

/// A hash of the rows of a file of text, without the names of its columns.
fn rows(path: &Path) -> Option<String> {
    let csv = path.extension().is_some_and(|e| e == "csv");
    let text = fs::read_to_string(path).ok().filter(|_| csv)?;
    let (_, rows) = text.split_once('\n')?;
    Some(format!("{} × {}", rows.lines().count(), name(rows)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_lose_times_paths_and_sentences_alone() {
        let given = json!({
            "seconds": 3.5, "out": "run", "loss": 0.1, "verdict": "pass", "finding": "All is well.",
            "energy": vec![0.5; 9], "items": [{ "values": { "lag_s": 1e-3 }, "remedy": null }],
        });
        let kept = bounded(&given);
        let keys: Vec<&String> = kept
            .as_object()
            .map(|o| o.keys().collect())
            .unwrap_or_default();
        assert_eq!(keys, ["energy", "items", "loss", "verdict"]);
        assert_eq!(kept["items"][0]["values"]["lag_s"], 1e-3);
        assert!(
            kept["energy"]
                .as_str()
                .is_some_and(|e| e.starts_with("9 × "))
        );
    }

    #[test]
    fn weights_are_known_whatever_their_names_and_their_order() -> Result<(), String> {
        let model = |header: &str, data: &[u8]| {
            let length = (header.len() as u64).to_le_bytes();
            weights(&[&length, header.as_bytes(), data].concat())
        };
        let one = model(
            r#"{"a":{"data_offsets":[0,1]},"b":{"data_offsets":[1,3]}}"#,
            &[1, 2, 3],
        )?;
        let other = model(
            r#"{"x":{"data_offsets":[0,2]},"y":{"data_offsets":[2,3]},"__metadata__":{}}"#,
            &[2, 3, 1],
        )?;
        assert_eq!(one, other);
        let changed = model(r#"{"a":{"data_offsets":[0,3]}}"#, &[1, 2, 3])?;
        assert_ne!(one, changed);
        assert!(weights(b"short").is_err());
        Ok(())
    }
}
