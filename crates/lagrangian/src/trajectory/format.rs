//! The file formats, one line each.

use std::io::{Read, Seek, Write};

use super::{Layout, Readings, Signal, Table, Trajectory};
use crate::{Error, Result};

/// A file format for trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated text with a header.
    Csv,
    /// A zip of `NumPy` arrays.
    Npz,
    /// Apache Parquet (feature `parquet`).
    Parquet,
}

impl Format {
    /// All formats with their file extensions.
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Csv, "csv"),
        (Self::Npz, "npz"),
        (Self::Parquet, "parquet"),
    ];

    /// The format of files with this extension (`txt`, `tsv` and `dat` are text too).
    ///
    /// # Errors
    /// [`Error::Format`] listing the known ones.
    pub fn from_extension(extension: &str) -> Result<Self> {
        let lower = extension.trim_start_matches('.').to_ascii_lowercase();
        if matches!(lower.as_str(), "txt" | "tsv" | "dat") {
            return Ok(Self::Csv);
        }
        Self::ALL
            .iter()
            .find(|(_, e)| *e == lower)
            .map(|(format, _)| *format)
            .ok_or_else(|| Error::Format {
                extension: lower,
                remedy: format!("use one of {}", Self::ALL.map(|(_, e)| e).join(", ")),
            })
    }

    /// The usual extension, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Npz => "npz",
            Self::Parquet => "parquet",
        }
    }

    /// Reads all recordings of a file; `name` is given to a recording that has no `trajectory` column.
    ///
    /// # Errors
    /// See [`super::csv::read`]; [`Error::Format`] where this build leaves the format out.
    pub fn read<R>(self, source: R, name: &str, layout: &Layout) -> Result<Readings>
    where
        R: Read + Seek + Send + 'static,
    {
        match self {
            Self::Csv => super::csv::read(source, name, layout),
            Self::Npz => super::npz::read(source, name, layout),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::read(source, name, layout),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }

    /// Writes trajectories so that [`Format::read`] with the default layout finds the same bits.
    ///
    /// Angles are not marked in the file: [`Layout::written`] declares them.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] if degrees of freedom or signals differ among the trajectories;
    /// [`Error::Format`] where this build leaves the format out.
    pub fn write<W: Write + Seek + Send>(self, sink: W, trajectories: &[Trajectory]) -> Result<()> {
        match self {
            Self::Csv => super::csv::write(sink, trajectories),
            Self::Npz => super::npz::write(sink, trajectories),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::write(sink, trajectories),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }

    /// Writes named columns of numbers.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] for columns of different lengths; [`Error::Format`] where this build leaves
    /// the format out.
    pub fn write_table<W: Write + Seek + Send>(self, sink: W, table: &Table) -> Result<()> {
        table.validate()?;
        match self {
            Self::Csv => super::csv::write_table(sink, table),
            Self::Npz => super::npz::write_table(sink, table),
            #[cfg(feature = "parquet")]
            Self::Parquet => super::parquet::write_table(sink, table),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(without_parquet()),
        }
    }
}

#[cfg(not(feature = "parquet"))]
fn without_parquet() -> Error {
    Error::Format {
        extension: "parquet".into(),
        remedy:
            "this build omits Parquet: build it with the feature parquet, or convert to CSV or NPZ"
                .into(),
    }
}

/// Which signals a set of trajectories has, so that every row of a file has the same columns.
pub(super) struct WrittenColumns {
    pub(super) n: usize,
    pub(super) signals: Vec<Signal>,
}

impl WrittenColumns {
    pub(super) fn of(trajectories: &[Trajectory]) -> Result<Self> {
        let known = trajectories.iter().find(|t| !t.is_empty());
        let Some(first) = known.or(trajectories.first()) else {
            return Err(Error::too_short("the list of trajectories", 0, 1));
        };
        let n = first.dof();
        let is_written = |signal: &Signal| {
            matches!(signal, Signal::Q | Signal::Qd) || first.values(*signal).is_some()
        };
        let signals: Vec<Signal> = Signal::IN_FILES.into_iter().filter(is_written).collect();
        let length = |t: &Trajectory, signal: &Signal| match signals.contains(signal) {
            true => t.len() * n,
            false => 0,
        };
        let fits = |t: &&Trajectory| {
            Signal::IN_FILES
                .iter()
                .all(|signal| t.get(*signal).len() == length(t, signal))
        };
        match trajectories.iter().find(|t| !fits(t)) {
            None => Ok(Self { n, signals }),
            Some(other) => Err(Error::shape(
                format!("trajectory '{}'", other.name),
                other.dof(),
                n,
                "trajectories of one file need the same coordinates and the same signals",
            )),
        }
    }

    /// `t, q1 …, qd1 …`.
    pub(super) fn headers(&self) -> Vec<String> {
        let numbered = |signal: &Signal| {
            let prefix = signal.name();
            (1..=self.n).map(move |i| format!("{prefix}{i}"))
        };
        let t = std::iter::once("t".to_owned());
        t.chain(self.signals.iter().flat_map(numbered)).collect()
    }

    /// The values of the columns other than t, in their order, each `[len, n]`.
    pub(super) fn values<'a>(&self, t: &'a Trajectory) -> impl Iterator<Item = &'a [f64]> {
        self.signals.iter().map(|signal| t.get(*signal).as_slice())
    }

    /// Everything but t of sample `k`.
    pub(super) fn row(&self, t: &Trajectory, k: usize) -> impl Iterator<Item = f64> {
        let rows = self.values(t).flat_map(move |x| &x[k * self.n..][..self.n]);
        rows.copied()
    }
}

/// The names of trajectories, numbered where two have the same, since a name separates them in a file.
pub(super) fn unique_names(trajectories: &[Trajectory]) -> Vec<String> {
    let mut seen = std::collections::HashSet::new();
    trajectories
        .iter()
        .map(|t| {
            let numbered = (2..).map(|i| format!("{}#{i}", t.name));
            let mut names = std::iter::once(t.name.clone()).chain(numbered);
            // OK because the names never end: one of them is new.
            let name = names.find(|name| !seen.contains(name)).unwrap_or_default();
            seen.insert(name.clone());
            name
        })
        .collect()
}
