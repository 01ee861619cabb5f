//! All families against all properties: each cell is measured, and its tick follows from a threshold that is stated.

mod columns;
mod contestants;
mod hopeless;
mod measuring;
mod page;

use anyhow::Result;
use lagrangian::experiment::table::Size;
use lagrangian::train::Budget;
use serde_json::{Value, json};

use super::spread::median;
use super::{Course, Experiment, Findings, Setting};
use crate::failure::mistake;
use columns::{Column, Measured};
use contestants::{CONTESTANTS, Contestant};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table",
    about: "what every family of models can learn: a table of measured ticks",
    parts: Some("ROW, ROW:COLUMN or :COLUMN"),
    run,
};

/// How long, how often, how much.
struct Plan {
    seeds: Vec<u64>,
    rows: Vec<&'static Contestant>,
    columns: Vec<Column>,
    /// Of a fit: steps, or the seconds that are asked for.
    budget: Budget,
    /// Of a fit to the double pendulum without noise, the hardest lesson.
    longest: Budget,
    seconds: Option<f64>,
    size: Size,
    /// Long motions, and how long they are, s.
    long: (usize, f64),
    quick: bool,
}

impl Plan {
    fn of(setting: &Setting) -> Result<Self> {
        let quick = setting.args.quick;
        let (rows, columns) = chosen(setting.args.only.as_deref())?;
        let seconds = setting.args.seconds;
        let steps = |steps, few| {
            let steps = Budget::Steps(if quick { few } else { steps });
            seconds.map_or(steps, Budget::Seconds)
        };
        let size = |train, held, test| Size { train, held, test };
        Ok(Self {
            seeds: setting.seeds(),
            rows,
            columns,
            budget: steps(400, 8),
            longest: steps(800, 8),
            seconds,
            size: if quick {
                size(150, 30, 20)
            } else {
                size(1000, 100, 60)
            },
            long: if quick { (3, 2.0) } else { (8, 100.0) },
            quick,
        })
    }

    fn asks(&self, columns: &[Column]) -> bool {
        columns.iter().any(|column| self.columns.contains(column))
    }
}

/// The rows and columns of `ROW`, `ROW:COLUMN` or `:COLUMN`.
fn chosen(only: Option<&str>) -> Result<(Vec<&'static Contestant>, Vec<Column>)> {
    let (row, column) = only.map_or(("", ""), |o| o.split_once(':').unwrap_or((o, "")));
    let rows: Vec<_> = CONTESTANTS
        .iter()
        .filter(|c| row.is_empty() || c.key == row)
        .collect();
    let columns: Vec<_> = Column::ALL
        .into_iter()
        .filter(|c| column.is_empty() || c.key() == column)
        .collect();
    let list = |names: Vec<&str>| names.join(", ");
    if rows.is_empty() {
        return Err(mistake(
            format!("the table has no row '{row}'"),
            format!(
                "take one of {} (--only ROW:COLUMN)",
                list(CONTESTANTS.iter().map(|c| c.key).collect())
            ),
        ));
    }
    if columns.is_empty() {
        return Err(mistake(
            format!("the table has no column '{column}'"),
            format!(
                "take one of {} (--only ROW:COLUMN)",
                list(Column::ALL.map(Column::key).to_vec())
            ),
        ));
    }
    Ok((rows, columns))
}

/// One cell: what each seed found.
struct Cell {
    row: &'static Contestant,
    column: Column,
    found: Vec<Measured>,
}

impl Cell {
    fn values(&self) -> Vec<f64> {
        self.found.iter().filter_map(|m| m.value).collect()
    }

    fn value(&self) -> f64 {
        median(&self.values())
    }

    /// What most seeds found.
    fn tick(&self) -> bool {
        let ticks = self.found.iter().filter(|m| m.tick(self.column)).count();
        2 * ticks > self.found.len()
    }

    fn note(&self) -> Option<&str> {
        self.found.iter().find_map(|m| m.note.as_deref())
    }

    fn published(&self) -> Option<bool> {
        self.row
            .published
            .and_then(|row| self.column.published(row))
    }

    fn command(&self, plan: &Plan) -> String {
        let mut line = format!(
            "lagrangian experiment table --only {}:{} --seed {} --seeds {}",
            self.row.key,
            self.column.key(),
            plan.seeds.first().unwrap_or(&0),
            plan.seeds.len(),
        );
        if let Some(seconds) = plan.seconds {
            line += &format!(" --seconds {seconds}");
        }
        if plan.quick {
            line += " --quick";
        }
        line
    }

    fn json(&self, plan: &Plan) -> Value {
        let figures = |m: &Measured| -> serde_json::Map<String, Value> {
            let pairs = m.figures.iter();
            pairs
                .map(|(name, x)| ((*name).to_string(), json!(x)))
                .collect()
        };
        json!({
            "row": self.row.key,
            "column": self.column.key(),
            "value": self.value(),
            "unit": self.column.unit(),
            "threshold": self.column.threshold(),
            "tick": self.tick(),
            "published": self.published(),
            "values": self.found.iter().map(|m| m.value).collect::<Vec<_>>(),
            "figures": self.found.iter().map(figures).collect::<Vec<_>>(),
            "note": self.note(),
            "meaning": self.column.meaning(),
            "command": self.command(plan),
        })
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan::of(setting)?;
    course.plan(measuring::whole(&plan));
    let mut cells: Vec<Cell> = Vec::new();
    for &seed in &plan.seeds {
        for (row, column, measured) in measuring::measure(&plan, seed, course)? {
            match cells
                .iter_mut()
                .find(|c| c.row.key == row.key && c.column == column)
            {
                Some(cell) => cell.found.push(measured),
                None => cells.push(Cell {
                    row,
                    column,
                    found: vec![measured],
                }),
            }
        }
    }
    Ok(Findings {
        figures: json!({
            "cells": cells.iter().map(|cell| cell.json(&plan)).collect::<Vec<_>>(),
            "budget": plan.budget,
            "budget_double_pendulum": plan.longest,
        }),
        summary: page::summary(&plan, &cells),
        report: page::report(&plan, &cells),
    })
}
