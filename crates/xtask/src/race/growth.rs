//! Cost against size in double logarithmic plots, and the exponents of its ends.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Value, json};

use super::report::{contestants, escape, legend};
use super::row::Row;
use super::tasks::Task;

/// Where the exponents of all tasks stand in the JSON.
pub(super) const KEY: &str = "growth";

/// Sizes and costs of one contestant, as decimal logarithms.
type Curve = Vec<(f64, f64)>;

/// What is drawn over an axis: a key of the figures beside the times, or the times themselves.
const PEAK: &str = "peak_mib";

/// Cost ∝ sizeᵃ at the small and at the large half of the sizes.
struct Ends {
    lower: f64,
    upper: f64,
}

impl Ends {
    /// Least squares through the halves, which share the point in the middle; none for fewer than three points.
    fn of(curve: &Curve) -> Option<Self> {
        let half = curve.len().div_ceil(2);
        (curve.len() > 2).then(|| Self {
            lower: slope(&curve[..half]),
            upper: slope(&curve[curve.len() - half..]),
        })
    }
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| points.iter().map(pick).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let sums = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2))
    });
    sums.0 / sums.1
}

fn curve(axis: &str, rows: &[&Row], name: &str) -> Curve {
    let point = |row: &&Row| {
        let size = row.sizes.get(axis)?.as_f64()?;
        let cost = match name {
            PEAK => *row.more.get(PEAK)?,
            _ => row.figures.get(name)?.median,
        };
        Some((size.log10(), cost.log10()))
    };
    rows.iter().filter_map(point).collect()
}

/// Rows that differ along the axis alone, with what they have in common.
fn groups<'a>(axis: &str, rows: &'a [Row]) -> BTreeMap<String, Vec<&'a Row>> {
    let mut groups: BTreeMap<String, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let mut rest = row.clone();
        rest.sizes.remove(axis);
        groups.entry(rest.label()).or_default().push(row);
    }
    groups
}

/// The exponents of all contestants of a task, of its times and, for logs, of our memory.
pub(super) fn exponents(task: &Task, rows: &[Row]) -> Value {
    let Some(axis) = task.growth else {
        return json!([]);
    };
    let mut found = Vec::new();
    for rows in groups(axis, rows).values() {
        let mut names: Vec<&str> = contestants(task, rows).iter().map(|(n, _)| *n).collect();
        names.extend(weighs(task).then_some(PEAK));
        for name in names {
            let all = curve(axis, rows, name);
            let (Some(ends), Some(first), Some(last)) = (Ends::of(&all), all.first(), all.last())
            else {
                continue;
            };
            found.push(json!({
                "axis": axis, "contestant": name, "threads": rows[0].sizes.get("threads"),
                "from": 10_f64.powf(first.0).round(), "to": 10_f64.powf(last.0).round(),
                "lower": ends.lower, "upper": ends.upper,
            }));
        }
    }
    json!(found)
}

/// Whether memory grows with the size too: that of a log.
fn weighs(task: &Task) -> bool {
    task.work == "rows"
}

/// Cost against the longest axis, a plot for each set of the other sizes, with the exponents at its ends.
pub(super) fn growth(task: &Task, rows: &[Row]) -> String {
    let Some(axis) = task.long_axis() else {
        return String::new();
    };
    let groups = groups(axis, rows);
    let all: Vec<&Row> = rows.iter().collect();
    let names = contestants(task, &all);
    let mut plots = String::new();
    for (label, rows) in groups.iter().filter(|(_, rows)| rows.len() > 2) {
        plots += &plot((axis, task.how.unit()), label, rows, &names);
        if weighs(task) {
            plots += &plot((axis, "MiB"), label, rows, &[(PEAK, names[0].1)]);
        }
    }
    match plots.is_empty() {
        true => plots,
        false => format!(
            "<h3>Growth with {axis}</h3>{}<div class=\"plots\">{plots}</div>",
            legend(&names)
        ),
    }
}

/// The size of a plot, and where its axes stand.
const W: f64 = 320.0;
const H: f64 = 210.0;
const L: f64 = 48.0;
const B: f64 = 34.0;
/// Room for the exponents.
const R: f64 = 64.0;

/// Decades of both axes.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
}

impl Frame {
    fn around(points: &[(f64, f64)]) -> Self {
        let span = |pick: fn(&(f64, f64)) -> f64| {
            let start = (f64::INFINITY, f64::NEG_INFINITY);
            let range = points.iter().map(pick);
            let (low, high) = range.fold(start, |(a, b), v| (a.min(v), b.max(v)));
            (low.floor(), high.ceil().max(low.floor() + 1.0))
        };
        Self {
            x: span(|p| p.0),
            y: span(|p| p.1),
        }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let part = |v: f64, (low, high): (f64, f64)| (v - low) / (high - low);
        (
            L + (W - L - R) * part(x, self.x),
            (H - B) - (H - B - 20.0) * part(y, self.y),
        )
    }

