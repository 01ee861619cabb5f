//! Data from files.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use lagrangian::trajectory::{
    Readings,
    csv::{self, Look},
};
use lagrangian::{Format, Layout, Recording, Signals, Trajectory};
use lagrangian_run::{Columns as Read, Data, DataFile, FileHash};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{Error, Result, bounded};
use crate::limits;

/// Number of rows that are shown.
const SHOWN: usize = 5;

/// A file that was dropped on the page.
#[derive(Debug)]
pub(crate) struct UploadedFile {
    name: String,
    hash: FileHash,
    bytes: Vec<u8>,
    look: Look,
}

/// A preview of a file.
#[derive(Debug, Serialize)]
pub(crate) struct Inspected {
    /// Its columns.
    headers: Vec<String>,
    /// Its first rows.
    rows: Vec<Vec<String>>,
    /// Skipped or changed parts, in sentences.
    notes: Vec<String>,
    /// The column that looks like time.
    time: Option<String>,
    /// The columns that look like coordinates.
    coordinates: Vec<String>,
    /// Whether names of columns mention degrees. Conversion requires the consent of a person.
    degrees: bool,
}

/// Recordings for a fit, and the columns of their file.
#[derive(Debug, Clone)]
pub(crate) struct Given {
    pub(crate) data: Data,
    /// The columns as requested; null without a file.
    pub(crate) columns: Value,
}

impl Given {
    /// Recordings without a file.
    pub(crate) fn recorded(recordings: Vec<Recording>) -> Self {
        let data = Data {
            training: recordings,
            ..Data::default()
        };
        Self {
            data: data.hashed(),
            columns: Value::Null,
        }
    }
}

/// The meaning of the columns of the file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Columns {
    t: String,
    q: Vec<String>,
    #[serde(default)]
    qd: Vec<String>,
    #[serde(default)]
    tau: Vec<String>,
    #[serde(default)]
    angles: Vec<String>,
    #[serde(default)]
    degrees: bool,
    #[serde(default)]
    trajectory: Option<String>,
}

/// A summary of the data.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    recordings: usize,
    samples: usize,
    coordinates: Vec<crate::system::Axis>,
    notes: Vec<String>,
    /// Times and positions of the first recording.
    t: Vec<f64>,
    q: Vec<Option<f64>>,
}

impl UploadedFile {
    /// Adds a file.
    pub(crate) fn new(name: String, bytes: &[u8]) -> Result<Self> {
        let look = csv::look(bytes, SHOWN)?;
        if look.headers.len() < 2 {
            return Err(Error::Refused {
                finding: format!("'{name}' has no table with several columns"),
                remedy: "save it as CSV, with a line of names and one row a sample".into(),
            });
        }
        within_bounds(&look.headers)?;
        Ok(Self {
            name,
            hash: FileHash::of(bytes),
            bytes: bytes.into(),
            look,
        })
    }

    /// Its size, bytes.
    pub(crate) fn size(&self) -> usize {
        self.bytes.len()
    }

    /// The preview of the file.
    pub(crate) fn inspected(&self) -> Inspected {
        let Look {
            headers,
            rows,
            notes,
        } = self.look.clone();
        let degrees = |name: &String| name.contains('°') || name.to_lowercase().contains("deg");
        Inspected {
            time: csv::time(&headers),
            coordinates: csv::coordinates(&headers),
            degrees: headers.iter().any(degrees),
            headers,
            rows,
            notes,
        }
    }

    fn file(&self) -> DataFile {
        DataFile::new("training", Path::new(&self.name), self.hash.clone())
    }

    fn readings(&self, layout: &Layout) -> Result<Readings> {
        let source = Cursor::new(self.bytes.clone());
        let stem = Path::new(&self.name).file_stem();
        let stem = stem.and_then(|stem| stem.to_str()).unwrap_or(&self.name);
        Ok(Format::Csv.read(source, stem, layout)?)
    }
}

/// Refuses more columns, or longer names, than a page can show.
fn within_bounds(headers: &[String]) -> Result<()> {
    let remedy = "keep the columns of time and of what moves, or use the command `lagrangian`";
    let (columns, most) = (headers.len() as f64, limits::COLUMNS as f64);
    bounded("the number of columns", columns, most, remedy)?;
    let longest = headers.iter().map(String::len).max();
    let (longest, most) = (longest.unwrap_or(0) as f64, limits::NAME as f64);
    let remedy = "give the columns short names in the first line";
    let what = "the longest name of a column in bytes";
    bounded(what, longest, most, remedy)
}

/// The recordings of files by these columns, and notes of the reader.
pub(crate) fn read(files: &[UploadedFile], columns: Columns) -> Result<(Given, Vec<String>)> {
    let shown = serde_json::to_value(&columns)?;
    let layout = columns.layout();
    let mut data = Data {
        layout: layout.to_toml()?,
        columns: Some(Read::of([(PathBuf::new(), layout.clone())], None)?),
        hashes: files.iter().map(UploadedFile::file).collect(),
        ..Data::default()
    };
    let (mut notes, mut ignored) = (Vec::new(), Vec::new());
    for file in files {
        let readings = file.readings(&layout)?;
        data.training.extend(readings.recordings);
        let told = |note: &String| !file.look.notes.contains(note);
        notes.extend(readings.notes.into_iter().filter(told));
        ignored.extend(readings.columns.ignored);
    }
    ignored.sort_unstable();
    ignored.dedup();
    if !ignored.is_empty() {
        notes.push(format!(
            "columns that were not used: {}",
            ignored.join(", ")
        ));
    }
    let given = Given {
        data,
        columns: shown,
    };
    Ok((given, notes))
}

impl Columns {
    fn layout(self) -> Layout {
        Layout {
            t: Some(self.t),
            trajectory: self.trajectory,
            columns: Signals {
                q: self.q,
                qd: self.qd,
                tau: self.tau,
                ..Signals::default()
            },
            angles: self.angles,
            degrees: self.degrees,
            ..Layout::default()
        }
    }
}

impl Summary {
    /// The summary of these recordings.
    pub(crate) fn of(recordings: &[Recording], notes: Vec<String>) -> Result<Self> {
        let first = recordings.first().ok_or(Error::Missing {
            what: "recording in the data",
            remedy: "take a file that holds some rows",
        })?;
        let shown = first.len().min(2000);
        let finite = |x: &f64| x.is_finite().then_some(*x);
        Ok(Self {
            recordings: recordings.len(),
            samples: recordings.iter().map(Recording::len).sum(),
            coordinates: crate::system::axes(&first.coordinates),
            notes,
            t: first.t.iter().take(shown).copied().collect(),
            q: first
                .q
                .iter()
                .take(shown * first.dof())
                .map(finite)
                .collect(),
        })
    }
}

/// Recordings as CSV with the usual names of columns.
pub(crate) fn csv(recordings: &[Recording]) -> Result<Vec<u8>> {
    let motion =
        |own: &Recording| Trajectory::new(own.name.clone(), own.t.clone(), own.signals.clone());
    let motions: Vec<Trajectory> = recordings.iter().map(motion).collect();
    let mut bytes = Vec::new();
    csv::write(&mut bytes, &motions)?;
    Ok(bytes)
}
