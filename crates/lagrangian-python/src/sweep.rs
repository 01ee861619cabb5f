//! Sweeps: units of work on recordings, the same as those of the command.

use std::path::PathBuf;

use lagrangian::RolloutOptions;
use lagrangian::settings::Values;
use lagrangian_run::Data;
use lagrangian_run::Specification;
use lagrangian_run::sweep::{Conditions, Ended, Search, Space, Table, Unit, begin};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json as object};

use crate::error::{OrRaise, of_json};
use crate::files::{json, value};
use crate::fit::watched;
use crate::recording::recordings;
use crate::run::{Keywords, events};

/// Recordings, settings that all units have, and the folder of the units.
#[pyclass(frozen)]
pub(crate) struct Sweep {
    data: Data,
    fixed: Values,
    root: PathBuf,
}

impl Sweep {
    /// The unit whose settings differ so.
    fn unit(&self, py: Python<'_>, varied: &str) -> PyResult<Unit> {
        let varied: Values = of_json(serde_json::from_str(varied))?;
        let both = self.fixed.clone().into_iter().chain(varied.clone());
        let specification = Specification::of(&both.collect()).or_raise(py)?;
        Unit::of(specification, varied, &self.data).or_raise(py)
    }
}

#[pymethods]
impl Sweep {
    #[new]
    fn new(
        training: &Bound<'_, PyAny>,
        validation: &Bound<'_, PyAny>,
        layout: String,
        fixed: &str,
        root: PathBuf,
    ) -> PyResult<Self> {
        let data = Data {
            training: recordings(training)?,
            validation: recordings(validation)?,
            layout,
            ..Data::default()
        };
        Ok(Self {
            data: training.py().detach(|| data.hashed()),
            fixed: of_json(serde_json::from_str(fixed))?,
            root,
        })
    }

    /// The points of a space, each as a dictionary of the settings that differ.
    #[staticmethod]
    fn points<'py>(py: Python<'py>, space: &str, search: &str) -> PyResult<Bound<'py, PyAny>> {
        let space: Values = of_json(serde_json::from_str(space))?;
        let search: Search = of_json(serde_json::from_str(search))?;
        let space = Space::of(&space).or_raise(py)?;
        value(py, &space.points(&search).or_raise(py)?)
    }

    /// Writes down the data that the sweep begins with; those of one that has begun must be the same.
    fn begin(&self, py: Python<'_>) -> PyResult<()> {
        begin(&self.root, &self.data, &[]).or_raise(py)
    }

    /// The name of the folder of a unit.
    fn id(&self, py: Python<'_>, varied: &str) -> PyResult<String> {
        Ok(self.unit(py, varied)?.id)
    }

    /// Does a unit: how that ended, and its result where it is finished.
    #[pyo3(signature = (varied, call, tensorboard, callback=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        varied: &str,
        call: String,
        tensorboard: bool,
        callback: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let unit = self.unit(py, varied)?;
        let conditions = Conditions {
            root: &self.root,
            skin: &Keywords,
            command: call,
            options: RolloutOptions::for_comparison(),
            tensorboard: events(tensorboard),
        };
        let work =
            |observer: &mut dyn lagrangian::Observer| unit.run(&self.data, &conditions, observer);
        let ended = watched(py, callback.as_ref(), work)?.or_raise(py)?;
        let (ended, result) = match ended {
            Ended::Finished(result) => ("finished", object!(result)),
            Ended::Interrupted => ("interrupted", Value::Null),
            Ended::Busy => ("busy", Value::Null),
        };
        json(
            py,
            &object!({ "unit": unit.id, "ended": ended, "result": result }),
        )
    }

    /// Writes the table of these units, and returns its rows and the name of the best.
    fn table<'py>(
        &self,
        py: Python<'py>,
        varied: Vec<String>,
        names: Vec<String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut units: Vec<Unit> = Vec::new();
        for varied in &varied {
            let unit = self.unit(py, varied)?;
            if units.iter().all(|known| known.id != unit.id) {
                units.push(unit);
            }
        }
        let table = Table::of(&units, &names, &self.root).or_raise(py)?;
        table.write(&self.root).or_raise(py)?;
        let best = table.best().map(|row| &row.unit);
        json(py, &object!({ "rows": table.rows, "best": best }))
    }
}