    fn grid(&self) -> String {
        let mut body = String::new();
        for k in self.y.0 as i32..=self.y.1 as i32 {
            let y = self.at((self.x.0, f64::from(k))).1;
            let _ = write!(
                body,
                "<line x1=\"{L}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\" class=\"grid\"/>\
                <text x=\"{}\" y=\"{:.1}\" class=\"end\">{}</text>",
                W - R,
                L - 4.0,
                y + 4.0,
                power(k)
            );
        }
        for k in self.x.0 as i32..=self.x.1 as i32 {
            let x = self.at((f64::from(k), self.y.0)).0;
            let _ = write!(
                body,
                "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"20\" y2=\"{}\" class=\"grid\"/>\
                <text x=\"{x:.1}\" y=\"{}\" class=\"middle\">{}</text>",
                H - B,
                H - B + 13.0,
                power(k)
            );
        }
        body
    }

    /// A line through the points, with the exponents of both ends.
    fn line(&self, curve: &Curve, colour: &str) -> String {
        let places: Vec<(f64, f64)> = curve.iter().map(|p| self.at(*p)).collect();
        let path: Vec<String> = places
            .iter()
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let mut body = format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            path.join(" ")
        );
        for (x, y) in &places {
            let _ = write!(
                body,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\" fill=\"{colour}\"/>"
            );
        }
        if let (Some(ends), [first, .., last]) = (Ends::of(curve), &places[..]) {
            let _ = write!(
                body,
                "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">{:.2}</text>\
                 <text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">slope {:.2}</text>",
                first.0 + 4.0,
                first.1 - 6.0,
                ends.lower,
                last.0 + 4.0,
                last.1 + 4.0,
                ends.upper
            );
        }
        body
    }
}

fn plot((axis, unit): (&str, &str), label: &str, rows: &[&Row], names: &[(&str, &str)]) -> String {
    let curves: Vec<(Curve, &str)> = names
        .iter()
        .map(|(name, colour)| (curve(axis, rows, name), *colour))
        .collect();
    let all: Vec<(f64, f64)> = curves.iter().flat_map(|(c, _)| c.clone()).collect();
    if all.is_empty() {
        return String::new();
    }
    let frame = Frame::around(&all);
    let lines: String = curves
        .iter()
        .map(|(c, colour)| frame.line(c, colour))
        .collect();
    format!(
        "<figure><svg viewBox=\"0 0 {W} {H}\" width=\"{W}\" height=\"{H}\" role=\"img\">{}{lines}\
         <text x=\"{L}\" y=\"12\">{unit}</text><text x=\"{}\" y=\"{}\" class=\"middle\">{axis}</text></svg>\
         <figcaption>{}</figcaption></figure>",
        frame.grid(),
        0.5 * (L + W - R),
        H - 4.0,
        escape(label)
    )
}

/// The exponents of a race as a table.
pub(super) fn table(race: &Value) -> String {
    let mut out = String::new();
    let tasks = race[KEY].as_object().into_iter().flatten();
    for (task, all) in tasks {
        for found in all.as_array().into_iter().flatten() {
            let number = |key: &str| found[key].as_f64().unwrap_or(f64::NAN);
            let name = found["contestant"].as_str().unwrap_or("?");
            let name = if name == PEAK { "ours, MiB" } else { name };
            out += &format!(
                "| {} | {} {} … {} | {} | {} | {:.2} | {:.2} |\n",
                task.trim_start_matches("growth_").replace('_', " "),
                found["axis"].as_str().unwrap_or("?"),
                number("from"),
                number("to"),
                found["threads"],
                name.replace('_', " "),
                number("lower"),
                number("upper"),
            );
        }
    }
    match out.is_empty() {
        true => out,
        false => format!(
            "\n**how cost grows**: cost ∝ sizeᵃ, a by least squares over the lower and the upper half of the sizes.\n\n\
             | task | size | threads | | a, lower half | a, upper half |\n|---|---|---|---|---|---|\n{out}"
        ),
    }
}

fn power(exponent: i32) -> String {
    format!("10<tspan dy=\"-4\" font-size=\"8\">{exponent}</tspan>")
}

#[cfg(test)]
mod tests {
    use super::super::growing::LNN_BATCH;
    use super::super::row::Figure;
    use super::*;

    /// 1 + b / 100 ms: what a step costs at least, and what each sample adds.
    fn rows() -> Vec<Row> {
        let row = |batch: u64| Row {
            sizes: [
                ("batch".to_owned(), json!(batch)),
                ("threads".to_owned(), json!(1)),
            ]
            .into(),
            figures: [(
                "ours".to_owned(),
                Figure::of(vec![1.0 + batch as f64 / 100.0], 0.0),
            )]
            .into(),
            ..Row::default()
        };
        [1, 10, 100, 1000, 10_000, 100_000, 1_000_000]
            .map(row)
            .into()
    }

    #[test]
    fn the_exponents_are_those_of_both_ends() {
        let found = exponents(&LNN_BATCH, &rows());
        let end = |key: &str| found[0][key].as_f64().unwrap_or(f64::NAN);
        assert!(end("lower") > 0.1 && end("lower") < 0.5, "{found}");
        assert!((end("upper") - 1.0).abs() < 0.05, "{found}");
        assert_eq!((end("from"), end("to")), (1.0, 1e6));
        let text = table(&json!({ KEY: { "growth_lnn_batch": found } }));
        assert!(
            text.contains("| lnn batch | batch 1 … 1000000 | 1 | ours |"),
            "{text}"
        );
        assert!(growth(&LNN_BATCH, &rows()).contains("slope 0.9"));
    }

    #[test]
    fn two_sizes_have_no_exponent() {
        assert_eq!(exponents(&LNN_BATCH, &rows()[..2]), json!([]));
    }
}
