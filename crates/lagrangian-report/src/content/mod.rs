//! What a page says, as plain data: headline numbers, figures, animations, tables, settings and the commands that
//! reproduce them. Nothing here knows of pages or pixels.

mod action;
mod animation;
mod bands;
mod conserved;
mod coordinate;
mod curves;
mod decimate;
mod figure;
mod gaps;
mod heat_map;
mod motions;
mod parity;
mod sweep;
mod terms;
mod torque;
mod tracking;
mod view;

use lagrangian::score::Judgement;
use serde::{Deserialize, Serialize};

pub use action::{VariedPath, action_of_families, varied_paths};
pub use animation::{Animation, Panel, Shape, Stage};
pub use bands::Banded;
pub use conserved::conserved_quantity;
pub use coordinate::force_unit;
pub use curves::{energy_error_over_time, loss_curves};
pub use decimate::decimate;
pub use figure::{Axis, Figure, Kind, Role, Scale, Series};
pub use heat_map::HeatMap;
pub use motions::{Motion, phase_portrait, trajectories};
pub use parity::parity;
pub use sweep::{Along, Sweep};
pub use terms::{Piece, TERMS, Term, pieces};
pub use torque::torque_parts;
pub use tracking::{Follower, followed_motion, tracking_error};
pub use view::View;

/// Everything that a reader of a run wants to see, in the order in which they see it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// What was done, in a few words.
    pub title: String,
    /// One line below the title: the system, the data, the date.
    pub subtitle: String,
    /// The answer to the reader's question, in a sentence with its figure; empty where there is no question.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub answer: String,
    /// The few numbers that answer the reader's question.
    pub headlines: Vec<Headline>,
    /// What follows from them, in sentences.
    pub summary: Vec<String>,
    /// Moving pictures.
    pub animations: Vec<Animation>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// The headings of consecutive figures; figures beyond them are headed "Figures".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub headings: Vec<Heading>,
    /// Quantities over two axes.
    pub maps: Vec<HeatMap>,
    /// Tables of figures.
    pub tables: Vec<Table>,
    /// Settings of the run, by name.
    pub settings: Vec<(String, String)>,
    /// The command lines that make this report again.
    pub commands: Vec<Command>,
}

/// A heading of consecutive figures.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Heading {
    /// Its words.
    pub text: String,
    /// The number of its figures.
    pub figures: usize,
}

impl Report {
    /// Adds figures under a heading of their own.
    pub fn add_figures(&mut self, heading: &str, figures: impl IntoIterator<Item = Figure>) {
        let before = self.figures.len();
        self.figures.extend(figures);
        self.headings.push(Heading {
            text: heading.into(),
            figures: self.figures.len() - before,
        });
    }
}

/// One number that answers a question, ready to be read.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Headline {
    /// What it is, e.g. `Energy error at 100 s`.
    pub label: String,
    /// Its value as it is to be shown, e.g. `0.0004`.
    pub value: String,
    /// Its unit, e.g. `%`.
    pub unit: String,
    /// What to compare it with, e.g. `mean of 40 starts`.
    pub note: String,
    /// The role of the system or model that it belongs to, if it belongs to one.
    pub role: Option<Role>,
    /// How good it is and why, where that can be said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub judged: Option<Judgement>,
}

/// A table: one header, rows of the same length.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows, each with one cell a column, ready to be read.
    pub rows: Vec<Vec<String>>,
    /// How good what a row says is, and why: none or one for each row.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub judged: Vec<Option<Judgement>>,
}

/// A command line and what it makes.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Command {
    /// What it makes, e.g. `The model`.
    pub makes: String,
    /// The line to type.
    pub line: String,
}

impl Headline {
    /// A number with its label, its unit and what to compare it with; it belongs to no system or model.
    #[must_use]
    pub fn new(label: &str, value: String, unit: &str, note: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            value,
            unit: unit.into(),
            note: note.into(),
            role: None,
            judged: None,
        }
    }
}

impl Table {
    /// A table of rows that are ready to be read.
    #[must_use]
    pub fn new(caption: impl Into<String>, header: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self {
            caption: caption.into(),
            header: header.iter().map(|name| (*name).into()).collect(),
            rows,
            judged: Vec::new(),
        }
    }

    /// The same with a verdict on each row.
    #[must_use]
    pub fn judged(self, judged: Vec<Option<Judgement>>) -> Self {
        Self { judged, ..self }
    }
}

impl Command {
    /// The line to type, and what it makes.
    #[must_use]
    pub fn new(makes: &str, line: impl Into<String>) -> Self {
        Self {
            makes: makes.into(),
            line: line.into(),
        }
    }
}

#[cfg(test)]
mod tests;
