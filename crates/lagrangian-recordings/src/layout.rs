//! Assignment of columns to signals: named by the user, or by the default header names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::drive::{Constant, DriveLayout};
use super::{Links, Polar, Sampling, Simulated};
use lagrangian_motion::{Coordinate, Coordinates, Signal, Signals, Topology};
use lagrangian_motion::{Error, Result};

/// Assignment of the columns of a file to signals, and of coordinates to angles.
///
/// The default names of signals are `trajectory`, `t`, `q1 … qn`, `qd1 … qdn`, `qdd1 … qddn`,
/// `p1 … pn` and `tau1 … taun`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layout {
    /// Column that separates trajectories.
    pub trajectory: Option<String>,
    /// Topic of a bag; optional for a bag with one topic of joint states.
    pub topic: Option<String>,
    /// Column of time, in seconds unless its name states a unit; or the number of seconds between rows, without a column.
    pub t: Option<String>,
    /// Columns of each signal: those of `q` give the coordinates their names, the others follow their order. Momenta
    /// are in SI units.
    pub columns: Signals<Vec<String>>,
    /// Coordinates that the forces act on, in the order of their columns, where there are fewer columns than coordinates; the forces on
    /// the others are 0. Empty: all coordinates, or those that appear in the names of the columns.
    pub actuated: Vec<String>,
    /// Names of the coordinates that are angles; `["all"]` for every one.
    pub angles: Vec<String>,
    /// Coordinates that are angles of two points; those that are not in `q` are appended to it.
    pub polar: Vec<Polar>,
    /// Names of the coordinates that never move: masses, lengths, strengths of fields. Those that are not in `q`
    /// are appended to it; they need no columns of velocities, accelerations and forces.
    pub parameters: Vec<String>,
    /// Angles, and their velocities and accelerations, are in degrees. Never guessed.
    pub degrees: bool,
    /// Units of coordinates that are not angles.
    pub units: BTreeMap<String, String>,
    /// Properties of position-controlled drives that are not in the columns of `goal`, `kp`, `kd`, `supply` and `enabled`.
    pub drive: DriveLayout,
    /// Keep every Nth row of each trajectory (0 and 1 keep all).
    pub every: usize,
    /// The known system that generated the motions, if they were simulated.
    pub system: Option<Simulated>,
    /// Reference of the angles of the links of a chain, for drawings of motions.
    pub links: Option<Links>,
    /// Keep a sample of a file with more rows than this; [`super::thin`] removes recordings without a kept row.
    /// The layout file beside the data has no such key.
    pub sample: Option<Sampling>,
}

/// The key of gains in SI units.
const SI: &str = "si";

/// A [`Layout`] as stored in a TOML file beside the data.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct LayoutFile {
    angle: Option<OneOrMany>,
    actuated: Option<OneOrMany>,
    parameter: Option<OneOrMany>,
    polar: Option<OneOrMany>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    degrees: bool,
    every: Option<usize>,
    topic: Option<String>,
    links: Option<Links>,
    columns: ColumnsTable,
    #[serde(skip_serializing_if = "DriveTable::is_empty")]
    drive: DriveTable,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    units: BTreeMap<String, String>,
    system: Option<Simulated>,
}

/// Columns by the names of the settings: `trajectory`, `t`, and those of the signals.
type ColumnsTable = BTreeMap<String, OneOrMany>;

/// Table of the drives: columns, numbers or patterns by the names of the signals.
type DriveTable = BTreeMap<String, ColumnSpec>;

#[derive(Debug, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a name, a list of names, a number or true"
)]
enum ColumnSpec {
    Flag(bool),
    Number(f64),
    Names(OneOrMany),
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a name, or a list of names")]
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
        several => Err(Error::layout(format_args!(
            "there is one column of time, and one of trajectories, not {}",
            several.join(", ")
        ))),
    }
}

fn list(names: &[String]) -> Option<OneOrMany> {
    (!names.is_empty()).then(|| OneOrMany::Many(names.to_vec()))
}

impl Layout {
    /// Reads the small TOML file that may be stored beside the data.
    ///
    /// ```
    /// let layout = lagrangian_recordings::Layout::from_toml(r#"
    ///     angle = ["theta"]            # or "all"
    ///     degrees = true
    ///     [columns]
    ///     t = "time"
    ///     q = ["theta", "x"]
    ///     [units]
    ///     x = "m"
    /// "#)?;
    /// assert_eq!(layout.columns.q, ["theta", "x"]);
    /// # Ok::<(), lagrangian_motion::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Layout`] with the place, if it is not TOML or has an unknown key.
    pub fn from_toml(text: &str) -> Result<Self> {
        Self::of(toml::from_str(text).map_err(Error::layout)?)
    }

