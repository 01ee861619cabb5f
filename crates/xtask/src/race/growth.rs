//! Cost against size in double logarithmic plots.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::report::{contestants, escape, legend};
use super::row::Row;
use super::tasks::Task;

/// Cost against the longest axis, a plot for each set of the other sizes, with the exponents at its upper end.
pub(super) fn growth(task: &Task, rows: &[Row]) -> String {
    let Some(axis) = task.growth() else {
        return String::new();
    };
    let mut groups: BTreeMap<String, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let mut rest = row.clone();
        rest.sizes.remove(axis);
        groups.entry(rest.label()).or_default().push(row);
    }
    let names = contestants(task, rows);
    let plots = groups.iter().filter(|(_, rows)| rows.len() > 2);
    let plots: String = plots
        .map(|(label, rows)| plot((axis, task.how.unit()), label, rows, &names))
        .collect();
    match plots.is_empty() {
        true => plots,
        false => format!(
            "<h3>Growth with {axis}</h3>{}<div class=\"plots\">{plots}</div>",
            legend(&names)
        ),
    }
}

fn plot((axis, unit): (&str, &str), label: &str, rows: &[&Row], names: &[(&str, &str)]) -> String {
    const W: f64 = 300.0;
    const H: f64 = 210.0;
    const L: f64 = 48.0;
    const B: f64 = 34.0;
    let curve = |name: &str| -> Vec<(f64, f64)> {
        let point = |row: &&Row| {
            Some((
                row.sizes.get(axis)?.as_f64()?.log10(),
                row.figures.get(name)?.median.log10(),
            ))
        };
        rows.iter().filter_map(point).collect()
    };
    let all: Vec<(f64, f64)> = names.iter().flat_map(|(name, _)| curve(name)).collect();
    let span = |pick: fn(&(f64, f64)) -> f64| {
        let range = all
            .iter()
            .map(pick)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
        (range.0.floor(), range.1.ceil().max(range.0.floor() + 1.0))
    };
    let ((x0, x1), (y0, y1)) = (span(|p| p.0), span(|p| p.1));
    let at = |(x, y): (f64, f64)| {
        (
            L + (W - L - 60.0) * (x - x0) / (x1 - x0),
            (H - B) - (H - B - 20.0) * (y - y0) / (y1 - y0),
        )
    };
    let mut body = String::new();
    for k in 0..=(y1 - y0) as i32 {
        let y = at((x0, y0 + f64::from(k))).1;
        let _ = write!(
            body,
            "<line x1=\"{L}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\" class=\"grid\"/>\
            <text x=\"{}\" y=\"{:.1}\" class=\"end\">{}</text>",
            W - 60.0,
            L - 4.0,
            y + 4.0,
            power(y0 as i32 + k)
        );
    }
    for k in 0..=(x1 - x0) as i32 {
        let x = at((x0 + f64::from(k), y0)).0;
        let _ = write!(
            body,
            "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"20\" y2=\"{}\" class=\"grid\"/>\
            <text x=\"{x:.1}\" y=\"{}\" class=\"middle\">{}</text>",
            H - B,
            H - B + 13.0,
            power(x0 as i32 + k)
        );
    }
    for (name, colour) in names {
        let points = curve(name);
        let path: Vec<String> = points
            .iter()
            .map(|p| at(*p))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let _ = write!(
            body,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            path.join(" ")
        );
        if let [.., a, b] = points[..] {
            let ((x, y), slope) = (at(b), (b.1 - a.1) / (b.0 - a.0));
            let _ = write!(
                body,
                "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">slope {slope:.2}</text>",
                x + 4.0,
                y + 4.0
            );
        }
    }
    format!(
        "<figure><svg viewBox=\"0 0 {W} {H}\" width=\"{W}\" height=\"{H}\" role=\"img\">{body}\
         <text x=\"{L}\" y=\"12\">{unit}</text><text x=\"{}\" y=\"{}\" class=\"middle\">{axis}</text></svg>\
         <figcaption>{}</figcaption></figure>",
        0.5 * (L + W - 60.0),
        H - 4.0,
        escape(label)
    )
}

fn power(exponent: i32) -> String {
    format!("10<tspan dy=\"-4\" font-size=\"8\">{exponent}</tspan>")
}
