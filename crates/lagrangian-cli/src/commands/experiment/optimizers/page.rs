//! The tables and the page of the optimisers.

use lagrangian::experiment::optimizers::{Group, Run};
use lagrangian::report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::found::{Found, Line, SHARES, ends, winners};
use super::{Plan, clock};
use crate::commands::experiment::spread::{cell, median, scientific, seeds};

/// Points of a curve over time.
const POINTS: u32 = 60;

/// Roles of the recipes of a figure beside the default.
const ROLES: [Role; 7] = [
    Role::Other(0),
    Role::Other(1),
    Role::Other(2),
    Role::Other(3),
    Role::Other(4),
    Role::Baseline,
    Role::Truth,
];

fn header(found: &Found) -> Vec<String> {
    let shares = SHARES.map(|share| format!("{} s", scientific(share * found.seconds)));
    let mut header = vec!["recipe".to_string(), "ms a step".into()];
    header.extend(shares);
    header.push(format!(
        "whole run in {} s",
        scientific(0.25 * found.seconds)
    ));
    header.push(format!("{} steps", found.steps));
    header
}

fn row(line: &Line, seconds: f64) -> Vec<String> {
    let mut row = vec![line.recipe.name.to_string(), scientific(line.ms())];
    for share in SHARES {
        let errors = line.after(share, seconds);
        row.push(match share < 1.0 {
            true => scientific(median(&errors)),
            false => cell(&errors),
        });
    }
    row.push(scientific(median(&ends(&line.runs.quarter))));
    row.push(scientific(median(&ends(&line.runs.steps))));
    row
}

fn caption(found: &Found) -> String {
    let unit = match found.task.unit {
        "" => String::new(),
        unit => format!(", {unit}"),
    };
    format!(
        "{}: {} on what was not seen{unit}, of the best weights so far; medians of {}, at the end with (least … largest). \
         Seconds: {}.",
        found.task.name,
        found.task.error,
        seeds(found.lines.first().map_or(0, |l| l.runs.whole.len())),
        clock::NAME
    )
}

fn table(found: &Found) -> Table {
    let rows = found.lines.iter().map(|line| row(line, found.seconds));
    Table {
        caption: caption(found),
        header: header(found),
        rows: rows.collect(),
    }
}

/// The table as it stands in a document.
pub(super) fn markdown(found: &Found) -> String {
    let table = table(found);
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = vec!["---".to_string(); table.header.len()];
    let rows: String = table.rows.iter().map(|row| line(row)).collect();
    format!(
        "{}\n\n{}{}{rows}",
        table.caption,
        line(&table.header),
        line(&rule)
    )
}

/// A row for each recipe, and the error at the end on each task.
pub(super) fn summary(found: &[Found]) -> Table {
    let mut header = vec!["recipe".to_string()];
    header.extend(found.iter().map(|f| {
        let seconds = scientific(f.seconds);
        format!("{}, {seconds} s", f.key())
    }));
    let mut rows: Vec<Vec<String>> = Vec::new();
    for line in found.iter().flat_map(|f| &f.lines) {
        if rows.iter().any(|row| row[0] == line.recipe.name) {
            continue;
        }
        let of = |f: &Found| {
            let own = f.lines.iter().find(|l| l.recipe.key == line.recipe.key);
            own.map_or("–".into(), |l| cell(&ends(&l.runs.whole)))
        };
        let mut row = vec![line.recipe.name.to_string()];
        row.extend(found.iter().map(of));
        rows.push(row);
    }
    Table {
        caption: "Error on what was not seen after the whole time; median (least … largest) of the seeds.".into(),
        header,
        rows,
    }
}

