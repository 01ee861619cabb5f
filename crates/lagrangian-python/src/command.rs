//! The command `lagrangian`, which the script of the package runs.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command with these arguments, and returns its exit code.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| lagrangian_cli::main(arguments))
}
