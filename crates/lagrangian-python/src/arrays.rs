//! Arrays of states: `(n,)` for one, `(…, n)` for many.

use numpy::{
    Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{IntoPyDict, PyTuple};

use crate::error::invalid;

/// Rows of `n` numbers, contiguous in memory: the array of the caller where it is contiguous, else a copy.
pub(crate) struct Rows<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
}

impl<'py> Rows<'py> {
    /// The argument `name`, whose last axis has `n` entries.
    pub(crate) fn new(value: &Bound<'py, PyAny>, name: &str, n: usize) -> PyResult<Self> {
        let rows = Self::of_any_width(value, name)?;
        match rows.shape().last() {
            Some(&last) if last == n => Ok(rows),
            _ => Err(invalid(
                value.py(),
                format!(
                    "{name} has shape {}: give ({n},) for one state or (…, {n}) for many, one value for each coordinate",
                    shown(rows.shape())
                ),
            )),
        }
    }

    /// The argument `name`, of any shape.
    pub(crate) fn of_any_width(value: &Bound<'py, PyAny>, name: &str) -> PyResult<Self> {
        if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
            && array.is_c_contiguous()
            && is_native(array)
        {
            return Ok(Self {
                array: borrowed(array, name)?,
            });
        }
        let copy = converted(value, name)?;
        Ok(Self {
            array: borrowed(copy.cast::<PyArrayDyn<f64>>()?, name)?,
        })
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    /// All values, row by row.
    pub(crate) fn values(&self) -> &[f64] {
        // OK because only contiguous arrays are held.
        self.array.as_slice().unwrap_or_default()
    }
}

/// Whether the memory can be read as it is: aligned, in the byte order of the machine. An array of `f64` of NumPy always is,
/// unless it is a view into a record.
fn is_native(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    array.data().is_aligned()
}

fn borrowed<'py>(
    array: &Bound<'py, PyArrayDyn<f64>>,
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    array.try_readonly().map_err(|_| {
        let message = format!("{name} is also written (`out`): give another array for the result");
        invalid(array.py(), message)
    })
}

/// The module of NumPy.
fn numpy<'py>(py: Python<'py>) -> PyResult<&'py Bound<'py, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let numpy = NUMPY.get_or_try_init(py, || py.import("numpy").map(Bound::unbind))?;
    Ok(numpy.bind(py))
}

/// A contiguous copy in double precision.
fn converted<'py>(value: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = numpy(py)?;
    let refuse = |what: String| {
        let message = format!("{name} {what}: give an array of real numbers (float64)");
        crate::error::raise(py, "InvalidType", message)
    };
    let array = numpy
        .call_method1(intern!(py, "asarray"), (value,))
        .map_err(|error| refuse(format!("cannot be made an array ({error})")))?;
    let kind: String = array
        .getattr(intern!(py, "dtype"))?
        .getattr(intern!(py, "kind"))?
        .extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let dtype = array.getattr(intern!(py, "dtype"))?.str()?;
        return Err(refuse(format!("has dtype {dtype}")));
    }
    // Not ascontiguousarray, which makes an axis for a single number.
    numpy.call_method(
        intern!(py, "array"),
        (array, intern!(py, "float64")),
        Some(&[("order", "C")].into_py_dict(py)?),
    )
}

/// A shape in the notation of Python.
pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => {
            let axes: Vec<String> = shape.iter().map(usize::to_string).collect();
            format!("({})", axes.join(", "))
        }
    }
}

/// A new array of this shape over the memory of these values.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    values.into_pyarray(py).reshape(shape)
}

/// An array of objects.
pub(crate) fn objects<'py>(
    py: Python<'py>,
    values: Bound<'py, PyTuple>,
) -> PyResult<Bound<'py, PyAny>> {
    let options = [("dtype", "object")].into_py_dict(py)?;
    numpy(py)?.call_method(intern!(py, "array"), (values,), Some(&options))
}

/// The array to which a result is written.
pub(crate) fn writable<'py>(
    out: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<PyReadwriteArrayDyn<'py, f64>> {
    let py = out.py();
    let refuse = |what: String| {
        let message = format!(
            "out {what}: give a writable, contiguous array of float64 of shape {}",
            shown(shape)
        );
        invalid(py, message)
    };
    let array = out
        .cast::<PyArrayDyn<f64>>()
        .map_err(|_| refuse("is not an array of float64".into()))?;
    if array.shape() != shape {
        return Err(refuse(format!("has shape {}", shown(array.shape()))));
    }
    if !array.is_c_contiguous() || !is_native(array) {
        return Err(refuse("is not contiguous".into()));
    }
    array
        .try_readwrite()
        .map_err(|_| refuse("is read-only, or is an argument too".into()))
}
