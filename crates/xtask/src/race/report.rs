//! The report: one page without anything from outside, with bars of the ratios, tables, and growth in log–log plots.

use std::fmt::Write;

use serde_json::Value;

use super::growth::growth;
use super::row::{OURS, Row};
use super::table::{also, digits, peers, results, verdict};
use super::tasks::Task;

const STYLE: &str = include_str!("report.css");

/// Colours of contestants, that read apart for colour-blind eyes too.
const COLOURS: [&str; 6] = [
    "#1b6ca8", "#d1642b", "#6a51a3", "#8a8a8a", "#2a8f6a", "#b8860b",
];

/// The whole page.
pub(super) fn page(race: &Value) -> String {
    let machine = &race["machine"];
    let number = |key: &str| digits(machine[key].as_f64().unwrap_or(f64::NAN));
    let parts: String = results(race)
        .iter()
        .map(|(task, rows)| section(task, rows))
        .collect();
    format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Race</title><style>{STYLE}</style>\
         <h1>The race</h1><p>Our library and its peers on the same tasks with the same data, in turns. A ratio says how \
         many times longer (or larger) a peer is than we; bars are logarithmic, from one half; the dashed line is the target.{}</p>\
         <p class=\"fine\">{}, {} cores, {} {}; FMA peak of one core {} GFLOP/s in f32, {} in f64; {}; {}; {} s in all.</p>{parts}</html>\n",
        if race["smoke"] == true {
            " <b>A smoke test: its figures mean nothing.</b>"
        } else {
            ""
        },
        escape(machine["cpu"].as_str().unwrap_or("unknown CPU")),
        machine["cores"],
        escape(machine["system"].as_str().unwrap_or("")),
        escape(machine["architecture"].as_str().unwrap_or("")),
        number("fma_peak_f32_gflops"),
        number("fma_peak_f64_gflops"),
        escape(machine["rustc"].as_str().unwrap_or("unknown rustc")),
        escape(&peers(machine)),
        digits(race["seconds"].as_f64().unwrap_or(f64::NAN)),
    )
}

fn section(task: &Task, rows: &[Row]) -> String {
    let title = escape(task.title);
    let race = match task.growth {
        Some(_) => String::new(),
        None => format!(
            "<p>{}.</p>{}",
            escape(&verdict(task, rows)),
            bars(task, rows)
        ),
    };
    format!(
        "<section><h2>{title}</h2>{race}{}<details><summary>all figures</summary>{}</details></section>",
        growth(task, rows),
        table(task, rows),
    )
}

/// The contestants that were there, ours first, each with its colour.
pub(super) fn contestants(task: &Task, rows: &[&Row]) -> Vec<(&'static str, &'static str)> {
    let all = std::iter::once(OURS)
        .chain(task.rivals.iter().map(|r| r.name))
        .zip(COLOURS);
    all.filter(|(name, _)| rows.iter().any(|r| r.figures.contains_key(*name)))
        .collect()
}

