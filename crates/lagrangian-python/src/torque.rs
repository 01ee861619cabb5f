//! The parts of the torques of a model.

use lagrangian::torque::parts;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Rows, array, shown};
use crate::error::{invalid, raise};
use crate::model::Model;

/// The parts of the torques at states, by their names, in the shape of q.
#[pyfunction]
pub(crate) fn torque_parts<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    q: &Bound<'py, PyAny>,
    qd: &Bound<'py, PyAny>,
    qdd: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let body = model.get().body();
    let model = body.model();
    let n = lagrangian::Model::coordinates(model).dof();
    let q = Rows::new(q, "q", n)?;
    let (qd, qdd) = (Rows::new(qd, "qd", n)?, Rows::new(qdd, "qdd", n)?);
    for (name, other) in [("qd", &qd), ("qdd", &qdd)] {
        if other.shape() != q.shape() {
            let (found, wanted) = (shown(other.shape()), shown(q.shape()));
            return Err(invalid(
                py,
                format!("{name} has shape {found}: give {wanted}, that of q"),
            ));
        }
    }
    let values = [q.values(), qd.values(), qdd.values()];
    let found = py.detach(|| parts(&mut *model.evaluator(), values[0], values[1], values[2]));
    body.raised()?;
    let Some(found) = found else {
        let message =
            "the model has no torques: take a model with a Lagrangian, such as Lnn, Delan or Rigid";
        return Err(raise(py, "NotSupported", message));
    };
    let all = PyDict::new(py);
    for (name, values) in found.named() {
        all.set_item(name, array(py, values.to_vec(), q.shape())?)?;
    }
    Ok(all)
}
