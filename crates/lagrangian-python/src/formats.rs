//! Formats that are read in Python: `lagrangian._formats` makes tables of their columns, which are read like NPZ files.

use std::path::{Path, PathBuf};

use lagrangian::Layout;
use lagrangian::trajectory::Signal;
use lagrangian_run::{Cause, FrontendFormats, TableFacts};
use pyo3::prelude::*;

use crate::error::{OrRaise, Raised, invalid};

/// The readers and writers for all parts of the library.
pub(crate) const FORMATS: FrontendFormats = FrontendFormats { files, read, write };

/// The columns that a layout needs of a file.
#[pyclass(frozen)]
pub(crate) struct Asked(Layout);

#[pymethods]
impl Asked {
    /// The topic of a bag.
    #[getter]
    fn topic(&self) -> Option<&str> {
        self.0.topic.as_deref()
    }

    /// The joints that forces act on; all where there are none.
    #[getter]
    fn actuated(&self) -> Vec<String> {
        self.0.actuated.clone()
    }

    /// The columns of a signal that were named.
    fn columns(&self, py: Python<'_>, signal: &str) -> PyResult<Vec<String>> {
        let own = Signal::IN_FILES
            .into_iter()
            .find(|own| own.name() == signal);
        let own = own.ok_or_else(|| invalid(py, format!("there is no signal '{signal}'")))?;
        Ok(self.0.columns.get(own).clone())
    }

    /// Whether the layout reads a column of this name, with or without a number after it.
    fn asks_for(&self, name: &str) -> bool {
        self.0.asks_for(name)
    }

    /// Of arrays, each with its name and the number of its columns where it has two axes, the indices of those that are read.
    fn used(&self, py: Python<'_>, arrays: Vec<(String, Option<usize>)>) -> PyResult<Vec<usize>> {
        self.0.used_arrays(&arrays).or_raise(py)
    }
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, Cause> {
    of_python(|formats| formats.call_method1("files", (folder,))?.extract())
}

fn read(path: &Path, table: &Path, layout: &Layout) -> Result<TableFacts, Cause> {
    let asked = Asked(layout.clone());
    let facts: String = of_python(|formats| {
        formats
            .call_method1("read", (path, table, asked))?
            .extract()
    })?;
    Ok(serde_json::from_str(&facts)?)
}

fn write(extension: &str, table: Vec<u8>) -> Result<Vec<u8>, Cause> {
    let table = std::borrow::Cow::from(table);
    of_python(|formats| formats.call_method1("write", (extension, table))?.extract())
}

/// What a call of `lagrangian._formats` returns.
fn of_python<T>(call: impl FnOnce(&Bound<'_, PyModule>) -> PyResult<T>) -> Result<T, Cause> {
    Python::attach(|py| {
        let result = py
            .import("lagrangian._formats")
            .and_then(|formats| call(&formats));
        result.map_err(|error| Raised::of(py, &error).into())
    })
}