/// Ratios of each row to ours as bars, with the target.
fn bars(task: &Task, rows: &[Row]) -> String {
    const LABEL: f64 = 330.0;
    const WIDTH: f64 = 620.0;
    const LINE: f64 = 14.0;
    let rivals: Vec<_> = contestants(task, &rows.iter().collect::<Vec<_>>())
        .into_iter()
        .filter(|(name, _)| *name != OURS)
        .collect();
    let ratios = rows
        .iter()
        .flat_map(|r| rivals.iter().filter_map(|(name, _)| r.ratio(name)));
    let most = ratios.chain([1.2 * task.target.0]).fold(2.0, f64::max);
    // Logarithmic, from ½.
    let place = |ratio: f64| WIDTH * (2.0 * ratio).max(1.0).ln() / (2.0 * most).ln();
    let (mut y, mut body) = (4.0, String::new());
    for row in rows {
        let text = y + 11.0;
        let _ = write!(
            body,
            "<text x=\"{}\" y=\"{text}\" class=\"end\">{}</text>",
            LABEL - 8.0,
            escape(&row.label())
        );
        for (name, colour) in &rivals {
            let Some(ratio) = row.ratio(name) else {
                continue;
            };
            let (width, height, end) = (place(ratio), LINE - 3.0, LABEL + place(ratio) + 5.0);
            let _ = write!(
                body,
                "<rect x=\"{LABEL}\" y=\"{y}\" width=\"{width:.1}\" height=\"{height}\" fill=\"{colour}\"/>\
                 <text x=\"{end:.1}\" y=\"{:.1}\">{ratio:.1}</text>",
                y + 10.0
            );
            y += LINE;
        }
        y += if rivals.iter().any(|(name, _)| row.ratio(name).is_some()) {
            6.0
        } else {
            LINE
        };
    }
    let mark = |ratio: f64, class: &str| {
        let x = LABEL + place(ratio);
        format!("<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"0\" y2=\"{y}\" class=\"{class}\"/>")
    };
    let lines = mark(1.0, "one") + &mark(task.target.0, "target");
    let height = y + 4.0;
    format!(
        "{}<svg viewBox=\"0 0 1000 {height}\" width=\"1000\" height=\"{height}\" role=\"img\">{body}{lines}</svg>",
        legend(&rivals)
    )
}

pub(super) fn legend(names: &[(&str, &str)]) -> String {
    let item = |(name, colour): &(&str, &str)| {
        format!(
            "<span><i style=\"background:{colour}\"></i>{}</span>",
            name.replace('_', " ")
        )
    };
    format!(
        "<p class=\"legend\">{}</p>",
        names.iter().map(item).collect::<String>()
    )
}

fn table(task: &Task, rows: &[Row]) -> String {
    let names = contestants(task, &rows.iter().collect::<Vec<_>>());
    let sizes: Vec<&String> = rows
        .first()
        .map(|r| r.sizes.keys().collect())
        .unwrap_or_default();
    let head: String = sizes.iter().map(|s| format!("<th>{s}</th>")).collect();
    let columns = names.iter().map(|(n, _)| {
        let compile = if *n == OURS {
            ""
        } else {
            "<th>compile, s</th><th>ratio</th>"
        };
        format!(
            "<th>{}, {}</th><th>±</th>{compile}",
            n.replace('_', " "),
            task.how.unit()
        )
    });
    let mut out = format!(
        "<table><tr>{head}{}<th>disagreement</th><th></th></tr>",
        columns.collect::<String>()
    );
    for row in rows {
        out += "<tr>";
        for size in &sizes {
            let value = row
                .sizes
                .get(*size)
                .map_or(String::new(), |v| v.to_string().replace('"', ""));
            let _ = write!(out, "<td>{}</td>", escape(&value));
        }
        for (name, _) in &names {
            let figure = row.figures.get(*name).cloned().unwrap_or_default();
            let there = |x: f64| {
                if row.figures.contains_key(*name) {
                    digits(x)
                } else {
                    "–".into()
                }
            };
            let _ = write!(
                out,
                "<td>{}</td><td>{}</td>",
                there(figure.median),
                there(figure.spread)
            );
            if *name != OURS {
                let ratio = row.ratio(name).map_or("–".into(), |r| format!("{r:.1}"));
                let _ = write!(
                    out,
                    "<td>{}</td><td>{ratio}</td>",
                    there(1e-3 * figure.compile_ms)
                );
            }
        }
        let _ = write!(
            out,
            "<td>{:.0e}</td><td>{}</td></tr>",
            row.disagreement,
            escape(&also(row).join("; "))
        );
    }
    out + "</table>"
}

pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_page_has_bars_plots_and_nothing_from_outside() {
        let row = |dof: u64, ours: f64| json!({ "width": 64, "dof": dof, "threads": 1, "ours_ms": ours, "best_jax_ms": ours * ours + 1.0 });
        let text =
            page(&json!({ "acceleration": [row(10, 1.0), row(100, 10.0), row(1000, 100.0)] }));
        assert!(text.contains("<rect") && text.contains("slope 1.00"));
        assert!(!text.contains("http") && !text.contains("NaN"));
    }
}
