//! Bags of ROS 2: `lagrangian._bags` makes tables of their joint states, which are read like files.

use std::io::Cursor;
use std::path::Path;

use lagrangian::trajectory::Renamed;
use lagrangian::{Format, Layout, Readings, Signal};
use lagrangian_run::Cause;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use crate::error::Raised;

/// Facts about the table of a bag.
#[derive(Deserialize)]
struct About {
    /// Columns of the signals.
    columns: [Vec<String>; 3],
    notes: Vec<String>,
    renamed: Option<Renamed>,
}

/// The signals that a bag holds.
const RECORDED: [Signal; 3] = [Signal::Q, Signal::Qd, Signal::Tau];

/// Reads a file of a bag for any part of the library.
pub(crate) fn read(path: &Path, name: &str, layout: &Layout) -> Result<Readings, Cause> {
    let table = Python::attach(|py| table(py, path, layout).map_err(|e| Raised::new(py, &e)));
    let (table, about) = table?;
    let about: About = serde_json::from_str(&about)?;
    let mut layout = layout.clone();
    for (signal, names) in RECORDED.into_iter().zip(about.columns) {
        *layout.columns.get_mut(signal) = names;
    }
    let mut readings = Format::Npz.read(Cursor::new(table), name, &layout)?;
    readings.notes.extend(about.notes);
    for recording in &mut readings.recordings {
        recording.columns.renamed.clone_from(&about.renamed);
    }
    Ok(readings)
}

fn table(py: Python<'_>, path: &Path, layout: &Layout) -> PyResult<(Vec<u8>, String)> {
    let asked = PyDict::new(py);
    for signal in RECORDED {
        asked.set_item(signal.name(), layout.columns.get(signal))?;
    }
    let bags = py.import("lagrangian._bags")?;
    let arguments = (path, &layout.topic, asked, &layout.actuated);
    bags.call_method1("read", arguments)?.extract()
}
