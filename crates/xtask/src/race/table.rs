//! The figures of a race as text and as Markdown.

use std::path::Path;

use serde_json::Value;

use super::all::TASKS;
use super::growth;
use super::row::{Figure, OURS, Row};
use super::tasks::Task;

/// The tasks of a race that has been run, with their rows.
pub(super) fn results(race: &Value) -> Vec<(&'static Task, Vec<Row>)> {
    let rows = |task: &Task| -> Option<Vec<Row>> {
        let list = race.get(task.key())?.as_array()?;
        list.iter()
            .map(|row| Row::from_json(row, task.how.unit()))
            .collect()
    };
    TASKS
        .iter()
        .filter_map(|task| Some((task, rows(task)?)))
        .collect()
}

/// A row in one line.
pub(super) fn line(row: &Row, unit: &str) -> String {
    let figure = |name: &String| {
        let figure = &row.figures[name];
        let ratio = row.ratio(name).filter(|_| name != OURS);
        let ratio = ratio.map_or(String::new(), |r| format!(" ({r:.1} ×)"));
        format!(
            "{} {} {unit}{ratio}",
            name.replace('_', " "),
            digits(figure.median)
        )
    };
    let mut names: Vec<&String> = row.figures.keys().collect();
    names.sort_by_key(|name| (*name != OURS, *name));
    let figures: Vec<String> = names.into_iter().map(figure).chain(also(row)).collect();
    format!("{}: {}", row.label(), figures.join(", "))
}

/// What stands beside the figures: the share of the peak, and how near those came that did not reach a level.
pub(super) fn also(row: &Row) -> Vec<String> {
    let share = row.more.get("share_of_peak");
    let share = share.map(|share| format!("{:.0} % of the peak", 100.0 * share));
    let missed = row.more.iter().filter_map(|(key, least)| {
        let name = key.strip_suffix("_least_error")?;
        let seconds = row.more.get(&format!("{name}_seconds_in_all"))?;
        let there = row.figures.contains_key(name);
        let name = name.replace('_', " ");
        (!there).then(|| format!("{name} came to {least:.1e} in {} s", digits(*seconds)))
    });
    let peak = row
        .more
        .get("peak_mib")
        .filter(|_| row.sizes.contains_key("rows"));
    let peak = peak.map(|mib| format!("{} MiB", digits(*mib)));
    share.into_iter().chain(peak).chain(missed).collect()
}

/// All of it, to be read in a terminal.
pub(super) fn text(race: &Value) -> String {
    let part = |(task, rows): (&Task, Vec<Row>)| {
        let lines: Vec<String> = rows.iter().map(|row| line(row, task.how.unit())).collect();
        format!(
            "{}\n  {}\n  {}\n",
            task.title,
            sentence(task, &rows),
            lines.join("\n  ")
        )
    };
    let parts: Vec<String> = results(race).into_iter().map(part).collect();
    parts.join("\n") + &growth::table(race)
}

/// How many rows reach the target of a task, and between which ratios they lie.
pub(super) fn verdict(task: &Task, rows: &[Row]) -> String {
    let (target, rival) = task.target;
    let ratios: Vec<f64> = rows.iter().filter_map(|row| row.ratio(rival)).collect();
    if ratios.is_empty() {
        return format!("{} was not there", rival.replace('_', " "));
    }
    let (least, most) = ratios
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(*r), b.max(*r)));
    let reached = ratios.iter().filter(|r| **r >= target).count();
    format!(
        "{} over ours: {least:.1} … {most:.1}; {reached} of {} rows reach {target}",
        rival.replace('_', " "),
        ratios.len()
    )
}

/// Puts the tables of a race between the markers of a page.
pub(super) fn update(page: &Path, race: &Value) -> Result<(), String> {
    crate::page::replace(page, "race", &markdown(race))
}

/// The tables for docs/performance.md.
fn markdown(race: &Value) -> String {
    let machine = &race["machine"];
    let mut out = format!(
        "\n{} ({} cores), FMA peak of one core {} GFLOP/s in f32 and {} in f64 in the same run; {}; {}.\n",
        machine["cpu"].as_str().unwrap_or("unknown CPU"),
        machine["cores"],
        digits(machine["fma_peak_f32_gflops"].as_f64().unwrap_or(f64::NAN)),
        digits(machine["fma_peak_f64_gflops"].as_f64().unwrap_or(f64::NAN)),
        machine["rustc"].as_str().unwrap_or("unknown rustc"),
        peers(machine),
    );
    for (task, rows) in results(race) {
        out += &format!(
            "\n**{}**, {}. {}\n\n",
            task.title,
            task.how.unit(),
            sentence(task, &rows)
        );
        out += &table(task, &rows);
    }
    out + &growth::table(race) + "\n"
}

