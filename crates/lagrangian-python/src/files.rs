//! Recordings from files, and into them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use lagrangian::trajectory::{Readings, Sampling, thin};
use lagrangian::{Format, Layout, Recording};
use lagrangian_run::{
    Cause, Context, FileFormat, ReadFile, files_of, layout_beside, read_file, text, unused,
};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::error::{OrRaise, invalid, of_json};
use crate::recording::{parts, recording};

/// The columns of signals, as in the keywords of `lagrangian.read`.
#[derive(Debug, FromPyObject)]
pub(crate) struct ColumnSpec {
    #[pyo3(item)]
    columns: BTreeMap<String, Vec<String>>,
    #[pyo3(item)]
    trajectory: Option<String>,
    #[pyo3(item)]
    time: Option<String>,
    #[pyo3(item)]
    topic: Option<String>,
    #[pyo3(item)]
    angles: Vec<String>,
    #[pyo3(item)]
    parameters: Vec<String>,
    #[pyo3(item)]
    actuated: Vec<String>,
    #[pyo3(item)]
    units: BTreeMap<String, String>,
    #[pyo3(item)]
    degrees: bool,
    #[pyo3(item)]
    every: usize,
    /// The text of a layout file, for all that is not given above.
    #[pyo3(item)]
    layout: String,
    /// The largest number of rows that are kept.
    #[pyo3(item)]
    rows: Option<usize>,
}

impl ColumnSpec {
    fn layout(&self, py: Python<'_>) -> PyResult<Layout> {
        let mut layout = Layout {
            trajectory: self.trajectory.clone(),
            topic: self.topic.clone(),
            t: self.time.clone(),
            angles: self.angles.clone(),
            parameters: self.parameters.clone(),
            actuated: self.actuated.clone(),
            units: self.units.clone(),
            degrees: self.degrees,
            every: self.every,
            ..Layout::default()
        };
        for signal in lagrangian::trajectory::Signal::IN_FILES {
            let Some(words) = self.columns.get(signal.name()).filter(|w| !w.is_empty()) else {
                continue;
            };
            match signal.is_of_drive() {
                true => layout.declare(signal, words.clone()).or_raise(py)?,
                false => *layout.columns.get_mut(signal) = words.clone(),
            }
        }
        Ok(layout.or(Layout::from_toml(&self.layout).or_raise(py)?))
    }
}

/// The parts that a reader of a table skipped and the choices that it made, in sentences.
fn notes(readings: &Readings) -> Vec<String> {
    unused(readings)
        .into_iter()
        .chain(readings.notes.clone())
        .collect()
}

/// The content of a file, and its layout, completed from the file beside it.
fn one_file(
    path: &Path,
    layout: Layout,
    sample: Option<Sampling>,
) -> lagrangian_run::Result<(ReadFile, Layout)> {
    let layout = match layout_beside(path) {
        Some(file) => layout.or(Layout::from_toml(
            &text(&file).map_err(lagrangian::Error::Io)?,
        )?),
        None => layout,
    };
    let advice = "name its columns, or describe them in a layout file beside it";
    let sampled = Layout {
        sample,
        ..layout.clone()
    };
    Ok((read_file(path, &sampled, advice)?, layout))
}

/// The parts of recordings, the notes of their reader, and the layout.
type Contents<'py> = (Bound<'py, PyList>, Vec<String>, String);

/// The content of files, for Python.
fn contents<'py>(
    py: Python<'py>,
    recordings: Vec<Recording>,
    notes: Vec<String>,
    layout: Layout,
) -> PyResult<Contents<'py>> {
    let all = PyList::empty(py);
    for recording in recordings {
        let Recording {
            name,
            coordinates,
            t,
            signals,
            ..
        } = recording;
        all.append(parts(py, &name, &coordinates, t, signals)?)?;
    }
    let layout = Layout { every: 0, ..layout };
    Ok((all, notes, layout.to_toml().or_raise(py)?))
}

