//! The table that can be read at a glance, and what stands behind its cells.

use lagrangian::train::Budget;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::columns::{Column, OWN_ENERGY};
use super::hopeless::{FAR, GAIN, GRACE, WITHIN};
use super::{Cell, Plan};
use crate::commands::experiment::spread::{self, scientific};

/// A change of the energy, in its deviations, after which nothing of it is left.
const LOST: f64 = 10.0;

/// A share in percent, other figures with their unit.
fn figure(column: Column, value: f64) -> String {
    match column {
        Column::Continuous => format!("× {}", scientific(value)),
        // More than all of it: the motion is another one.
        Column::Conservation if value > LOST => "lost".into(),
        Column::Training | Column::Call => format!("{} {}", scientific(value), column.unit()),
        _ => format!("{} %", scientific(100.0 * value)),
    }
}

fn mark(tick: bool) -> &'static str {
    if tick { "✓" } else { "✗" }
}

/// `✓ 0.3 %`, `✗ 84 %`, `✓`, `✗`; behind it what is published.
fn text(cell: &Cell) -> String {
    let value = cell.value();
    let mut text = mark(cell.tick()).to_string();
    if value.is_finite() {
        text += &format!(" {}", figure(cell.column, value));
    }
    if let Some(published) = cell.published() {
        text += &format!(" ({})", mark(published));
    }
    text
}

pub(super) fn summary(plan: &Plan, cells: &[Cell]) -> Table {
    let mut header = vec!["model".to_string()];
    header.extend(plan.columns.iter().map(|c| c.name().to_string()));
    let row = |row: &&super::Contestant| {
        let mut line = vec![row.name.to_string()];
        line.extend(plan.columns.iter().map(|column| {
            let cell = cells
                .iter()
                .find(|c| c.row.key == row.key && c.column == *column);
            cell.map_or("–".into(), text)
        }));
        line
    };
    Table {
        caption: "✓ or ✗ by the thresholds below, with the figure that it follows from (median of the seeds); in brackets what \
                  Cranmer et al. 2020 (table 1) say of such a model."
            .into(),
        header,
        rows: plan.rows.iter().map(row).collect(),
    }
}

fn thresholds(plan: &Plan) -> Table {
    let row = |column: &Column| {
        let threshold = match column.threshold() {
            None => "accepted".into(),
            Some(threshold) => format!("≤ {}", figure(*column, threshold)),
        };
        vec![
            column.name().to_string(),
            column.meaning().to_string(),
            threshold,
        ]
    };
    Table {
        caption: "What each column measures, and from where on it is ticked.".into(),
        header: ["column", "figure", "✓ where"].map(str::to_string).to_vec(),
        rows: plan.columns.iter().map(row).collect(),
    }
}

/// All figures of a cell.
fn details(plan: &Plan, cells: &[Cell]) -> Table {
    let row = |cell: &Cell| {
        let figures: Vec<String> = cell
            .found
            .iter()
            .flat_map(|m| &m.figures)
            .map(|(name, x)| format!("{name} {}", scientific(*x)))
            .collect();
        let mut found = figures.join(", ");
        if let Some(note) = cell.note() {
            if !found.is_empty() {
                found += "; ";
            }
            found += note;
        }
        vec![
            cell.row.key.to_string(),
            cell.column.key().to_string(),
            text(cell),
            found,
            cell.command(plan),
        ]
    };
    Table {
        caption: "Behind the cells: parts of each figure, what was refused and why, and the command that measures it again."
            .into(),
        header: ["row", "column", "cell", "parts", "command"].map(str::to_string).to_vec(),
        rows: cells.iter().map(row).collect(),
    }
}

/// Cells in which we found something else than is published.
fn differences(cells: &[Cell]) -> Table {
    let row = |cell: &Cell| {
        let (row, published) = (cell.row.published?, cell.published()?);
        let said = format!("{} for {}", mark(published), row.name);
        let names = [cell.row.name, cell.column.name()].map(str::to_string);
        let [model, column] = names;
        (published != cell.tick()).then(|| vec![model, column, said, text(cell)])
    };
    Table {
        caption: "Where the figure says otherwise than the publication: often a fit that is too short for the threshold; else a \
                  model that is not the published one, as a plain network of q̈, which is continuous in time."
            .into(),
        header: ["model", "property", "published", "here"]
            .map(str::to_string)
            .to_vec(),
        rows: cells.iter().filter_map(row).collect(),
    }
}

