//! Bags of ROS 2: `lagrangian._bags` makes tables of their joint states, which are read like files.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use lagrangian::trajectory::{Readings, Renamed, Signal};
use lagrangian::{Format, Layout};
use lagrangian_run::{BagReader, Cause};
use pyo3::prelude::*;
use serde::Deserialize;

use crate::error::Raised;

/// The reader of bags for all parts of the library.
pub(crate) const READER: BagReader = BagReader { files, read };

/// The signals that a bag holds.
const RECORDED: [Signal; 3] = [Signal::Q, Signal::Qd, Signal::Tau];

/// Facts about the table of a bag.
#[derive(Deserialize)]
struct About {
    /// Columns of the signals.
    columns: [Vec<String>; 3],
    notes: Vec<String>,
    renamed: Option<Renamed>,
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, Cause> {
    of_python(|bags| bags.call_method1("files", (folder,))?.extract())
}

fn read(path: &Path, name: &str, layout: &Layout) -> Result<Readings, Cause> {
    let asked = RECORDED.map(|signal| layout.columns.get(signal));
    let arguments = (path, &layout.topic, asked, &layout.actuated);
    let read = |bags: &Bound<'_, PyModule>| bags.call_method1("read", arguments)?.extract();
    let (table, about): (Vec<u8>, String) = of_python(read)?;
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

/// What a call of `lagrangian._bags` returns.
fn of_python<T>(call: impl FnOnce(&Bound<'_, PyModule>) -> PyResult<T>) -> Result<T, Cause> {
    Python::attach(|py| {
        let result = py.import("lagrangian._bags").and_then(|bags| call(&bags));
        result.map_err(|e| {
            let (class, message) = (e.get_type(py).unbind(), e.value(py).to_string());
            Raised { class, message }.into()
        })
    })
}
