//! The file formats, one line each.

use std::io::{Read, Seek, Write};

use super::contents::Contents;
#[cfg(feature = "parquet")]
use super::parquet;
use super::{Layout, Readings, Table, Trajectory};
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

    /// Reads all recordings of a file; `name` is given to a recording that has no `trajectory` column.
    ///
    /// # Errors
    /// See [`super::csv::read`]; [`Error::Format`] where this build omits the format.
    pub fn read<R>(self, source: R, name: &str, layout: &Layout) -> Result<Readings>
    where
        R: Read + Seek + Send + 'static,
    {
        match self {
            Self::Csv => super::csv::read(source, name, layout),
            Self::Npz => super::npz::read(source, name, layout),
            Self::Parquet => parquet::read(source, name, layout),
        }
    }

    /// Writes trajectories so that [`Format::read`] with the default layout finds the same bits.
    ///
    /// Angles are not marked in the file: [`Layout::written`] declares them.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] if degrees of freedom or signals differ among the trajectories;
    /// [`Error::Format`] where this build omits the format.
    pub fn write<W: Write + Seek + Send>(self, sink: W, trajectories: &[Trajectory]) -> Result<()> {
        self.write_contents(sink, &Contents::of_motions(trajectories)?)
    }

    /// Writes named columns of numbers.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Shape`] for columns of different lengths; [`Error::Format`] where this build omits
    /// the format.
    pub fn write_table<W: Write + Seek + Send>(self, sink: W, table: &Table) -> Result<()> {
        self.write_contents(sink, &Contents::of_table(table)?)
    }

    fn write_contents<W: Write + Seek + Send>(self, sink: W, contents: &Contents) -> Result<()> {
        match self {
            Self::Csv => super::csv::write_contents(sink, contents),
            Self::Npz => super::npz::write(sink, contents),
            Self::Parquet => parquet::write(sink, contents),
        }
    }
}

/// Parquet in a build that omits it.
#[cfg(not(feature = "parquet"))]
mod parquet {
    use super::{Contents, Error, Layout, Readings, Result};

    pub(super) fn read<R>(_: R, _: &str, _: &Layout) -> Result<Readings> {
        Err(without_parquet())
    }

    pub(super) fn write<W>(_: W, _: &Contents<'_>) -> Result<()> {
        Err(without_parquet())
    }

    fn without_parquet() -> Error {
        let remedy =
            "this build omits Parquet: build it with the feature parquet, or convert to CSV or NPZ";
        Error::Format {
            extension: "parquet".into(),
            remedy: remedy.into(),
        }
    }
}
