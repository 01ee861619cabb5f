//! Whether recordings are good enough for a fit.

use lagrangian::CheckOptions;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::files::json;
use crate::recording::recordings;
use crate::threads::pool;

/// Checks recordings: a dictionary with the verdict and all items.
#[pyfunction]
#[pyo3(signature = (trajectories, low_pass=None))]
pub(crate) fn check<'py>(
    trajectories: &Bound<'py, PyAny>,
    low_pass: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = trajectories.py();
    let recordings = recordings(trajectories)?;
    let pool = pool(py)?;
    let report =
        py.detach(|| pool.install(|| lagrangian::check(&recordings, &CheckOptions { low_pass })));
    json(
        py,
        &serde_json::json!({ "verdict": report.verdict(), "items": report.items }),
    )
}