    /// Reads the table that such a file holds.
    ///
    /// # Errors
    /// As [`Self::from_toml`].
    pub fn from_table(table: toml::Table) -> Result<Self> {
        Self::of(table.try_into().map_err(Error::layout)?)
    }

    fn of(file: LayoutFile) -> Result<Self> {
        let mut columns = file.columns;
        let mut layout = Self {
            trajectory: one(columns.remove("trajectory"))?,
            topic: file.topic,
            t: one(columns.remove("t"))?,
            columns: Signals::default(),
            actuated: names(file.actuated),
            angles: names(file.angle),
            polar: names(file.polar)
                .iter()
                .map(|text| text.parse())
                .collect::<Result<_>>()?,
            parameters: names(file.parameter),
            degrees: file.degrees,
            units: file.units,
            drive: DriveLayout::default(),
            every: file.every.unwrap_or(0),
            system: file.system,
            links: file.links,
            sample: None,
        };
        for signal in Signal::IN_FILES {
            *layout.columns.get_mut(signal) = names(columns.remove(signal.name()));
        }
        layout.read_drive(file.drive)?;
        layout.refuse_empty(file.every)?;
        match columns.keys().next() {
            None => Ok(layout),
            Some(unknown) => Err(Error::layout(format_args!(
                "unknown key '{unknown}' in [columns]: it holds trajectory, t, {}",
                Signal::IN_FILES.map(Signal::name).join(", ")
            ))),
        }
    }

    /// The seconds between rows, where a number replaces the column of time.
    pub(super) fn interval(&self) -> Option<f64> {
        let number = self.t.as_ref()?.parse::<f64>().ok()?;
        Some(number).filter(|seconds| seconds.is_finite() && *seconds > 0.0)
    }

    /// Whether the layout would read a column of this name, with or without a number after it: it is named, or is the
    /// default for a signal without names. Momenta have no default here, since `p` may be a pressure.
    #[must_use]
    pub fn asks_for(&self, name: &str) -> bool {
        let own = |single: &Option<String>, default| single.as_deref().unwrap_or(default) == name;
        let plain = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_asked = |(signal, names): (Signal, &Vec<String>)| match names.is_empty() {
            true => signal != Signal::P && signal.name() == plain,
            false => names.iter().any(|own| own == name),
        };
        own(&self.t, "t")
            || own(&self.trajectory, "trajectory")
            || self.parameters.iter().any(|own| own == name)
            || self.polar.iter().any(|polar| polar.reads(name))
            || self.columns.iter().any(is_asked)
    }

    /// Refuses empty names, and a layout that keeps no rows.
    fn refuse_empty(&self, every: Option<usize>) -> Result<()> {
        if every == Some(0) {
            return Err(Error::Layout("every = 0 keeps no row: 1 keeps all".into()));
        }
        let signals = self.columns.iter().flat_map(|(_, names)| names);
        let lists = [&self.actuated, &self.angles, &self.parameters];
        let single = [&self.t, &self.trajectory, &self.topic];
        let mut all = signals
            .chain(lists.into_iter().flatten())
            .chain(single.into_iter().flatten());
        match all.any(|name| name.trim().is_empty()) {
            true => Err(Error::Layout(
                "a name is empty: name a column, or omit the line".into(),
            )),
            false => Ok(()),
        }
    }

    fn read_drive(&mut self, mut table: DriveTable) -> Result<()> {
        for signal in Signal::OF_DRIVES {
            match table.remove(signal.name()) {
                None => {}
                Some(ColumnSpec::Number(x)) => self.drive.set(signal, Constant::Number(x))?,
                Some(ColumnSpec::Names(OneOrMany::One(text))) => {
                    self.declare(signal, vec![text])?
                }
                Some(ColumnSpec::Names(OneOrMany::Many(names))) => self.declare(signal, names)?,
                Some(ColumnSpec::Flag(flag)) => {
                    let name = signal.name();
                    let text =
                        format!("'{name} = {flag}' in [drive] is not a column, number or pattern");
                    return Err(Error::Layout(text));
                }
            }
        }
        match table.remove(SI) {
            None => {}
            Some(ColumnSpec::Flag(si)) => self.drive.si = si,
            Some(_) => return Err(Error::Layout("`si` in [drive] is true or false".into())),
        }
        match table.keys().next() {
            None => Ok(()),
            Some(unknown) => Err(Error::layout(format_args!(
                "unknown key '{unknown}' in [drive]: it holds {}, {SI}",
                Signal::OF_DRIVES.map(Signal::name).join(", ")
            ))),
        }
    }