fn budget(budget: Budget) -> String {
    match budget {
        Budget::Steps(steps) => format!("{steps} steps"),
        Budget::Seconds(seconds) => format!("{} s", scientific(seconds)),
    }
}

/// The families whose learning is drawn.
const DRAWN: [(&str, Role); 7] = [
    ("lnn", Role::Lnn),
    ("delan", Role::Other(0)),
    ("hnn", Role::Other(1)),
    ("neural-ode", Role::Other(2)),
    ("vin", Role::Other(3)),
    ("flow", Role::Other(4)),
    ("mlp", Role::Baseline),
];

/// The error of q̈ over the steps of the fits of the first seed to the double pendulum.
fn learning(cells: &[Cell]) -> Option<Figure> {
    let line = |(key, role): (&str, Role)| {
        let own = |c: &&Cell| c.row.key == key && c.column == Column::Training;
        let cell = cells.iter().find(own)?;
        let history = &cell.found.first()?.history;
        let x = history.iter().map(|(step, _)| *step as f64).collect();
        let y = history.iter().map(|(_, error)| 100.0 * error).collect();
        (!history.is_empty()).then(|| Series::line(cell.row.name, role, x, y))
    };
    let series: Vec<Series> = DRAWN.into_iter().filter_map(line).collect();
    (!series.is_empty()).then(|| Figure {
        id: "learning".into(),
        title: "Learning the double pendulum".into(),
        caption: "Error of q̈ on held-out motions by the best weights so far; one seed. A tick is a cut through this figure: at 5 % \
                  and at the last step."
            .into(),
        x: Axis::log("steps of the natural gradient", ""),
        y: Axis::log("error of q̈", "%"),
        series,
    })
}

pub(super) fn report(plan: &Plan, cells: &[Cell]) -> Report {
    let ticks = |column: Column| {
        let all = || cells.iter().filter(|c| c.column == column);
        (all().filter(|c| c.tick()).count(), all().count())
    };
    let headline = |column: Column| {
        let (ticks, all) = ticks(column);
        Headline {
            label: column.name().into(),
            value: ticks.to_string(),
            unit: format!("of {all}"),
            note: "families of models".into(),
            role: Some(Role::Lnn),
        }
    };
    let first = [
        Column::Dynamics,
        Column::Conservation,
        Column::Coordinates,
        Column::Lagrangians,
    ];
    let asked = first.into_iter().filter(|c| plan.asks(&[*c]));
    let summary = vec![
        "Every cell is a measurement; nothing follows from the name of a model. A tick says that the figure is at or below \
         the threshold of its column."
            .to_string(),
    ];
    Report {
        title: "What every family can learn".into(),
        subtitle: format!(
            "{} pieces of motion of five samples; {}",
            plan.size.train,
            match plan.seeds.len() {
                1 => spread::seeds(1),
                count => format!("medians of {}", spread::seeds(count)),
            }
        ),
        headlines: asked.map(headline).collect(),
        summary,
        figures: learning(cells).into_iter().collect(),
        tables: vec![thresholds(plan), differences(cells), details(plan, cells)],
        settings: vec![
            (
                "All networks".into(),
                "2 × 64, natural gradient, batches of 128 samples (64 where a sample gives twice as many equations)"
                    .into(),
            ),
            (
                "Budget of a fit".into(),
                format!(
                    "{}; double pendulum without noise {}",
                    budget(plan.budget),
                    budget(plan.longest)
                ),
            ),
            (
                "Ended early".into(),
                format!(
                    "fits whose loss is above {} % of that of predicting nothing and falls by less than {} % in {} % of the \
                     budget, after {} % of it",
                    100.0 * FAR,
                    100.0 * GAIN,
                    100.0 * WITHIN,
                    100.0 * GRACE
                ),
            ),
            (
                "Long motions".into(),
                format!(
                    "{} of {} s; own energy kept to {OWN_ENERGY:e}",
                    plan.long.0, plan.long.1
                ),
            ),
        ],
        ..Report::default()
    }
}
