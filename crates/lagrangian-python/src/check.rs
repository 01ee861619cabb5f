//! What is found in recordings before a fit: the check, and constraints.

use std::time::Duration;

use lagrangian::constraints::{Point, find_in};
use lagrangian::{CheckOptions, CheckReport};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json as object};

use crate::error::OrRaise;
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

/// Finds the constraints between points: a dictionary with the points, the constraints and the number of degrees of freedom.
#[pyfunction]
#[pyo3(signature = (trajectories, points=None))]
pub(crate) fn constraints<'py>(
    trajectories: &Bound<'py, PyAny>,
    points: Option<Vec<Vec<usize>>>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = trajectories.py();
    let recordings = recordings(trajectories)?;
    let coordinates = recordings.first().map(|own| &own.coordinates);
    let points = points.zip(coordinates).map(|(points, coordinates)| {
        let point = |axes| Point::of(coordinates, axes);
        points.into_iter().map(point).collect()
    });
    let work = |_| find_in(&recordings, points);
    let found = interruptible(py, Duration::MAX, work)?.or_raise(py)?;
    json(py, &object!(found))
}

/// The verdict, all items, and the items that are shown.
pub(crate) fn findings(report: &CheckReport) -> Value {
    object!({ "verdict": report.verdict(), "items": report.items, "shown": report.shown() })
}
