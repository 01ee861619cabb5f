//! The names of a sweep: the hashes of its recordings, and of each of its fits.

use lagrangian_run::Data;
use pyo3::prelude::*;

use crate::error::OrRaise;
use crate::files::value;
use crate::fit::spec;
use crate::recording::recordings;

/// The hashes of the content of recordings, whatever files they come from: an entry for each role.
#[pyfunction]
pub(crate) fn content_hashes<'py>(
    training: &Bound<'py, PyAny>,
    validation: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let data = Data {
        training: recordings(training)?,
        validation: recordings(validation)?,
        ..Data::default()
    };
    let py = training.py();
    value(py, &py.detach(|| data.hashed()).hashes)
}

/// The name of the folder of a fit to recordings with these roles and hashes; refuses invalid values of settings.
#[pyfunction]
pub(crate) fn unit_name(
    py: Python<'_>,
    request: &str,
    layout: &str,
    data: Vec<(String, String)>,
) -> PyResult<String> {
    lagrangian_run::unit_name(spec(request)?, &data, layout).or_raise(py)
}
