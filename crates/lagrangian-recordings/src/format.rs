//! The file formats, one line each.

use std::io::{Read, Seek, Write};

use super::contents::Contents;
#[cfg(not(target_family = "wasm"))]
use super::npz;
use super::{Layout, Readings, Table};
use lagrangian_motion::Trajectory;
use lagrangian_motion::{Error, Result};

/// A file format for trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated text with a header.
    Csv,
    /// A zip of `NumPy` arrays.
    Npz,
}

impl Format {
    /// All formats with their file extensions.
    pub const ALL: [(Self, &'static str); 2] = [(Self::Csv, "csv"), (Self::Npz, "npz")];

    /// The format of files with this extension (`txt`, `tsv`, `dat` and `lvm` are text as well).
    ///
    /// # Errors
    /// [`Error::Format`], which lists the known ones.
    pub fn from_extension(extension: &str) -> Result<Self> {
        let lower = extension.trim_start_matches('.').to_ascii_lowercase();
        if matches!(lower.as_str(), "txt" | "tsv" | "dat" | "lvm") {
            return Ok(Self::Csv);
        }
        Self::ALL
            .iter()
            .find(|(_, e)| *e == lower)
            .map(|(format, _)| *format)
            .ok_or_else(|| Error::Format {
                remedy: instead_of(&lower),
                extension: lower,
            })
    }

    /// Reads all recordings of a file; `name` is the name of a recording without a `trajectory` column.
    ///
    /// # Errors
    /// See [`super::csv::read`]; [`Error::Format`] where this build omits the format.
    pub fn read<R>(self, source: R, name: &str, layout: &Layout) -> Result<Readings>
    where
        R: Read + Seek + Send + 'static,
    {
        let mut readings = match self {
            Self::Csv => super::csv::read(source, name, layout),
            Self::Npz => npz::read(source, name, layout),
        }?;
        for recording in &mut readings.recordings {
            layout.drive.complete(name, recording)?;
        }
        Ok(readings)
    }

    /// Writes trajectories so that [`Format::read`] with the default layout returns the same bits.
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
    /// [`Error::Io`]; [`Error::Shape`] for columns of different lengths; [`Error::Format`] where this build omits the
    /// format.
    pub fn write_table<W: Write + Seek + Send>(self, sink: W, table: &Table) -> Result<()> {
        self.write_contents(sink, &Contents::of_table(table)?)
    }

    fn write_contents<W: Write + Seek + Send>(self, sink: W, contents: &Contents) -> Result<()> {
        match self {
            Self::Csv => super::csv::write_contents(sink, contents),
            Self::Npz => npz::write(sink, contents),
        }
    }
}

/// A format that the Python package reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PackageFormat {
    /// The file extension.
    pub extension: &'static str,
    /// Its name in messages.
    pub name: &'static str,
    /// The extra of the package that installs its reader.
    pub extra: &'static str,
    /// Whether it is written too.
    pub is_written: bool,
}

impl PackageFormat {
    /// All formats that the package reads.
    pub const ALL: [Self; 3] = [
        Self::new("parquet", "a Parquet file", "parquet", true),
        Self::new("db3", "a bag of ROS 2", "ros", false),
        Self::new("mcap", "a bag of ROS 2", "ros", false),
    ];

    const fn new(
        extension: &'static str,
        name: &'static str,
        extra: &'static str,
        is_written: bool,
    ) -> Self {
        Self {
            extension,
            name,
            extra,
            is_written,
        }
    }

    /// The format of files with this extension.
    #[must_use]
    pub fn from_extension(extension: &str) -> Option<Self> {
        let is_own = |own: &Self| own.extension.eq_ignore_ascii_case(extension);
        Self::ALL.into_iter().find(is_own)
    }
}

/// Advice for a file of an unknown extension.
fn instead_of(extension: &str) -> String {
    match extension {
        "bag" => "it is a bag of ROS 1: convert it with `rosbags-convert --src a.bag --dst a` and give the folder".into(),
        "" => "the end of its name tells the format: rename it, such as to motion.csv (standard input is not read)".into(),
        "mat" => "it is a file of MATLAB: write `writetable(array2table([t q]), 'motion.csv')` there, or in Python `numpy.savez('motion.npz', **scipy.io.loadmat('motion.mat', squeeze_me=True))`".into(),
        "zip" => "it is an archive: unpack it, and give the CSV files in it".into(),
        "gz" => "it is compressed: unpack it with `gunzip`".into(),
        "xlsx" | "xls" | "ods" => "it is a spreadsheet: save it as CSV (also read: csv, npz)".into(),
        "gif" | "mp4" | "mov" | "avi" | "mkv" | "webm" | "m4v" => "it is a film: `lagrangian fit` of the Python package learns from it, `pip install 'lagrangian[pixels]'`".into(),
        "zstd" | "zst" => "it is compressed: unpack it with `zstd -d`".into(),
        _ => match PackageFormat::from_extension(extension) {
            Some(PackageFormat { name, extra, .. }) => format!(
                "it is {name}, for which the same command of the Python package is needed: `pip install 'lagrangian[{extra}]'`"
            ),
            None => format!("use one of {}", Format::ALL.map(|(_, e)| e).join(", ")),
        },
    }
}

/// NPZ in a browser, where the reader of zip archives would request random numbers.
#[cfg(target_family = "wasm")]
mod npz {
    use super::{Contents, Error, Layout, Readings, Result};

    pub(super) fn read<R>(_: R, _: &str, _: &Layout) -> Result<Readings> {
        Err(without_npz())
    }

    pub(super) fn write<W>(_: W, _: &Contents<'_>) -> Result<()> {
        Err(without_npz())
    }

    fn without_npz() -> Error {
        Error::Format {
            extension: "npz".into(),
            remedy: "a browser reads CSV alone: `lagrangian convert` writes it".into(),
        }
    }
}
