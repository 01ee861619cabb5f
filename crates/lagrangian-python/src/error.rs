//! Errors of the library as the exceptions of `lagrangian.errors`.

use lagrangian::Error;
use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyModule, PyType};

/// An exception of the package by its name.
pub(crate) fn raise(py: Python<'_>, class: &str, message: impl Into<String>) -> PyErr {
    static MODULE: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let message = message.into();
    let module = MODULE.get_or_try_init(py, || py.import("lagrangian.errors").map(Bound::unbind));
    match module.and_then(|module| module.bind(py).getattr(class)) {
        Ok(class) => match class.call1((message,)) {
            Ok(exception) => PyErr::from_value(exception),
            Err(error) => error,
        },
        Err(error) => error,
    }
}

/// An argument of a wrong shape, type or value.
pub(crate) fn invalid(py: Python<'_>, message: impl Into<String>) -> PyErr {
    raise(py, "InvalidInput", message)
}

/// Turns results of the library into those of Python.
pub(crate) trait OrRaise<T> {
    /// The value, or the exception of the error.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for Result<T, Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, error))
    }
}

/// The value that was read from JSON, or an exception for a fault of this package, which has written that JSON itself.
pub(crate) fn of_json<T>(result: serde_json::Result<T>) -> PyResult<T> {
    result.map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

impl<T> OrRaise<T> for Result<T, lagrangian_run::Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| match error {
            lagrangian_run::Error::Library(error) => exception(py, error),
            error => of_run(py, &error),
        })
    }
}

/// An exception, as the cause of an error of the library.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct Raised {
    pub(crate) class: Py<PyType>,
    pub(crate) message: String,
}

impl Raised {
    pub(crate) fn of(py: Python<'_>, error: &PyErr) -> Self {
        Self {
            class: error.get_type(py).unbind(),
            message: error.value(py).to_string(),
        }
    }
}

impl<T> OrRaise<T> for Result<T, lagrangian_export::Error> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| match error {
            lagrangian_export::Error::Model(error) => exception(py, error),
            error => invalid(py, error.to_string()),
        })
    }
}

/// An error about files or a run: the class is that of its cause.
fn of_run(py: Python<'_>, error: &lagrangian_run::Error) -> PyErr {
    let mut message = error.to_string();
    let mut cause = std::error::Error::source(error);
    let (mut system, mut raised) = (None, None);
    while let Some(own) = cause {
        message += &format!(": {own}");
        let of_system = own.downcast_ref::<std::io::Error>();
        system = system.or(of_system.and_then(std::io::Error::raw_os_error));
        raised = raised.or(own.downcast_ref::<Raised>());
        cause = own.source();
    }
    if !error.remedy().is_empty() {
        message += &format!(": {}", error.remedy());
    }
    let message = in_python(&message);
    if let Some(Raised { class, .. }) = raised {
        return PyErr::from_type(class.bind(py).clone(), (message,));
    }
    match (system, error.library()) {
        _ if matches!(error, lagrangian_run::Error::Busy(_)) => raise(py, "FolderInUse", message),
        (Some(code), _) => PyOSError::new_err((code, message)),
        (None, Some(own)) => raise(py, class(own), message),
        (None, None) => invalid(py, message),
    }
}

/// A text whose settings are named as the keywords of Python.
pub(crate) fn in_python(text: &str) -> String {
    text.replace("`out`", "`run`")
}

fn exception(py: Python<'_>, error: Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Io(error) => match error.raw_os_error() {
            Some(code) => PyOSError::new_err((code, message)),
            None => PyOSError::new_err(message),
        },
        other => raise(py, class(&other), message),
    }
}

/// The class of the exception for an error of the library.
fn class(error: &Error) -> &'static str {
    match error {
        Error::NotAModel { .. }
        | Error::NewerModel { .. }
        | Error::DamagedModel { .. }
        | Error::Tensor { .. } => "ModelError",
        Error::Columns { .. }
        | Error::Cell { .. }
        | Error::DecimalComma { .. }
        | Error::Malformed { .. }
        | Error::Format { .. }
        | Error::TooShort { .. }
        | Error::Sample { .. }
        | Error::Moves { .. }
        | Error::Data { .. } => "DataError",
        _ => "InvalidInput",
    }
}
