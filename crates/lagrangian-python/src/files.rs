//! Recordings from files, and into them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use lagrangian::{Format, Layout, Readings, Recording};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::error::{OrRaise, invalid, of_json};
use crate::recording::{parts, recording};

/// Which columns are what, as the keywords of `lagrangian.read` say it.
#[derive(Debug, FromPyObject)]
pub(crate) struct Told {
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
}

impl Told {
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
        for signal in lagrangian::Signal::IN_FILES {
            let Some(words) = self.columns.get(signal.name()).filter(|w| !w.is_empty()) else {
                continue;
            };
            match signal.is_of_drive() {
                true => layout.tell(signal, words.clone()).or_raise(py)?,
                false => *layout.columns.get_mut(signal) = words.clone(),
            }
        }
        Ok(layout)
    }
}

/// The layout file that speaks for a data file, if there is one.
fn beside(path: &Path) -> Option<PathBuf> {
    let files = [
        path.with_extension("toml"),
        path.with_file_name("lagrangian.toml"),
    ];
    files.into_iter().find(|file| file.is_file())
}

fn format(path: &Path) -> lagrangian::Result<Format> {
    let extension = path.extension().and_then(|e| e.to_str());
    Format::from_extension(extension.unwrap_or_default())
}

/// What a reader passed over or decided, in sentences.
fn notes(readings: &Readings) -> Vec<String> {
    let ignored = readings.columns.ignored.join(", ");
    let unused = (!ignored.is_empty()).then(|| format!("columns not used: {ignored}"));
    unused.into_iter().chain(readings.notes.clone()).collect()
}

/// The recordings of a file, its columns that were not used, and what else its reader says.
fn one_file(
    path: &Path,
    layout: Layout,
) -> lagrangian::Result<(Vec<Recording>, Vec<String>, Layout)> {
    let layout = match beside(path) {
        Some(file) => layout.or(Layout::from_toml(&std::fs::read_to_string(file)?)?),
        None => layout,
    };
    let name = path.file_stem().and_then(|stem| stem.to_str());
    let readings = format(path)?.read(File::open(path)?, name.unwrap_or("recording"), &layout)?;
    let notes = notes(&readings);
    Ok((readings.recordings, notes, layout))
}

/// The parts of recordings, what their reader says, and the layout.
type Contents<'py> = (Bound<'py, PyList>, Vec<String>, String);

/// What was read, for Python.
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
    told: Told,
) -> PyResult<Contents<'py>> {
    let (mut all, mut notes, mut first) = (Vec::new(), Vec::new(), None);
    for path in &paths {
        let layout = told.layout(py)?;
        let shown = path.display();
        let read = py.detach(|| one_file(path, layout));
        let (recordings, own, layout) = read
            .or_raise(py)
            .map_err(|error| about(py, &error, &shown))?;
        notes.extend(own.iter().map(|note| format!("'{shown}': {note}")));
        first.get_or_insert(layout);
        all.extend(recordings);
    }
    contents(py, all, notes, first.unwrap_or_default())
}

/// The same exception, which says which file it is about.
fn about(py: Python<'_>, error: &PyErr, file: &impl std::fmt::Display) -> PyErr {
    let value = error.value(py);
    if let Ok(code) = value
        .getattr("errno")
        .and_then(|code| code.extract::<i32>())
    {
        let words = value
            .getattr("strerror")
            .and_then(|words| words.extract::<String>());
        return PyOSError::new_err((code, words.unwrap_or_default(), file.to_string()));
    }
    match error.get_type(py).call1((format!("'{file}': {value}"),)) {
        Ok(named) => PyErr::from_value(named),
        Err(other) => other,
    }
}

/// Reads the recordings of a table, whose columns come as an NPZ file in memory.
#[pyfunction]
pub(crate) fn read_table<'py>(
    py: Python<'py>,
    table: Vec<u8>,
    told: Told,
) -> PyResult<Contents<'py>> {
    let layout = told.layout(py)?;
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
    let format = format(&path).or_raise(py)?;
    let trajectories = recordings.into_iter().map(|r| {
        r.validate()?;
        Ok(lagrangian::Trajectory::new(r.name, r.t, r.signals))
    });
    let trajectories: Vec<_> = trajectories
        .collect::<lagrangian::Result<_>>()
        .or_raise(py)?;
    py.detach(|| {
        format.write(File::create(&path)?, &trajectories)?;
        Ok(std::fs::write(path.with_extension("toml"), layout)?)
    })
    .or_raise(py)
}

/// A value of Python from what has a form in JSON.
pub(crate) fn value<'py>(
    py: Python<'py>,
    value: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = of_json(serde_json::to_string(value))?;
    py.import("json")?.getattr("loads")?.call1((text,))
}

/// A dictionary from what is an object in JSON.
pub(crate) fn json<'py>(
    py: Python<'py>,
    object: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyDict>> {
    Ok(value(py, object)?.cast_into::<PyDict>()?)
}
