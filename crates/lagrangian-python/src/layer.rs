//! Models as source of functions on arrays, and their weights.

use lagrangian::Learned;
use lagrangian::fit::fresh as fresh_model;
use lagrangian::train::DataFacts;
use lagrangian_export::arrays::{Arrays, Library, arrays};
use pyo3::prelude::*;

use crate::arrays::{Rows, array};
use crate::error::{OrRaise, raise};
use crate::fit::spec;
use crate::model::{Model, ModelSource};
use crate::recording::coordinates;

type Array<'py> = Bound<'py, PyAny>;

/// A fresh model with random weights.
#[pyfunction]
pub(crate) fn fresh(
    py: Python<'_>,
    named: Vec<(String, String, String)>,
    request: &str,
) -> PyResult<Model> {
    let chosen = spec(request)?.choose(&DataFacts::default()).or_raise(py)?;
    let learned = fresh_model(coordinates(py, named)?, &chosen.config).or_raise(py)?;
    Ok(in_python(learned))
}

/// Python source of a model for a library.
#[pyfunction]
pub(crate) fn layer_source(
    py: Python<'_>,
    model: &Bound<'_, Model>,
    library: &str,
) -> PyResult<String> {
    let library = match library {
        "jax" => Library::Jax,
        _ => Library::Torch,
    };
    Ok(of(py, model, library)?.source)
}

/// The weights of a model, the least and the largest value of each, and the name, first index and number of each span.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "a tuple of Python")]
pub(crate) fn weights<'py>(
    py: Python<'py>,
    model: &Bound<'_, Model>,
) -> PyResult<([Array<'py>; 3], Vec<(&'static str, usize, usize)>)> {
    let arrays = of(py, model, Library::Jax)?;
    let [low, high] = arrays.bounds();
    let vector = |values: Vec<f64>| {
        let size = [values.len()];
        Ok::<_, PyErr>(array(py, values, &size)?.into_any())
    };
    let all = [vector(arrays.weights())?, vector(low)?, vector(high)?];
    let spans = arrays.spans.iter();
    let spans = spans.map(|span| (span.name, span.first, span.values.len()));
    Ok((all, spans.collect()))
}

/// A model of the same shape with other weights.
#[pyfunction]
pub(crate) fn with_weights(
    py: Python<'_>,
    model: &Bound<'_, Model>,
    weights: Array<'_>,
) -> PyResult<Model> {
    let weights = Rows::of_any_width(&weights, "parameters")?;
    let other = learned(py, model)?.with_weights(weights.values());
    Ok(in_python(other.or_raise(py)?))
}

fn in_python(model: Learned) -> Model {
    Model::new(ModelSource::Learned(model, Default::default()))
}

fn learned<'m>(py: Python<'_>, model: &'m Bound<'_, Model>) -> PyResult<&'m Learned> {
    match &**model.get().body() {
        ModelSource::Learned(model, _) => Ok(model),
        _ => {
            let message =
                "a known system has no weights: give a fitted model, or a family to Layer.fresh";
            Err(raise(py, "NotSupported", message))
        }
    }
}

fn of(py: Python<'_>, model: &Bound<'_, Model>, library: Library) -> PyResult<Arrays> {
    arrays(learned(py, model)?, library).or_raise(py)
}