/// The curves of a group beside that of the default.
fn figure(found: &Found, group: Group) -> Option<Figure> {
    let own: Vec<&Line> = found
        .lines
        .iter()
        .filter(|l| l.recipe.group == group)
        .collect();
    // The default stands in every other figure.
    let alone = own.len() == found.lines.len();
    if own.is_empty() || (group == Group::Default && !alone) {
        return None;
    }
    let default = found.default().filter(|_| group != Group::Default);
    let first = match group {
        Group::Default => Role::Lnn,
        _ => ROLES[0],
    };
    let roles = std::iter::once(first).chain(ROLES.into_iter().skip(1).cycle());
    let series = default.map(|line| (line, Role::Lnn));
    let series = series.into_iter().chain(own.into_iter().zip(roles));
    Some(Figure {
        id: format!("{}-{}", found.key(), group.name().replace(' ', "-")),
        title: format!("{}: {}", found.key(), group.name()),
        caption: format!(
            "{} of the best weights so far over training time ({}): median of the seeds and their range.",
            found.task.error,
            clock::NAME
        ),
        x: Axis::log("training time", "s"),
        y: Axis::log(found.task.error, found.task.unit),
        series: series
            .map(|(line, role)| curve(line, role, found.seconds))
            .collect(),
    })
}

fn curve(line: &Line, role: Role, seconds: f64) -> Series {
    let first = 0.02 * seconds;
    let at = |k: u32| first * (seconds / first).powf(f64::from(k) / f64::from(POINTS - 1));
    let grid: Vec<f64> = (0..POINTS).map(at).collect();
    let along = |run: &Run| -> Vec<f64> {
        let mut errors: Vec<f64> = grid.iter().map(|t| run.at_seconds(*t)).collect();
        // The last step ends behind the budget.
        if let Some(last) = errors.last_mut() {
            *last = run.error();
        }
        errors
    };
    let runs: Vec<Vec<f64>> = line.runs.whole.iter().map(along).collect();
    Series::range(line.recipe.name, role, grid, &runs)
}

/// Who wins, in sentences.
fn sentences(found: &[Found]) -> Vec<String> {
    let mut all: Vec<String> = found
        .iter()
        .filter_map(|f| {
            let (best, default) = (f.best()?, f.default()?);
            Some(format!(
                "{}: least error by \"{}\", {}; by the default {}. Better than the default for every seed: {}.",
                f.task.name,
                best.recipe.name,
                scientific(median(&ends(&best.runs.whole))),
                scientific(median(&ends(&default.runs.whole))),
                named(f.better())
            ))
        })
        .collect();
    if found.iter().filter(|f| !f.wide).count() > 1 {
        all.push(format!(
            "Better than the default for every seed on both tasks at width 64: {}.",
            named(winners(found))
        ));
    }
    all
}

fn named(keys: Vec<&str>) -> String {
    match keys.is_empty() {
        true => "none".into(),
        false => keys.join(", "),
    }
}

pub(super) fn report(plan: &Plan, found: &[Found]) -> Report {
    let headline = |f: &Found| {
        let best = f.best()?;
        Some(Headline {
            label: format!("{}, {} s", f.key(), scientific(f.seconds)),
            value: scientific(median(&ends(&best.runs.whole))),
            unit: f.task.unit.into(),
            note: match f.default() {
                Some(default) => format!(
                    "{}; default {}",
                    best.recipe.name,
                    scientific(median(&ends(&default.runs.whole)))
                ),
                None => best.recipe.name.into(),
            },
            role: Some(Role::Lnn),
        })
    };
    let figures = found
        .iter()
        .flat_map(|f| Group::ALL.map(|group| figure(f, group)))
        .flatten();
    Report {
        title: "Optimisers".into(),
        subtitle: "Error over training time of many recipes, on equal data with equal clocks"
            .into(),
        headlines: found.iter().filter_map(headline).collect(),
        summary: sentences(found),
        figures: figures.collect(),
        tables: found.iter().map(table).collect(),
        settings: vec![
            ("Clock".into(), clock::NAME.into()),
            (
                "Schedules".into(),
                "follow the share of the budget; rates fall by a cosine".into(),
            ),
            (
                "Time of a run".into(),
                format!(
                    "{} s, wide networks {} times as long",
                    plan.seconds, plan.wide
                ),
            ),
        ],
        ..Report::default()
    }
}
