//! One row of a race: sizes, and what each contestant took; flat in JSON, so that anything can read it.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

/// What one contestant took.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Figure {
    /// Median of the laps, in the unit of the task.
    pub(super) median: f64,
    /// Half the distance of the quartiles.
    pub(super) spread: f64,
    /// All laps in the order in which they were run.
    pub(super) laps: Vec<f64>,
    /// Time to compile, ms.
    pub(super) compile_ms: f64,
}

impl Figure {
    pub(super) fn of(laps: Vec<f64>, compile_ms: f64) -> Self {
        let mut sorted = laps.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let at = share * sorted.len().saturating_sub(1) as f64;
            let (low, high) = (at.floor() as usize, at.ceil() as usize);
            let part = at - at.floor();
            (1.0 - part) * sorted.get(low).unwrap_or(&f64::NAN)
                + part * sorted.get(high).unwrap_or(&f64::NAN)
        };
        Self {
            median: quantile(0.5),
            spread: 0.5 * (quantile(0.75) - quantile(0.25)),
            laps,
            compile_ms,
        }
    }
}

/// Sizes, and a figure for each contestant.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Row {
    /// Such as width, batch, precision, threads.
    pub(super) sizes: BTreeMap<String, Value>,
    pub(super) figures: BTreeMap<String, Figure>,
    /// Largest relative difference of what they computed.
    pub(super) disagreement: f64,
    /// What else was measured, such as a share of the peak.
    pub(super) more: BTreeMap<String, f64>,
}

/// The contestant that all others are divided by.
pub(super) const OURS: &str = "ours";

impl Row {
    /// How many times more than ours this contestant took; `None` where one of them was not there.
    pub(super) fn ratio(&self, name: &str) -> Option<f64> {
        Some(self.figures.get(name)?.median / self.figures.get(OURS)?.median)
    }

    /// Flat: `width`, …, `ours_ms`, `best_jax_ms`, `ratio_best_jax`, ….
    pub(super) fn to_json(&self, unit: &str) -> Value {
        let mut flat: Map<String, Value> = self.sizes.clone().into_iter().collect();
        for (name, figure) in &self.figures {
            flat.insert(format!("{name}_{unit}"), json!(figure.median));
            flat.insert(format!("{name}_spread_{unit}"), json!(figure.spread));
            flat.insert(format!("{name}_laps_{unit}"), json!(figure.laps));
            if name != OURS {
                flat.insert(format!("{name}_compile_time"), json!(figure.compile_ms));
                flat.insert(format!("ratio_{name}"), json!(self.ratio(name)));
            }
        }
        for (name, value) in &self.more {
            flat.insert(format!("also_{name}"), json!(value));
        }
        flat.insert("disagreement".into(), json!(self.disagreement));
        Value::Object(flat)
    }

    /// The same back.
    pub(super) fn from_json(value: &Value, unit: &str) -> Option<Self> {
        let (flat, suffix) = (value.as_object()?, format!("_{unit}"));
        let mut row = Self::default();
        for (key, value) in flat {
            if key == "disagreement" {
                row.disagreement = value.as_f64().unwrap_or(f64::NAN);
            } else if let Some(name) = key.strip_prefix("also_") {
                row.more
                    .insert(name.into(), value.as_f64().unwrap_or(f64::NAN));
            } else if let Some(name) = key.strip_suffix(&suffix) {
                let owner = name.trim_end_matches("_spread").trim_end_matches("_laps");
                let figure = row.figures.entry(owner.into()).or_default();
                match value.as_array() {
                    Some(laps) => figure.laps = laps.iter().filter_map(Value::as_f64).collect(),
                    None if name.ends_with("_spread") => figure.spread = value.as_f64()?,
                    None => figure.median = value.as_f64()?,
                }
            } else if let Some(name) = key.strip_suffix("_compile_time") {
                row.figures.entry(name.into()).or_default().compile_ms = value.as_f64()?;
            } else if !key.starts_with("ratio_") {
                row.sizes.insert(key.clone(), value.clone());
            }
        }
        Some(row)
    }

    /// Its sizes in a line.
    pub(super) fn label(&self) -> String {
        let part = |(name, value): (&String, &Value)| match value.as_str() {
            Some(text) => text.to_owned(),
            None => format!("{name} {value}"),
        };
        self.sizes.iter().map(part).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_comes_back_from_its_json_as_it_was() {
        let row = Row {
            sizes: [
                ("width".to_owned(), json!(64)),
                ("precision".to_owned(), json!("f32")),
            ]
            .into(),
            figures: [
                (OURS.to_owned(), Figure::of(vec![1.0, 3.0, 2.0], 0.0)),
                (
                    "best_jax".to_owned(),
                    Figure::of(vec![8.0, 9.0, 7.0], 120.0),
                ),
            ]
            .into(),
            disagreement: 1e-7,
            more: [("share_of_peak".to_owned(), 0.75)].into(),
        };
        let flat = row.to_json("ms");
        assert_eq!(flat["best_jax_ms"], json!(8.0));
        assert_eq!(flat["ratio_best_jax"], json!(4.0));
        assert_eq!(Row::from_json(&flat, "ms"), Some(row));
    }

    #[test]
    fn the_median_and_half_the_distance_of_the_quartiles_are_those_of_the_sorted_laps() {
        let figure = Figure::of(vec![5.0, 1.0, 2.0, 4.0, 3.0], 0.0);
        assert_eq!((figure.median, figure.spread), (3.0, 1.0));
    }
}
