//! Plants: machines that a simulator of Python moves, such as those of `lagrangian.plant`.

use std::sync::{Arc, Mutex, PoisonError};

use lagrangian::mechanics::{Evaluation, Integration, Plant};
use lagrangian::{Coordinates, Evaluator, Model as _};
use lagrangian_run::Cause;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{Rows, array};
use crate::error::Raised;
use crate::model::{Model, ModelSource};
use crate::recording::coordinates;

/// A machine whose state a Python object moves.
pub(crate) struct PythonPlant {
    /// Its methods, each of one state: `advance(q, qd, tau, seconds)`, `forward(q, qd, tau)`, `inverse(q, qd, qdd)` and `mass(q)`.
    machine: Py<PyAny>,
    coordinates: Coordinates,
    /// The first exception since the last check.
    failure: Mutex<Option<PyErr>>,
}

/// A plant around a machine with these coordinates.
#[pyfunction]
pub(crate) fn plant(
    py: Python<'_>,
    machine: Py<PyAny>,
    named: Vec<(String, String, String)>,
) -> PyResult<Model> {
    Ok(Model::new(ModelSource::Plant(PythonPlant {
        machine,
        coordinates: coordinates(py, named)?,
        failure: Mutex::new(None),
    })))
}

/// Opens a plant for the command, by `lagrangian.plant.load`.
pub(crate) fn open(source: &str, joints: &[String]) -> Result<lagrangian_cli::OpenedPlant, Cause> {
    Python::attach(|py| {
        let load = || -> PyResult<lagrangian_cli::OpenedPlant> {
            let options = PyDict::new(py);
            options.set_item("joints", joints)?;
            let module = py.import("lagrangian.plant")?;
            let plant = module.call_method("load", (source,), Some(&options))?;
            let model = plant.cast::<Model>()?.get();
            Ok(lagrangian_cli::OpenedPlant {
                model: Some(Box::new(Shared(Arc::clone(model.body())))),
                limits: plant.getattr("limits")?.call_method0("tolist")?.extract()?,
            })
        };
        load().map_err(|error| Raised::of(py, &error).into())
    })
}

/// A model of Python, for the command.
struct Shared(Arc<ModelSource>);

impl lagrangian::Model for Shared {
    fn coordinates(&self) -> &Coordinates {
        self.0.model().coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.0.model().evaluator()
    }

    fn integration(&self) -> Integration<'_> {
        self.0.model().integration()
    }
}

impl Drop for PythonPlant {
    /// Shows an exception that nobody has asked for.
    fn drop(&mut self) {
        if let Some(error) = self.failure() {
            Python::attach(|py| error.write_unraisable(py, None));
        }
    }
}

impl PythonPlant {
    /// The first exception of the machine since the last check.
    pub(crate) fn failure(&self) -> Option<PyErr> {
        self.lock().take()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<PyErr>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes what a method answers for some vectors and numbers; NaN after an exception.
    fn ask(
        &self,
        method: &str,
        vectors: &[&[f64]],
        seconds: Option<f64>,
        out: &mut [f64],
    ) -> Evaluation {
        let width = out.len();
        let call = |py: Python<'_>| -> PyResult<()> {
            py.check_signals()?;
            let vectors = vectors
                .iter()
                .map(|x| Ok(array(py, x.to_vec(), &[x.len()])?.into_any()));
            let mut arguments: Vec<Bound<'_, PyAny>> = vectors.collect::<PyResult<_>>()?;
            if let Some(seconds) = seconds {
                arguments.push(seconds.into_pyobject(py)?.into_any());
            }
            let arguments = PyTuple::new(py, arguments)?;
            let answer = self.machine.bind(py).call_method1(method, arguments)?;
            let answer = Rows::of_any_width(&answer, "the answer of the plant")?;
            if answer.values().len() != width {
                let found = answer.values().len();
                let message = format!("the plant has answered {found} numbers: it must be {width}");
                return Err(crate::error::invalid(py, message));
            }
            out.copy_from_slice(answer.values());
            Ok(())
        };
        // No lock is held while the interpreter works.
        let called = match self.lock().is_some() {
            true => None,
            false => Some(Python::attach(call)),
        };
        if !matches!(called, Some(Ok(()))) {
            out.fill(f64::NAN);
        }
        if let Some(Err(error)) = called {
            self.lock().get_or_insert(error);
        }
        Evaluation::of(out, width, 0)
    }
}

impl lagrangian::Model for PythonPlant {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(Machine(self))
    }

    fn integration(&self) -> Integration<'_> {
        Integration::Own(self)
    }
}

impl Plant for PythonPlant {
    fn advance(&self, state: &mut [f64], tau: &[f64], seconds: f64) {
        let before = state.to_vec();
        let (q, qd) = before.split_at(tau.len());
        let _ = self.ask("advance", &[q, qd, tau], Some(seconds), state);
    }
}

/// Answers at single states.
struct Machine<'a>(&'a PythonPlant);

impl Machine<'_> {
    /// The answers for a batch of states, `width` numbers each; the worst outcome.
    fn each(
        &self,
        [a, b, c]: [&[f64]; 3],
        out: &mut [f64],
        ask: impl Fn(&PythonPlant, [&[f64]; 3], &mut [f64]) -> Evaluation,
    ) -> Evaluation {
        let n = self.0.coordinates().dof();
        let width = out.len() / (a.len() / n.max(1)).max(1);
        let rows = a
            .chunks_exact(n)
            .zip(b.chunks_exact(n))
            .zip(c.chunks_exact(n));
        for (((a, b), c), out) in rows.zip(out.chunks_exact_mut(width.max(1))) {
            let _ = ask(self.0, [a, b, c], out);
        }
        Evaluation::of(out, width, 0)
    }
}

impl Evaluator for Machine<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        self.each([q, qd, tau], qdd, |plant, own, out| {
            plant.ask("forward", &own, None, out)
        })
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        self.each([q, qd, qdd], tau, |plant, own, out| {
            plant.ask("inverse", &own, None, out)
        })
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        self.each([q, qd, qd], mass, |plant, [q, ..], out| {
            plant.ask("mass", &[q], None, out)
        })
    }
}
