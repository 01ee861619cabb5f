//! Two races of one machine: what has become slower than the spread of the laps explains.

use serde_json::Value;

use super::row::{Figure, OURS, Row};
use super::table::{digits, results};

/// A change below this share is not a change: clocks of shared machines drift.
const DRIFT: f64 = 0.10;
/// Spreads that a change must exceed.
const SPREADS: f64 = 3.0;

/// Fails with the names of the rows that became slower.
pub(super) fn regressions(before: &Value, now: &Value) -> Result<(), String> {
    let (old, new) = (results(before), results(now));
    let (mut slower, mut compared) = (Vec::new(), 0);
    for (task, rows) in new {
        let Some((_, old)) = old.iter().find(|(other, _)| other.name == task.name) else {
            continue;
        };
        for row in rows {
            let Some(was) = old.iter().find(|r| r.sizes == row.sizes) else {
                continue;
            };
            compared += 1;
            if let Some(change) = slower_by(was, &row) {
                slower.push(format!(
                    "  {}: {}: {change} {}",
                    task.name,
                    row.label(),
                    task.how.unit()
                ));
            }
        }
    }
    match (compared, slower.is_empty()) {
        (0, _) => Err(
            "--against: the two races have no row in common: run the same tasks and threads".into(),
        ),
        (_, true) => {
            eprintln!("race: none of {compared} rows became slower");
            Ok(())
        }
        _ => Err(format!(
            "{} of {compared} rows became slower:\n{}",
            slower.len(),
            slower.join("\n")
        )),
    }
}

/// How much slower we are, in words. Where the same rivals ran in both races, what they became slower by is taken off:
/// that was the machine.
fn slower_by(was: &Row, now: &Row) -> Option<String> {
    let (old, new) = (was.figures.get(OURS)?, now.figures.get(OURS)?);
    let machine = drift(was, now);
    let growth = new.median / (old.median * machine);
    let noise = |figure: &Figure| figure.spread / figure.median.max(f64::MIN_POSITIVE);
    let allowed = 1.0 + DRIFT.max(SPREADS * (noise(old).powi(2) + noise(new).powi(2)).sqrt());
    (growth > allowed).then(|| {
        format!(
            "{} → {} ({growth:.2} × as long beside its rivals)",
            digits(old.median),
            digits(new.median)
        )
    })
}

/// The geometric mean of what all rivals became slower by; 1 without any.
fn drift(was: &Row, now: &Row) -> f64 {
    let rivals = now.figures.iter().filter(|(name, _)| *name != OURS);
    let logs: Vec<f64> = rivals
        .filter_map(|(name, figure)| Some((figure.median / was.figures.get(name)?.median).ln()))
        .filter(|log| log.is_finite())
        .collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn race(ours: f64, rival: f64) -> Value {
        let row = Row {
            sizes: [("batch".to_owned(), json!(32))].into(),
            figures: [
                (OURS.to_owned(), Figure::of(vec![ours; 3], 0.0)),
                ("best_jax".to_owned(), Figure::of(vec![rival; 3], 0.0)),
            ]
            .into(),
            ..Row::default()
        };
        json!({ "lnn_step": [row.to_json("ms")] })
    }

    #[test]
    fn a_row_that_became_slower_is_named_and_one_on_a_slower_machine_is_not() {
        assert!(regressions(&race(1.0, 4.0), &race(1.05, 4.0)).is_ok());
        assert!(regressions(&race(1.0, 4.0), &race(1.5, 6.0)).is_ok());
        let found = regressions(&race(1.0, 4.0), &race(1.5, 4.0));
        assert!(found.is_err_and(|e| e.contains("lnn-step: batch 32: 1.00 → 1.50 (1.50 ×")));
    }

    #[test]
    fn races_without_a_row_in_common_are_refused() {
        assert!(regressions(&json!({}), &race(1.0, 4.0)).is_err());
    }
}
