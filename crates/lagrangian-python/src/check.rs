//! The check of recordings before a fit.

use std::time::Duration;

use lagrangian::{CheckOptions, CheckReport};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json as object};

use crate::files::json;
use crate::recording::recordings;
use crate::threads::interruptible;

/// Checks recordings: a dictionary with the verdict and all items.
#[pyfunction]
#[pyo3(signature = (trajectories, low_pass=None))]
pub(crate) fn check<'py>(
    trajectories: &Bound<'py, PyAny>,
    low_pass: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = trajectories.py();
    let recordings = recordings(trajectories)?;
    let options = CheckOptions { low_pass };
    let work = |_| lagrangian::check(&recordings, &options);
    let report = interruptible(py, Duration::MAX, work)?;
    json(py, &findings(&report))
}

/// The verdict, all items, and the items that are shown.
pub(crate) fn findings(report: &CheckReport) -> Value {
    object!({ "verdict": report.verdict(), "items": report.items, "shown": report.shown() })
}