/// Reads the recordings of files: the parts of each, notes, and the layout of the first.
#[pyfunction]
pub(crate) fn read<'py>(
    py: Python<'py>,
    paths: Vec<PathBuf>,
    columns: ColumnSpec,
) -> PyResult<Contents<'py>> {
    let (mut all, mut notes, mut first) = (Vec::new(), Vec::new(), None);
    let (seed, stretch) = (0, Sampling::LONGEST);
    let sample = columns.rows.map(|rows| Sampling {
        rows,
        seed,
        stretch,
    });
    for path in &files_of(&paths).or_raise(py)? {
        let layout = columns.layout(py)?;
        let shown = path.display();
        let (file, layout) = py
            .detach(|| one_file(path, layout, sample))
            .or_raise(py)
            .map_err(|error| about(py, error, path))?;
        notes.extend(file.notes.iter().map(|note| format!("'{shown}': {note}")));
        first.get_or_insert(layout);
        all.extend(file.recordings);
        sample.iter().for_each(|own| thin(&mut all, own));
    }
    contents(py, all, notes, first.unwrap_or_default())
}

/// An error of the operating system names the file, as Python's own errors do; other errors name it already.
fn about(py: Python<'_>, error: PyErr, file: &Path) -> PyErr {
    let value = error.value(py);
    let code = value.getattr("errno").and_then(|code| code.extract());
    let words = value.getattr("strerror").and_then(|words| words.extract());
    match (code, words) {
        (Ok::<i32, _>(code), Ok::<String, _>(words)) => {
            PyOSError::new_err((code, words, file.display().to_string()))
        }
        _ => error,
    }
}

/// Reads the recordings of a table, whose columns come as an NPZ file in memory.
#[pyfunction]
pub(crate) fn read_table<'py>(
    py: Python<'py>,
    table: Vec<u8>,
    columns: ColumnSpec,
) -> PyResult<Contents<'py>> {
    let layout = columns.layout(py)?;
    let read = py.detach(|| Format::Npz.read(Cursor::new(table), "table", &layout));
    let readings = read.or_raise(py)?;
    let notes = notes(&readings);
    contents(py, readings.recordings, notes, layout)
}

/// Writes trajectories to a file, and their layout beside it.
#[pyfunction]
pub(crate) fn write(py: Python<'_>, path: PathBuf, motions: &Bound<'_, PyAny>) -> PyResult<()> {
    let motions = motions.try_iter()?.map(|motion| recording(&motion?));
    let recordings: Vec<Recording> = motions.collect::<PyResult<_>>()?;
    let Some(first) = recordings.first() else {
        return Err(invalid(py, "trajectories is empty: give at least one"));
    };
    let layout = Layout::written(&first.coordinates).to_toml().or_raise(py)?;
    let format = FileFormat::to_write(&path).or_raise(py)?;
    let trajectories = recordings.into_iter().map(|r| {
        r.validate()?;
        Ok(lagrangian::Trajectory::new(r.name, r.t, r.signals))
    });
    let trajectories: Vec<_> = trajectories
        .collect::<lagrangian::Result<_>>()
        .or_raise(py)?;
    let write = || -> lagrangian_run::Result<()> {
        let shown = format!("cannot write '{}'", path.display());
        let file = File::create(&path).map_err(Cause::from);
        let written = file.and_then(|file| format.write(file, &trajectories));
        written.context(shown, "")?;
        Ok(std::fs::write(path.with_extension("toml"), layout).map_err(lagrangian::Error::Io)?)
    };
    py.detach(write).or_raise(py)
}

/// A value of Python from a value with a form in JSON.
pub(crate) fn value<'py>(
    py: Python<'py>,
    value: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = of_json(serde_json::to_string(value))?;
    py.import("json")?.getattr("loads")?.call1((text,))
}

/// A dictionary from an object in JSON.
pub(crate) fn json<'py>(
    py: Python<'py>,
    object: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyDict>> {
    Ok(value(py, object)?.cast_into::<PyDict>()?)
}