    /// Sets a signal of drives from the words of a user: columns, or one text that is a number or a pattern.
    ///
    /// # Errors
    /// [`Error::Layout`] for a number or a pattern where only columns are allowed.
    pub fn declare(&mut self, signal: Signal, words: Vec<String>) -> Result<()> {
        let constant = match &words[..] {
            [word] => Constant::of_text(word),
            _ => None,
        };
        match constant {
            Some(constant) => self.drive.set(signal, constant),
            None => {
                *self.columns.get_mut(signal) = words;
                Ok(())
            }
        }
    }

    fn drive_table(&self) -> DriveTable {
        let constant = |signal: Signal| match self.drive.constant(signal)? {
            Constant::Number(x) => Some(ColumnSpec::Number(*x)),
            Constant::InName(pattern) => Some(ColumnSpec::Names(OneOrMany::One(pattern.clone()))),
        };
        let constants = Signal::OF_DRIVES
            .into_iter()
            .filter_map(|signal| Some((signal.name().to_owned(), constant(signal)?)));
        let si = self
            .drive
            .si
            .then(|| (SI.to_owned(), ColumnSpec::Flag(true)));
        constants.chain(si).collect()
    }

    /// The text that [`Layout::from_toml`] reads back.
    ///
    /// # Errors
    /// [`Error::Layout`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string(&self.file()).map_err(Error::layout)
    }

    /// The table that [`Layout::from_table`] reads back.
    ///
    /// # Errors
    /// As [`Self::to_toml`].
    pub fn to_table(&self) -> Result<toml::Table> {
        toml::Table::try_from(self.file()).map_err(Error::layout)
    }

    fn file(&self) -> LayoutFile {
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
        LayoutFile {
            angle: list(&self.angles),
            actuated: list(&self.actuated),
            polar: list(&self.polar.iter().map(Polar::to_string).collect::<Vec<_>>()),
            parameter: list(&self.parameters),
            degrees: self.degrees,
            every: (self.every > 1).then_some(self.every),
            topic: self.topic.clone(),
            columns: columns.collect(),
            drive: self.drive_table(),
            units: self.units.clone(),
            system: self.system.clone(),
            links: self.links,
        }
    }

    /// The layout of files that [`super::Format::write`] makes: default column names, angles declared.
    #[must_use]
    pub fn written(coordinates: &Coordinates) -> Self {
        let mut layout = Self::default();
        for (i, coordinate) in coordinates.0.iter().enumerate() {
            layout.add_coordinate(format!("q{}", i + 1), coordinate);
        }
        layout
    }

    /// Declares the kind and the unit of a coordinate with this column.
    pub(super) fn add_coordinate(&mut self, column: String, coordinate: &Coordinate) {
        if coordinate.topology != Topology::Circle && !coordinate.unit.is_empty() {
            let unit = coordinate.unit.clone();
            self.units.insert(column.clone(), unit);
        }
        match coordinate.topology {
            Topology::Circle => self.angles.push(column),
            Topology::Line => {}
            Topology::Parameter => self.parameters.push(column),
        }
    }

    /// Fills the unset fields from `beside` (arguments take precedence over the file beside the data).
    #[must_use]
    pub fn or(mut self, beside: Self) -> Self {
        self.trajectory = self.trajectory.or(beside.trajectory);
        self.topic = self.topic.or(beside.topic);
        self.t = self.t.or(beside.t);
        self.drive = self.drive.or(beside.drive, &self.columns);
        let constants = self.drive.clone();
        let columns = beside
            .columns
            .map(|signal, names| match constants.constant(signal) {
                Some(_) => Vec::new(),
                None => names,
            });
        self.columns = self.columns.or(columns);
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
        if self.polar.is_empty() {
            self.polar = beside.polar;
        }
        self.degrees |= beside.degrees;
        for (name, unit) in beside.units {
            self.units.entry(name).or_insert(unit);
        }
        if self.every == 0 {
            self.every = beside.every;
        }
        self.system = self.system.or(beside.system);
        self.links = self.links.or(beside.links);
        self
    }
}
