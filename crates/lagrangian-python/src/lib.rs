//! The Python module `lagrangian._lagrangian`: arrays in, arrays out. It holds no formula and no default that the library
//! does not have; the interface for Python users is in `python/lagrangian`.

mod animation;
mod answers;
mod arrays;
mod check;
mod ensemble;
mod error;
mod files;
mod fit;
mod formats;
mod layer;
mod measured;
mod model;
mod motion;
mod number;
mod online;
mod plant;
mod recording;
mod run;
mod score;
mod settings;
mod sweep;
mod systems;
mod threads;
mod torque;
mod tracking;

use pyo3::pymodule;

/// The numerical core of the package `lagrangian`.
#[pymodule]
mod _lagrangian {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::animation::{animation, page};
    #[pymodule_export]
    use super::check::{check, constraints};
    #[pymodule_export]
    use super::ensemble::{Ensemble, Prediction, fit as fit_ensemble};
    #[pymodule_export]
    use super::files::{read, read_table, write};
    #[pymodule_export]
    use super::fit::{fit, fit_samples};
    #[pymodule_export]
    use super::formats::Asked;
    #[pymodule_export]
    use super::layer::{fresh, layer_source, weights, with_weights};
    #[pymodule_export]
    use super::measured::library_seconds;
    #[pymodule_export]
    use super::model::{Model, load};
    #[pymodule_export]
    use super::motion::{follow, roll_out, times};
    #[pymodule_export]
    use super::number::Number;
    #[pymodule_export]
    use super::online::Online;
    #[pymodule_export]
    use super::plant::plant;
    #[pymodule_export]
    use super::run::report;
    #[pymodule_export]
    use super::score::score;
    #[pymodule_export]
    use super::settings::{families, integrators, systems, training_settings};
    #[pymodule_export]
    use super::sweep::{content_hashes, unit_name};
    #[pymodule_export]
    use super::systems::{example_urdf, own_system, robot, simulate, system};
    #[pymodule_export]
    use super::threads::set_threads;
    #[pymodule_export]
    use super::torque::torque_parts;
    #[pymodule_export]
    use super::tracking::{drive, follow_reference};

    /// Runs the command `lagrangian` with these arguments, and returns its exit code.
    #[pyfunction]
    fn command(py: Python<'_>, arguments: Vec<std::ffi::OsString>) -> u8 {
        py.detach(|| lagrangian_cli::main(arguments))
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        lagrangian_run::read_others_by(super::formats::FORMATS);
        lagrangian_cli::open_plants_by(super::plant::open);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
