//! The ticks, their thresholds, and what was refused.

use lagrangian::Budget;
use lagrangian_report::{Axis, Table};

use super::columns::{Column, OWN_ENERGY};
use super::contestants::Recipe;
use super::early_end::{FAR, GAIN, GRACE, WITHIN};
use super::{Cell, Plan};
use crate::harness::spread::{median, scientific};
use crate::harness::{Contestant, Lab, line};

/// A change of the energy, in its deviations, after which nothing of it is left.
const LOST: f64 = 10.0;

/// A value with its unit; a relative one in percent.
fn value(column: Column, value: f64) -> String {
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

impl Cell {
    fn value(&self) -> f64 {
        let values = self.measured.iter().filter_map(|m| m.value);
        median(&values.collect::<Vec<_>>())
    }

    /// What most seeds say.
    fn tick(&self) -> bool {
        let ticks = self.measured.iter().filter(|m| m.tick(self.column)).count();
        2 * ticks > self.measured.len()
    }

    fn published(&self) -> Option<bool> {
        let row = self.row.config.published?;
        self.column.published(row)
    }

    /// `✓ 0.3 %`, `✗ 84 %`, `✓`, `✗`; then what is published.
    fn text(&self) -> String {
        let mut text = mark(self.tick()).to_string();
        if self.value().is_finite() {
            text += &format!(" {}", value(self.column, self.value()));
        }
        if let Some(published) = self.published() {
            text += &format!(" ({})", mark(published));
        }
        text
    }
}

fn header(names: [&str; 3]) -> Vec<String> {
    names.map(str::to_string).to_vec()
}

fn ticks(plan: &Plan, cells: &[Cell]) -> Table {
    let columns = plan.columns.iter().map(|c| c.name().to_string());
    let row = |row: &&'static Contestant<Recipe>| {
        let of = |column: &Column| {
            let mut cells = cells.iter();
            let cell = cells.find(|c| c.row.key == row.key && c.column == *column);
            cell.map_or("–".into(), Cell::text)
        };
        line(row.name, plan.columns.iter().map(of))
    };
    Table {
        caption: "✓ or ✗ by the thresholds below, with the value that it follows from (median of the seeds); in brackets what \
                  Cranmer et al. 2020 (table 1) say of such a model."
            .into(),
        header: line("model", columns),
        rows: plan.rows.iter().map(row).collect(),
        ..Table::default()
    }
}

fn thresholds(plan: &Plan) -> Table {
    let row = |column: &Column| {
        let threshold = match column.threshold() {
            None => "accepted".into(),
            Some(threshold) => format!("≤ {}", value(*column, threshold)),
        };
        header([column.name(), column.meaning(), &threshold])
    };
    Table {
        caption: "What each column measures, and from where on it is ticked.".into(),
        header: header(["column", "value", "✓ where"]),
        rows: plan.columns.iter().map(row).collect(),
        ..Table::default()
    }
}

/// Cells that say otherwise than the publication, and those where a fit was refused.
fn remarks(cells: &[Cell]) -> Table {
    let row = |cell: &Cell| {
        let note = cell.measured.iter().find_map(|m| m.note.clone());
        let other = cell.published().filter(|known| *known != cell.tick());
        let other = other.zip(cell.row.config.published);
        let other =
            other.map(|(known, row)| format!("published: {} for {}", mark(known), row.name));
        let remark: Vec<String> = other.into_iter().chain(note).collect();
        let (model, column) = (cell.row.name.to_string(), cell.column.name().to_string());
        (!remark.is_empty()).then(|| vec![model, column, cell.text(), remark.join("; ")])
    };
    Table {
        caption: "Where the value says otherwise than the publication (often a fit that is too short for the threshold; else a \
                  model that is not the published one, as a plain network of q̈, which is continuous in time), and what was \
                  refused, with the reason. `--only ROW:COLUMN` measures a cell again."
            .into(),
        header: line("model", header(["property", "here", "remark"]).into_iter()),
        rows: cells.iter().filter_map(row).collect(),
        ..Table::default()
    }
}

fn budget(budget: Budget) -> String {
    match budget {
        Budget::Steps(steps) => format!("{steps} steps"),
        Budget::Seconds(seconds) => format!("{} s", scientific(seconds)),
    }
}

/// The families whose learning is drawn.
const DRAWN: [&str; 7] = ["lnn", "delan", "hnn", "neural-ode", "vin", "flow", "mlp"];

/// The tables of ticks, the settings, and the error of q̈ over the steps of the fits to the double pendulum.
pub(super) fn complete(lab: &mut Lab, plan: &Plan, cells: &[Cell]) {
    lab.results
        .tables
        .extend([ticks(plan, cells), thresholds(plan), remarks(cells)]);
    lab.setting("Budget of a fit", budget(plan.budget));
    let longest = budget(plan.longest);
    lab.setting("Budget, double pendulum without noise", longest);
    let pieces = format!("{} of five samples", plan.size.train);
    lab.setting("Pieces of motion", pieces);
    let (count, seconds) = plan.long;
    let long = format!("{count} of {seconds} s; own energy kept to {OWN_ENERGY:e}");
    lab.setting("Long motions", long);
    lab.setting(
        "Ended early",
        format!(
            "fits whose loss is above {} % of that of predicting nothing and falls by less than {} % in {} % of the budget, \
             after {} % of it",
            100.0 * FAR,
            100.0 * GAIN,
            100.0 * WITHIN,
            100.0 * GRACE
        ),
    );
    let drawn = |c: &&Cell| c.column == Column::Training && DRAWN.contains(&c.row.key);
    for cell in cells.iter().filter(drawn) {
        let history = cell.measured.first().map_or(&[][..], |m| &m.history);
        if history.is_empty() {
            continue;
        }
        let points = history.iter().map(|(step, e)| (*step as f64, 100.0 * e));
        let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
        let caption = "Error of q̈ on held-out motions by the best weights so far; one seed. A tick is a cut through \
                           this figure: at 5 % and at the last step.";
        lab.plot("learning", "Learning the double pendulum")
            .caption(caption)
            .x(Axis::log("steps of the natural gradient", ""))
            .y(Axis::log("error of q̈", "%"))
            .add(cell.row.name, cell.row.role, &x, y);
    }
}
