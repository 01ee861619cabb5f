//! Models that are learned while a robot moves.

use std::sync::{Mutex, MutexGuard, PoisonError};

use lagrangian::{Coordinates, Provenance};
use lagrangian_control::online::{OnlineConfig, OnlineLearner, OnlineThread, spawn};
use pyo3::prelude::*;

use crate::arrays::Rows;
use crate::error::{OrRaise, invalid, raise};
use crate::files::value;
use crate::fit::spec;
use crate::model::{Model, ModelSource};
use crate::recording::coordinates;

/// A learner, whose thread begins with the first row.
#[pyclass(frozen, module = "lagrangian._lagrangian")]
pub(crate) struct Online {
    coordinates: Coordinates,
    config: OnlineConfig,
    thread: Mutex<Option<OnlineThread>>,
}

impl Online {
    /// What a new learner of the same kind is made of.
    pub(crate) fn config(&self) -> (&Coordinates, &OnlineConfig) {
        (&self.coordinates, &self.config)
    }

    fn thread(&self) -> MutexGuard<'_, Option<OnlineThread>> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Online {
    #[new]
    fn new(
        py: Python<'_>,
        named: Vec<(String, String, String)>,
        request: &str,
        seed: u64,
    ) -> PyResult<Self> {
        let config = OnlineConfig::chosen(&spec(request)?, seed).or_raise(py)?;
        let coordinates = coordinates(py, named)?;
        // Whatever is wrong with the settings is said here, not on a thread.
        OnlineLearner::new(coordinates.clone(), config.clone()).or_raise(py)?;
        Ok(Self {
            coordinates,
            config,
            thread: Mutex::new(None),
        })
    }

    /// Takes a row of the loop, and returns at once; a thread learns.
    fn update(
        &self,
        py: Python<'_>,
        t: f64,
        q: &Bound<'_, PyAny>,
        qd: &Bound<'_, PyAny>,
        tau: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let n = self.coordinates.dof();
        let mut row = vec![t];
        for (name, values) in [("q", q), ("qd", qd), ("tau", tau)] {
            let values = Rows::new(values, name, n)?;
            if values.values().len() != n {
                let message = format!("{name} holds many states: give one, ({n},)");
                return Err(invalid(py, message));
            }
            row.extend(values.values());
        }
        let mut thread = self.thread();
        if thread.is_none() {
            let learner = OnlineLearner::new(self.coordinates.clone(), self.config.clone());
            *thread = Some(spawn(learner.or_raise(py)?).or_raise(py)?);
        }
        match thread.as_ref() {
            Some(own) if own.is_alive() => own.push(&row),
            _ => {
                let message = "the learner has ended: `close` says why; begin a new one";
                return Err(raise(py, "LagrangianError", message));
            }
        }
        Ok(())
    }

    /// The newest model that was handed over since the last call.
    fn take(&self) -> Option<Model> {
        let model = self.thread().as_ref()?.take()?;
        let own = (*model).clone();
        Some(Model::new(ModelSource::Learned(own, Provenance::default())))
    }

    /// Ends the thread, and returns the record of the learner.
    fn close<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let thread = self.thread().take();
        let record = py.detach(|| thread.map(OnlineThread::finish).transpose());
        let record = record.or_raise(py)?;
        record.map(|record| value(py, &record)).transpose()
    }
}
