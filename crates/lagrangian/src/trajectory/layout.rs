//! Which columns of a file mean what: named by the user, or by the default header names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Coordinates, Sampling, Signal, Signals, Topology};
use crate::{Error, Result};

/// Which columns of a file hold which signal, and which coordinates are angles.
///
/// Signals without names are expected under `trajectory`, `t`, `q1 … qn`, `qd1 … qdn`, `qdd1 … qddn`,
/// `p1 … pn` and `tau1 … taun`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Layout {
    /// Column that tells trajectories apart.
    pub trajectory: Option<String>,
    /// Topic of a bag; a bag with one topic of joint states needs none.
    pub topic: Option<String>,
    /// Column of time, s.
    pub t: Option<String>,
    /// Columns of each signal: those of `q` give the coordinates their names, the others follow their order. Momenta
    /// are in SI units.
    pub columns: Signals<Vec<String>>,
    /// Coordinates that the forces act on, in the order of their columns, where these are fewer than the coordinates; the forces on
    /// the others are 0. Empty: all of them, or those whose names the columns bear.
    pub actuated: Vec<String>,
    /// Names of the coordinates that are angles; `["all"]` for every one.
    pub angles: Vec<String>,
    /// Names of the coordinates that never move: masses, lengths, strengths of fields. Those that are not in `q`
    /// are further coordinates after it; they need no columns of velocities, accelerations and forces.
    pub parameters: Vec<String>,
    /// Angles, and their velocities and accelerations, are in degrees. Never guessed.
    pub degrees: bool,
    /// Units of coordinates that are not angles.
    pub units: BTreeMap<String, String>,
    /// Keep every Nth row of each trajectory (0 and 1 keep all).
    pub every: usize,
    /// Of a file with more rows than this, keep a sample; [`super::thin`] removes recordings of which nothing was kept.
    /// No file beside the data says so.
    pub sample: Option<Sampling>,
}

/// A [`Layout`] as a TOML file beside the data holds it.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct LayoutFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    angle: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    actuated: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameter: Option<OneOrMany>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    degrees: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    every: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    topic: Option<String>,
    columns: ColumnsTable,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    units: BTreeMap<String, String>,
}

/// The columns by the names of the settings: `trajectory`, `t`, and those of the signals.
type ColumnsTable = BTreeMap<String, OneOrMany>;

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum OneOrMany {
    One(String),
    Many(Vec<String>),
}

fn names(list: Option<OneOrMany>) -> Vec<String> {
    match list {
        None => Vec::new(),
        Some(OneOrMany::One(name)) => vec![name],
        Some(OneOrMany::Many(names)) => names,
    }
}

fn one(list: Option<OneOrMany>) -> Result<Option<String>> {
    match names(list) {
        mut one if one.len() < 2 => Ok(one.pop()),
        several => Err(Error::Layout(format!(
            "there is one column of time, and one of trajectories, not {}",
            several.join(", ")
        ))),
    }
}

fn list(names: &[String]) -> Option<OneOrMany> {
    (!names.is_empty()).then(|| OneOrMany::Many(names.to_vec()))
}

impl Layout {
    /// Reads the small TOML file that may accompany the data.
    ///
    /// ```
    /// let layout = lagrangian::Layout::from_toml(r#"
    ///     angle = ["theta"]            # or "all"
    ///     degrees = true
    ///     [columns]
    ///     t = "time"
    ///     q = ["theta", "x"]
    ///     [units]
    ///     x = "m"
    /// "#)?;
    /// assert_eq!(layout.columns.q, ["theta", "x"]);
    /// # Ok::<(), lagrangian::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Layout`] with the place, if it is not TOML or has an unknown key.
    pub fn from_toml(text: &str) -> Result<Self> {
        let file: LayoutFile = toml::from_str(text).map_err(|e| Error::Layout(e.to_string()))?;
        let mut columns = file.columns;
        let mut layout = Self {
            trajectory: one(columns.remove("trajectory"))?,
            topic: file.topic,
            t: one(columns.remove("t"))?,
            columns: Signals::default(),
            actuated: names(file.actuated),
            angles: names(file.angle),
            parameters: names(file.parameter),
            degrees: file.degrees,
            units: file.units,
            every: file.every.unwrap_or(0),
            sample: None,
        };
        for signal in Signal::IN_FILES {
            *layout.columns.get_mut(signal) = names(columns.remove(signal.name()));
        }
        match columns.keys().next() {
            None => Ok(layout),
            Some(unknown) => Err(Error::Layout(format!(
                "unknown key '{unknown}' in [columns]: it holds trajectory, t, {}",
                Signal::IN_FILES.map(Signal::name).join(", ")
            ))),
        }
    }

    /// The text that [`Layout::from_toml`] reads back.
    ///
    /// # Errors
    /// [`Error::Layout`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        let signals = self.columns.iter();
        let signals = signals.map(|(signal, names)| (signal.name(), list(names)));
        let single = |name: &Option<String>| name.clone().map(OneOrMany::One);
        let columns = [
            ("trajectory", single(&self.trajectory)),
            ("t", single(&self.t)),
        ]
        .into_iter()
        .chain(signals)
        .filter_map(|(name, columns)| Some((name.to_owned(), columns?)));
        let file = LayoutFile {
            angle: list(&self.angles),
            actuated: list(&self.actuated),
            parameter: list(&self.parameters),
            degrees: self.degrees,
            every: (self.every > 1).then_some(self.every),
            topic: self.topic.clone(),
            columns: columns.collect(),
            units: self.units.clone(),
        };
        toml::to_string(&file).map_err(|e| Error::Layout(e.to_string()))
    }

    /// The layout of files that [`super::Format::write`] makes: default column names, angles declared.
    #[must_use]
    pub fn written(coordinates: &Coordinates) -> Self {
        let mut layout = Self::default();
        for (i, coordinate) in coordinates.0.iter().enumerate() {
            let column = format!("q{}", i + 1);
            match coordinate.topology {
                Topology::Circle => layout.angles.push(column.clone()),
                Topology::Line => {}
                Topology::Parameter => layout.parameters.push(column.clone()),
            }
            if coordinate.topology != Topology::Circle && !coordinate.unit.is_empty() {
                layout.units.insert(column, coordinate.unit.clone());
            }
        }
        layout
    }

    /// Fills what is not set here from `beside` (arguments take precedence over the file beside the data).
    #[must_use]
    pub fn or(mut self, beside: Self) -> Self {
        self.trajectory = self.trajectory.or(beside.trajectory);
        self.topic = self.topic.or(beside.topic);
        self.t = self.t.or(beside.t);
        self.columns = self.columns.or(beside.columns);
        let lists = [
            (&mut self.actuated, beside.actuated),
            (&mut self.angles, beside.angles),
            (&mut self.parameters, beside.parameters),
        ];
        for (own, other) in lists {
            if own.is_empty() {
                *own = other;
            }
        }
        self.degrees |= beside.degrees;
        for (name, unit) in beside.units {
            self.units.entry(name).or_insert(unit);
        }
        if self.every == 0 {
            self.every = beside.every;
        }
        self
    }
}
