//! Contents of a page as plain data: headline numbers, figures, animations, tables, settings and the commands that
//! reproduce them. This module is independent of pages and pixels.

mod action;
mod animation;
mod bands;
mod conserved;
pub(crate) mod coordinate;
mod curves;
mod decimate;
mod figure;
mod film;
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
pub use film::Film;
pub use heat_map::HeatMap;
pub use motions::{Motion, phase_portrait, trajectories};
pub use parity::parity;
pub use sweep::{Along, Sweep};
pub use terms::{Piece, TERMS, Term, pieces};
pub use torque::torque_parts;
pub use tracking::{followed_motion, tracking_error};
pub use view::View;

/// The report of a run, with its parts in the order of the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// Title, in a few words.
    pub title: String,
    /// One line below the title: the system, the data, the date.
    pub subtitle: String,
    /// The answer to the reader's question, in a sentence with its number; empty without a question.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub answer: String,
    /// The few numbers that answer the reader's question.
    pub headlines: Vec<Headline>,
    /// Conclusions from them, in sentences.
    pub summary: Vec<String>,
    /// Moving pictures.
    pub animations: Vec<Animation>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Headings of consecutive figures; figures beyond them have the heading "Figures".
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub headings: Vec<Heading>,
    /// Quantities over two axes.
    pub maps: Vec<HeatMap>,
    /// Tables of numbers.
    pub tables: Vec<Table>,
    /// Settings of the run, by name.
    pub settings: Vec<(String, String)>,
    /// Command lines that reproduce this report.
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
    /// Adds figures under a separate heading.
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
    /// The quantity, e.g. `Energy error at 100 s`.
    pub label: String,
    /// Its formatted value, e.g. `0.0004`.
    pub value: String,
    /// Its unit, e.g. `%`.
    pub unit: String,
    /// A note for comparison, e.g. `mean of 40 starts`.
    pub note: String,
    /// The role of the system or model that it belongs to, if any.
    pub role: Option<Role>,
    /// The grade with its reason, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub judgement: Option<Judgement>,
}

/// A table: one header, rows of the same length.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Table {
    /// The caption.
    pub caption: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows, with one formatted cell for each column.
    pub rows: Vec<Vec<String>>,
    /// The grade of each row with its reason; empty, or one entry for each row.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub judgements: Vec<Option<Judgement>>,
}

/// A command line and its result.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Command {
    /// The result, e.g. `The model`.
    pub makes: String,
    /// The line to enter.
    pub line: String,
}

impl Headline {
    /// A number with its label, its unit and a note for comparison; it belongs to no system or model.
    #[must_use]
    pub fn new(label: &str, value: String, unit: &str, note: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            value,
            unit: unit.into(),
            note: note.into(),
            role: None,
            judgement: None,
        }
    }
}

impl Table {
    /// A table of formatted rows.
    #[must_use]
    pub fn new(caption: impl Into<String>, header: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self {
            caption: caption.into(),
            header: header.iter().map(|name| (*name).into()).collect(),
            rows,
            judgements: Vec::new(),
        }
    }

    /// Adds a verdict on each row.
    #[must_use]
    pub fn with_judgements(self, judgements: Vec<Option<Judgement>>) -> Self {
        Self { judgements, ..self }
    }
}

impl Command {
    /// The line to enter, and its result.
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