/// The verdict where there is a target.
fn sentence(task: &Task, rows: &[Row]) -> String {
    match task.growth {
        Some(_) => String::new(),
        None => format!("{}.", verdict(task, rows)),
    }
}

/// One table: a line for each row, a column for each size and contestant.
fn table(task: &Task, rows: &[Row]) -> String {
    let sizes: Vec<&String> = rows
        .first()
        .map(|r| r.sizes.keys().collect())
        .unwrap_or_default();
    let names = std::iter::once(OURS).chain(task.names());
    let names: Vec<&str> = names
        .filter(|n| rows.iter().any(|r| r.figures.contains_key(*n)))
        .collect();
    let heads = sizes
        .iter()
        .map(|s| (*s).clone())
        .chain(names.iter().map(|n| n.replace('_', " ")));
    let heads: Vec<String> = heads.chain([String::new()]).collect();
    let mut out = format!(
        "| {} |\n|{}\n",
        heads.join(" | "),
        "---|".repeat(heads.len())
    );
    for row in rows {
        let cell = |name: &&str| match (row.figures.get(*name), row.ratio(name)) {
            (Some(figure), Some(ratio)) if *name != OURS => {
                format!("{} ({ratio:.1} ×)", spread(figure))
            }
            (Some(figure), _) => spread(figure),
            (None, _) => "–".into(),
        };
        let own = sizes.iter().map(|s| {
            row.sizes
                .get(*s)
                .map_or(String::new(), |v| v.to_string().replace('"', ""))
        });
        let cells = own
            .chain(names.iter().map(cell))
            .chain([also(row).join("; ")]);
        let cells: Vec<String> = cells.collect();
        out += &format!("| {} |\n", cells.join(" | "));
    }
    out
}

/// The packages of the peers.
pub(super) fn peers(machine: &Value) -> String {
    let pairs = machine["peers"].as_object().into_iter().flatten();
    let list: Vec<String> = pairs
        .map(|(k, v)| format!("{k} {}", v.as_str().unwrap_or("?")))
        .collect();
    list.join(", ")
}

/// The median with its spread, where there is any: what was done once has none.
fn spread(figure: &Figure) -> String {
    match figure.spread > 0.0 {
        true => format!("{} ± {}", digits(figure.median), digits(figure.spread)),
        false => digits(figure.median),
    }
}

/// Three significant digits.
pub(super) fn digits(x: f64) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let places = 2 - x.abs().max(1e-9).log10().floor() as i32;
    format!("{x:.*}", usize::try_from(places).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::*;

    #[test]
    fn the_tables_of_a_page_are_replaced_between_its_markers_alone() {
        let page = std::env::temp_dir().join(format!("race-{}.md", std::process::id()));
        let race = json!({ "rollout": [{
            "width": 64, "batch": 10, "threads": 1, "precision": "f64",
            "ours_ms": 0.5, "ours_spread_ms": 0.1, "best_jax_ms": 1.0, "best_jax_spread_ms": 0.1,
        }] });
        let before = "above\n<!-- race -->\nold\n<!-- /race -->\nbelow\n";
        assert!(fs::write(&page, before).is_ok());
        assert_eq!(update(&page, &race), Ok(()));
        let text = fs::read_to_string(&page).unwrap_or_default();
        assert!(text.starts_with("above\n") && text.ends_with("\nbelow\n"));
        assert!(text.contains("1.00 ± 0.100 (2.0 ×)") && !text.contains("old"));
        assert!(fs::write(&page, "no markers").is_ok());
        assert!(update(&page, &race).is_err_and(|e| e.contains("lacks the lines")));
        let _ = fs::remove_file(&page);
    }

    #[test]
    fn three_digits_of_small_and_of_large_numbers_are_shown() {
        assert_eq!(digits(0.001_234), "0.00123");
        assert_eq!(digits(12.345), "12.3");
        assert_eq!(digits(12_345.6), "12346");
    }
}
