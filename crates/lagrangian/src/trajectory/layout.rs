//! Which columns of a file mean what: named by the user, or by the default header names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Coordinates, Sampling, Topology};
use crate::{Error, Result};

/// Which columns of a file hold which signal, and which coordinates are angles.
///
/// Signals that are left empty are looked for under `trajectory`, `t`, `q1 … qn`, `qd1 … qdn`, `qdd1 … qddn`,
/// `p1 … pn` and `tau1 … taun`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Layout {
    /// Column that tells trajectories apart.
    pub trajectory: Option<String>,
    /// Column of time, s.
    pub t: Option<String>,
    /// Columns of the coordinates, which give these their names.
    pub q: Vec<String>,
    /// Columns of the velocities, in the order of `q`.
    pub qd: Vec<String>,
    /// Columns of the accelerations, in the order of `q`.
    pub qdd: Vec<String>,
    /// Columns of the momenta p = ∂L/∂q̇, in the order of `q`, in SI units.
    pub p: Vec<String>,
    /// Columns of the generalised forces, in the order of `q`.
    pub tau: Vec<String>,
    /// Coordinates that these forces act on, in the order of `tau`, where they are fewer than `q`; the forces on
    /// the others are 0. Empty: all of them, or those whose names the columns bear.
    pub actuated: Vec<String>,
    /// Names of the coordinates that are angles; `["all"]` for every one.
    pub angles: Vec<String>,
    /// Names of the coordinates that never move: masses, lengths, strengths of fields. Those that are not in `q`
    /// are further coordinates behind it; they need no columns of velocities, accelerations and forces.
    pub parameters: Vec<String>,
    /// Angles, and their velocities and accelerations, are in degrees. Never guessed.
    pub degrees: bool,
    /// Units of coordinates that are not angles.
    pub units: BTreeMap<String, String>,
    /// Keep every so manyth row of each trajectory (0 and 1 keep all).
    pub every: usize,
    /// Of a file with more rows than this, keep a sample; [`super::thin`] removes recordings of which nothing was kept.
    /// No file beside the data says so.
    pub sample: Option<Sampling>,
}

/// The same as it is written in a TOML file beside the data.
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
    columns: ColumnsTable,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    units: BTreeMap<String, String>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ColumnsTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    trajectory: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    q: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    qd: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    qdd: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    p: Option<OneOrMany>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tau: Option<OneOrMany>,
}

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

fn list(names: &[String]) -> Option<OneOrMany> {
    (!names.is_empty()).then(|| OneOrMany::Many(names.to_vec()))
}

impl Layout {
    /// Reads the small TOML file that may stand beside the data.
    ///
    /// ```
    /// let layout = lagrangian::trajectory::Layout::from_toml(r#"
    ///     angle = ["theta"]            # or "all"
    ///     degrees = true
    ///     [columns]
    ///     t = "time"
    ///     q = ["theta", "x"]
    ///     [units]
    ///     x = "m"
    /// "#)?;
    /// assert_eq!(layout.q, ["theta", "x"]);
    /// # Ok::<(), lagrangian::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Layout`] with the place, if it is not TOML or has an unknown key.
    pub fn from_toml(text: &str) -> Result<Self> {
        let file: LayoutFile = toml::from_str(text).map_err(|e| Error::Layout(e.to_string()))?;
        let columns = file.columns;
        Ok(Self {
            trajectory: columns.trajectory,
            t: columns.t,
            q: names(columns.q),
            qd: names(columns.qd),
            qdd: names(columns.qdd),
            p: names(columns.p),
            tau: names(columns.tau),
            actuated: names(file.actuated),
            angles: names(file.angle),
            parameters: names(file.parameter),
            degrees: file.degrees,
            units: file.units,
            every: file.every.unwrap_or(0),
            sample: None,
        })
    }

    /// The text that [`Layout::from_toml`] reads back.
    ///
    /// # Errors
    /// [`Error::Layout`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        let file = LayoutFile {
            angle: list(&self.angles),
            actuated: list(&self.actuated),
            parameter: list(&self.parameters),
            degrees: self.degrees,
            every: (self.every > 1).then_some(self.every),
            columns: ColumnsTable {
                trajectory: self.trajectory.clone(),
                t: self.t.clone(),
                q: list(&self.q),
                qd: list(&self.qd),
                qdd: list(&self.qdd),
                p: list(&self.p),
                tau: list(&self.tau),
            },
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

    /// Fills what is left unsaid here from `beside` (flags win over the file beside the data).
    #[must_use]
    pub fn or(mut self, beside: Self) -> Self {
        self.trajectory = self.trajectory.or(beside.trajectory);
        self.t = self.t.or(beside.t);
        let lists = [
            (&mut self.q, beside.q),
            (&mut self.qd, beside.qd),
            (&mut self.qdd, beside.qdd),
            (&mut self.p, beside.p),
            (&mut self.tau, beside.tau),
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
