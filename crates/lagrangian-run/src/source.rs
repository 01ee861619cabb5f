//! Recordings of a file: the layout beside it, the columns that were read, and those that were not.

use std::path::{Path, PathBuf};

use lagrangian::trajectory::Readings;
use lagrangian::{Layout, Learned, Provenance, Recording, SavedModel};
use serde::Serialize;

use crate::error::{Context, Error, Result};
use crate::folder::model_file;
use crate::formats::FileFormat;
use crate::hashing_reader::{FileHash, HashingReader};

/// The layout file for all data of its folder.
const LAYOUT: &str = "lagrangian.toml";

/// The content of one file.
#[derive(Debug)]
pub struct ReadFile {
    /// The recordings, in their order.
    pub recordings: Vec<Recording>,
    /// The hash of the file.
    pub hash: FileHash,
    /// The parts of the file that were read.
    pub source: Source,
    /// The parts that its reader skipped and the choices that it made, in sentences for people; settings are in backticks.
    pub notes: Vec<String>,
}

/// The parts of a file that were read, and those that were not.
#[derive(Debug, Serialize)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// The number of trajectories.
    pub trajectories: usize,
    /// The number of rows, also those of which a sample was taken.
    pub rows: usize,
    /// Columns that were not used.
    pub unused: Vec<String>,
    /// Other skipped parts and choices.
    pub notes: Vec<String>,
}

impl Source {
    fn of(path: &Path, readings: &Readings) -> Self {
        let all = |r: &Recording| r.part().map_or(r.len(), |part| part.rows);
        Self {
            path: path.into(),
            trajectories: readings.recordings.len(),
            rows: readings.recordings.iter().map(all).sum(),
            unused: readings.columns.ignored.clone(),
            notes: readings.notes.clone(),
        }
    }
}

/// The layout file for a data file, if there is one: that of its name, else that of its folder. A path of that name that cannot be
/// read is returned too, for the reader to refuse.
#[must_use]
pub fn layout_beside(path: &Path) -> Option<PathBuf> {
    let beside = [path.with_extension("toml"), path.with_file_name(LAYOUT)];
    beside
        .into_iter()
        .find(|file| file.symlink_metadata().is_ok())
}

/// Reads the recordings of a file with a complete layout, and hashes the content. `advice` is the remedy for columns that differ
/// from the layout.
///
/// # Errors
/// [`Error::Refused`](crate::Error::Refused), which names the file.
pub fn read_file(path: &Path, layout: &Layout, advice: &str) -> Result<ReadFile> {
    let shown = format!("cannot read '{}'", path.display());
    let format = FileFormat::of(path).context(&shown, "rename or convert the file")?;
    let access = "check that the file exists and may be read";
    let (file, hashing) = HashingReader::open(path).context(&shown, access)?;
    let name = path.file_stem().and_then(|stem| stem.to_str());
    let name = name.unwrap_or("recording");
    let readings = format
        .read(path, file, name, layout)
        .context(&shown, advice)?;
    let hash = hashing.finish().context(shown, access)?;
    let notes = readings.notes.iter().cloned();
    let notes = unused(&readings).into_iter().chain(notes);
    Ok(ReadFile {
        source: Source::of(path, &readings),
        notes: notes.chain(passive(&readings)).collect(),
        recordings: readings.recordings,
        hash,
    })
}

/// A saved model as its file holds it.
#[derive(Debug)]
pub struct ReadModel {
    /// The model.
    pub model: Learned,
    /// The origin of the model.
    pub provenance: Provenance,
    /// The hash of the file.
    pub hash: FileHash,
}

/// Reads a saved model, or that of the folder of a run, and hashes the content.
///
/// # Errors
/// [`Error::Refused`](crate::Error::Refused), with this hint, for a file that is not a model or is damaged.
pub fn read_model(path: &Path, hint: &str) -> Result<ReadModel> {
    let path = &model_file(path);
    let shown = format!("cannot read the model '{}'", path.display());
    let (reader, hashing) = HashingReader::open(path).context(&shown, hint)?;
    let saved = SavedModel::read(reader).context(&shown, hint)?;
    Ok(ReadModel {
        model: Learned::load(&saved).context(&shown, hint)?,
        hash: hashing.finish().context(shown, hint)?,
        provenance: saved.header.provenance,
    })
}

/// The columns that were not used, in words; `None` where all were.
#[must_use]
pub fn unused(readings: &Readings) -> Option<String> {
    let ignored = readings.columns.ignored.join(", ");
    (!ignored.is_empty()).then(|| format!("columns not used: {ignored}"))
}

/// The forces that are taken as 0 for want of a column, in words.
fn passive(readings: &Readings) -> Option<String> {
    let columns = &readings.columns.signals;
    let forces = columns.tau.iter().zip(&columns.q);
    let passive = forces.filter(|(force, _)| force.is_empty());
    let passive: Vec<&str> = passive.map(|(_, q)| q.as_str()).collect();
    let passive = passive.join(", ");
    let words = || format!("there is no column for the force on {passive}: it is taken as 0");
    (!passive.is_empty()).then(words)
}

/// The recordings with their forces shifted by these delays, s: one for all coordinates, one for each, or none.
///
/// # Errors
/// [`Error::Refused`](crate::Error::Refused), which names the recording.
pub fn delayed(recordings: Vec<Recording>, seconds: &[f64]) -> Result<Vec<Recording>> {
    let shifted = |recording: Recording| {
        let shown = format!("cannot shift the forces of '{}'", recording.name);
        let shifted = recording.delayed(seconds);
        shifted.context(shown, "correct `delay`")
    };
    if let Some(free) = recordings
        .iter()
        .find(|r| !seconds.is_empty() && r.tau.is_empty())
    {
        let finding = format!("`delay` shifts forces, and '{}' has none", free.name);
        return Err(Error::new(
            finding,
            "omit `delay`, or name the columns of the forces (`tau`)",
        ));
    }
    match seconds.is_empty() {
        true => Ok(recordings),
        false => recordings.into_iter().map(shifted).collect(),
    }
}
