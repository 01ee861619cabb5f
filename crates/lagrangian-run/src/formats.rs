//! The formats of files: those of the library, and those that a frontend reads for it.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use lagrangian::trajectory::{PackageFormat, Readings, Renamed, Signal, Table};
use lagrangian::{Error as LibraryError, Format, Layout, Trajectory};
use serde::Deserialize;
use tempfile::NamedTempFile;

use crate::error::{Cause, Context, Error, Result};
use crate::partial_files::PartialFiles;

/// The formats that a frontend reads and writes: those of [`PackageFormat`].
#[derive(Debug, Clone, Copy)]
pub struct FrontendFormats {
    /// The files of a folder, in the order in which they were recorded.
    pub files: fn(&Path) -> Result<Vec<PathBuf>, Cause>,
    /// Writes the columns of a file that the layout needs into another, which becomes an NPZ file.
    pub read: fn(&Path, &Path, &Layout) -> Result<TableFacts, Cause>,
    /// The bytes of a file with this extension, from those of an NPZ file.
    pub write: fn(&str, Vec<u8>) -> Result<Vec<u8>, Cause>,
}

/// Facts about a table that a frontend has read.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct TableFacts {
    /// Columns of signals, by their names, in place of those of the layout.
    columns: BTreeMap<String, Vec<String>>,
    notes: Vec<String>,
    renamed: Option<Renamed>,
}

static FRONTEND: OnceLock<FrontendFormats> = OnceLock::new();

/// Lets this process read the formats for which the crate has no reader of its own.
pub fn read_others_by(formats: FrontendFormats) {
    FRONTEND.get_or_init(|| formats);
}

/// The format of a file, by its extension.
#[derive(Debug, Clone, Copy)]
pub enum FileFormat {
    /// A format of the library.
    Own(Format),
    /// A format of the frontend.
    Frontend(PackageFormat, FrontendFormats),
}

impl FileFormat {
    /// The format of a file that is read.
    ///
    /// # Errors
    /// As [`Format::from_extension`].
    pub fn of(path: &Path) -> lagrangian::Result<Self> {
        let extension = extension(path);
        match (PackageFormat::from_extension(extension), FRONTEND.get()) {
            (Some(format), Some(frontend)) => Ok(Self::Frontend(format, *frontend)),
            _ => Format::from_extension(extension).map(Self::Own),
        }
    }

    /// The format of a file that is written.
    ///
    /// # Errors
    /// As [`Self::of`], also for a format that is read alone.
    pub fn to_write(path: &Path) -> lagrangian::Result<Self> {
        match Self::of(path)? {
            Self::Frontend(format, _) if !format.is_written => Err(LibraryError::Format {
                extension: format.extension.into(),
                remedy: format!("{} is read alone", format.name),
            }),
            format => Ok(format),
        }
    }

    /// The recordings of a file that is open already.
    pub(crate) fn read(
        self,
        path: &Path,
        file: impl Read + Seek + Send + 'static,
        name: &str,
        layout: &Layout,
    ) -> Result<Readings, Cause> {
        let frontend = match self {
            Self::Own(format) => return Ok(format.read(file, name, layout)?),
            Self::Frontend(_, frontend) => frontend,
        };
        let table = NamedTempFile::new()?;
        let _unfinished = PartialFiles::of([table.path().to_path_buf()]);
        let facts = (frontend.read)(path, table.path(), layout)?;
        let mut layout = layout.clone();
        for signal in Signal::IN_FILES {
            if let Some(names) = facts.columns.get(signal.name()) {
                layout.columns.get_mut(signal).clone_from(names);
            }
        }
        let mut readings = Format::Npz.read(table.reopen()?, name, &layout)?;
        readings.notes.extend(facts.notes);
        for recording in &mut readings.recordings {
            recording.columns.renamed.clone_from(&facts.renamed);
        }
        Ok(readings)
    }

    /// Writes trajectories, as [`Format::write`] does.
    ///
    /// # Errors
    /// Those of [`Format::write`], and those of the frontend.
    pub fn write(
        self,
        sink: impl Write + Seek + Send,
        trajectories: &[Trajectory],
    ) -> Result<(), Cause> {
        self.write_by(sink, |format, sink| format.write(sink, trajectories))
    }

    /// Writes named columns of numbers, as [`Format::write_table`] does.
    ///
    /// # Errors
    /// Those of [`Format::write_table`], and those of the frontend.
    pub fn write_table(self, sink: impl Write + Seek + Send, table: &Table) -> Result<(), Cause> {
        self.write_by(sink, |format, sink| format.write_table(sink, table))
    }

    fn write_by(
        self,
        mut sink: impl Write + Seek + Send,
        write: impl FnOnce(Format, &mut dyn crate::Sink) -> lagrangian::Result<()>,
    ) -> Result<(), Cause> {
        match self {
            Self::Own(format) => Ok(write(format, &mut sink)?),
            Self::Frontend(format, frontend) => {
                let mut table = Cursor::new(Vec::new());
                write(Format::Npz, &mut table)?;
                let bytes = (frontend.write)(format.extension, table.into_inner())?;
                Ok(sink.write_all(&bytes)?)
            }
        }
    }
}

fn extension(path: &Path) -> &str {
    let own = path.extension().and_then(|extension| extension.to_str());
    own.unwrap_or_default()
}

/// Whether a file is a bag of ROS 2, by its extension: of the formats of the package those that are read alone.
#[must_use]
pub fn is_bag(path: &Path) -> bool {
    PackageFormat::from_extension(extension(path)).is_some_and(|format| !format.is_written)
}

/// The named files, with those of a bag in place of its folder.
///
/// # Errors
/// [`Error::Refused`] for a folder that is not a bag.
pub fn files_of(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let hint =
        "give files; the folder of a ROS 2 bag is read after `pip install 'lagrangian[ros]'`";
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let shown = format!("cannot read the folder '{}'", path.display());
        let frontend = FRONTEND.get().ok_or_else(|| Error::new(&shown, hint))?;
        files.extend((frontend.files)(path).context(shown, hint)?);
    }
    Ok(files)
}
