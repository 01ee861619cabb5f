//! All families against all properties: each cell is measured, and its tick follows from a threshold that is stated.
//!
//! A [`Lesson`] is a known system in a chart with short pieces of its motions to learn from and states to test on; all
//! families get the same. The measurements ask a model for its motion and its energy alone.

mod columns;
mod contestants;
mod early_end;
mod lesson;
mod measure;
mod measuring;
mod page;
mod task;

use anyhow::Result;
use lagrangian::Budget;

use crate::harness::failure::mistake;
use crate::harness::{Contestant, Experiment, Lab};
use columns::{Column, Measured};
use contestants::{CONTESTANTS, Recipe};
use lesson::{Lesson, Reads, Size};
use task::{SAMPLES, Task};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "table",
    about: "what every family of models can learn: a table of measured ticks",
    run,
    parts: Some("ROW, ROW:COLUMN or :COLUMN"),
    title: "What every family can learn",
    text: &[
        "Every cell is a measurement; nothing follows from the name of a model. A tick says that the value is at or below the \
         threshold of its column. All networks: 2 × 64, natural gradient, batches of 128 samples (64 where a sample gives twice \
         as many equations).",
    ],
    quantities: &Column::QUANTITIES,
    about_quantities: "Values of each cell; a dash where nothing could be measured. Ticks and thresholds stand below.",
    ..Experiment::EMPTY
};

/// How much is learned from and tested, and which cells.
struct Plan {
    rows: Vec<&'static Contestant<Recipe>>,
    columns: Vec<Column>,
    budget: Budget,
    /// Budget of a fit to the double pendulum without noise, the hardest lesson.
    longest: Budget,
    size: Size,
    /// Long motions, and how long they are, s.
    long: (usize, f64),
}

impl Plan {
    fn of(lab: &Lab) -> Result<Self> {
        let (rows, columns) = chosen(lab.args.only.as_deref())?;
        let size = |train, held, test| Size { train, held, test };
        Ok(Self {
            rows,
            columns,
            budget: lab.budget(400, 8),
            longest: lab.budget(800, 8),
            size: if lab.quick() {
                size(150, 30, 20)
            } else {
                size(1000, 100, 60)
            },
            long: if lab.quick() { (3, 2.0) } else { (8, 100.0) },
        })
    }

    fn asks(&self, columns: &[Column]) -> bool {
        columns.iter().any(|column| self.columns.contains(column))
    }
}

/// The rows and columns of `ROW`, `ROW:COLUMN` or `:COLUMN`.
fn chosen(only: Option<&str>) -> Result<(Vec<&'static Contestant<Recipe>>, Vec<Column>)> {
    let (row, column) = only.map_or(("", ""), |o| o.split_once(':').unwrap_or((o, "")));
    let rows = CONTESTANTS.iter();
    let rows: Vec<_> = rows.filter(|c| row.is_empty() || c.key == row).collect();
    let columns = Column::ALL.into_iter();
    let columns: Vec<_> = columns
        .filter(|c| column.is_empty() || c.key() == column)
        .collect();
    let unknown = |what: &str, name: &str, known: Vec<&str>| {
        mistake(
            format!("the table has no {what} '{name}'"),
            format!("choose one of {} (--only ROW:COLUMN)", known.join(", ")),
        )
    };
    if rows.is_empty() {
        let known = CONTESTANTS.iter().map(|c| c.key);
        return Err(unknown("row", row, known.collect()));
    }
    if columns.is_empty() {
        let known = Column::ALL.map(Column::key);
        return Err(unknown("column", column, known.to_vec()));
    }
    Ok((rows, columns))
}

/// One cell: what was measured for each seed.
struct Cell {
    row: &'static Contestant<Recipe>,
    column: Column,
    measured: Vec<Measured>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let plan = Plan::of(lab)?;
    lab.plan(measuring::fits(&plan, lab.seeds().len()));
    let mut cells = Vec::new();
    for seed in lab.seeds() {
        measuring::measure(&plan, seed, lab, &mut cells)?;
    }
    page::complete(lab, &plan, &cells);
    Ok(())
}

/// The value of a cell, whether it is ticked, its parts, and why nothing could be measured.
fn record(lab: &mut Lab, row: &Contestant<Recipe>, column: Column, measured: &Measured) {
    let line = lab.row("", row);
    line.add(column.key(), measured.value);
    line.detail(&format!("{} tick", column.key()), measured.tick(column));
    for (name, part) in &measured.figures {
        line.detail(&format!("{} {name}", column.key()), part);
    }
    if let Some(note) = &measured.note {
        line.detail(&format!("{} note", column.key()), note);
    }
}
