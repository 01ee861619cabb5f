//! Ensembles: their fit, and their predictions.

use std::path::PathBuf;
use std::sync::Arc;

use lagrangian::ensemble::Prediction as Predicted;
use lagrangian::train::Ending;
use lagrangian::{Observer, Provenance, prepared};
use lagrangian_run::{FitReport, PreparedFit, RunTarget, SavedEnsemble, delayed};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json as object;

use crate::arrays::{Rows, array};
use crate::error::{OrRaise, invalid, of_json};
use crate::files::json;
use crate::fit::{assessed, data, spec, watched};
use crate::model::{Model, ModelSource};
use crate::recording::recordings;
use crate::run::Run;
use crate::threads::pool;

/// Several models of the same data.
#[pyclass(module = "lagrangian._lagrangian", frozen)]
pub(crate) struct Ensemble {
    ensemble: Arc<lagrangian::ensemble::Ensemble>,
    provenance: Provenance,
}

/// A prediction of an ensemble.
#[pyclass(module = "lagrangian._lagrangian", frozen)]
pub(crate) struct Prediction {
    predicted: Predicted,
    shape: Vec<usize>,
}

type Array<'py> = Bound<'py, PyAny>;

#[pymethods]
impl Prediction {
    /// The mean of the members.
    #[getter]
    fn mean<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.array(py, self.predicted.mean.clone())
    }

    /// The expected deviation of the truth.
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.array(py, self.predicted.deviation.clone())
    }

    /// The lower and the upper end of the band that holds the truth with a probability.
    fn band<'py>(&self, py: Python<'py>, level: f64) -> PyResult<(Array<'py>, Array<'py>)> {
        let (low, high) = self.predicted.band(level).or_raise(py)?;
        Ok((self.array(py, low)?, self.array(py, high)?))
    }

    /// The quantile of the truth with a probability.
    fn quantile<'py>(&self, py: Python<'py>, probability: f64) -> PyResult<Array<'py>> {
        self.array(py, self.predicted.quantile(probability).or_raise(py)?)
    }
}

impl Prediction {
    fn array<'py>(&self, py: Python<'py>, values: Vec<f64>) -> PyResult<Array<'py>> {
        Ok(array(py, values, &self.shape)?.into_any())
    }
}

#[pymethods]
impl Ensemble {
    /// Reads the ensemble of a folder, and the summary of its fit.
    #[staticmethod]
    fn read(py: Python<'_>, folder: PathBuf) -> PyResult<(Self, Bound<'_, PyDict>)> {
        let saved = SavedEnsemble::read(&folder).or_raise(py)?;
        let summary = json(py, &saved.summary)?;
        let ensemble = Self {
            ensemble: Arc::new(saved.ensemble),
            provenance: saved.provenance,
        };
        Ok((ensemble, summary))
    }

    /// Writes the ensemble to a folder, with the summary of its fit as JSON.
    fn write(&self, py: Python<'_>, folder: PathBuf, summary: &str) -> PyResult<()> {
        let saved = SavedEnsemble {
            ensemble: (*self.ensemble).clone(),
            provenance: self.provenance.clone(),
            summary: of_json(serde_json::from_str(summary))?,
        };
        py.detach(|| saved.write(&folder)).or_raise(py)
    }

    /// The members of the ensemble.
    fn members(&self) -> Vec<Model> {
        let members = self.ensemble.members().iter();
        let model = |model: &lagrangian::Learned| {
            Model::new(ModelSource::Learned(model.clone(), self.provenance.clone()))
        };
        members.map(model).collect()
    }

    /// The accelerations at states under forces.
    fn accelerations(
        &self,
        py: Python<'_>,
        q: &Array<'_>,
        qd: &Array<'_>,
        tau: &Array<'_>,
    ) -> PyResult<Prediction> {
        self.predict(
            py,
            [("q", q), ("qd", qd), ("tau", tau)],
            |own, [q, qd, tau]| own.accelerations(q, qd, tau),
        )
    }

    /// The torques of motions.
    fn torques(
        &self,
        py: Python<'_>,
        q: &Array<'_>,
        qd: &Array<'_>,
        qdd: &Array<'_>,
    ) -> PyResult<Prediction> {
        self.predict(
            py,
            [("q", q), ("qd", qd), ("qdd", qdd)],
            |own, [q, qd, qdd]| own.torques(q, qd, qdd),
        )
    }

    /// The positions of a motion that all members predicted, from the positions of each.
    fn positions(&self, py: Python<'_>, motions: Vec<Array<'_>>) -> PyResult<Prediction> {
        let n = self.dof();
        let rows = motions.iter().map(|m| Rows::new(m, "a motion", n));
        let rows: Vec<Rows<'_>> = rows.collect::<PyResult<_>>()?;
        let each: Vec<&[f64]> = rows.iter().map(Rows::values).collect();
        let predicted = self.ensemble.positions(&each).or_raise(py)?;
        let shape = vec![predicted.mean.len() / n.max(1), n];
        Ok(Prediction { predicted, shape })
    }

    /// The parts of the samples of recordings that lie in the bands.
    fn coverage<'py>(
        &self,
        py: Python<'py>,
        trajectories: &Array<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let own = self.provenance.preparation.clone().unwrap_or_default();
        let recordings = recordings(trajectories)?;
        let ensemble = &self.ensemble;
        let coverage = py.detach(|| -> lagrangian_run::Result<_> {
            let motions =
                prepared::estimated(delayed(recordings, &own.delay)?, &own.estimates())?.0;
            Ok(ensemble.coverage(&motions))
        });
        json(py, &object!(coverage.or_raise(py)?))
    }
}

impl Ensemble {
    fn dof(&self) -> usize {
        let first = self.ensemble.members().first();
        first.map_or(0, |first| lagrangian::Model::coordinates(first).dof())
    }

    fn predict(
        &self,
        py: Python<'_>,
        given: [(&str, &Array<'_>); 3],
        ask: impl Fn(&lagrangian::ensemble::Ensemble, [&[f64]; 3]) -> lagrangian::Result<Predicted>
        + Send
        + Sync,
    ) -> PyResult<Prediction> {
        let rows = given.map(|(name, value)| Rows::new(value, name, self.dof()));
        let [q, second, third] = rows;
        let (q, second, third) = (q?, second?, third?);
        let values = [q.values(), second.values(), third.values()];
        let ensemble = &self.ensemble;
        let predicted = py.detach(|| ask(ensemble, values)).or_raise(py)?;
        Ok(Prediction {
            predicted,
            shape: q.shape().to_vec(),
        })
    }
}

/// Fits an ensemble to recordings; with several candidates, of the best of them. In a run folder the model whose settings they share
/// is fitted before, and kept beside them.
#[pyfunction]
#[pyo3(name = "fit_ensemble", signature = (training, validation, request, layout, members, run=None, callback=None))]
#[expect(clippy::too_many_arguments, reason = "one for each of Python's")]
pub(crate) fn fit<'py>(
    py: Python<'py>,
    training: &Array<'py>,
    validation: &Array<'py>,
    request: &str,
    layout: String,
    members: usize,
    run: Option<Run>,
    callback: Option<Array<'py>>,
) -> PyResult<(Ensemble, Bound<'py, PyDict>)> {
    let (spec, data) = (spec(request)?, data(training, validation, layout)?);
    let pool = pool(py)?;
    let ready = |data| {
        let ready = || pool.install(|| PreparedFit::new(spec, data));
        py.detach(ready).or_raise(py)
    };
    let fitted = match run {
        None => {
            let ready = ready(data)?;
            let fit = |observer: &mut dyn Observer| ready.fit_ensemble(members, observer);
            watched(py, callback.as_ref(), fit)?.or_raise(py)?
        }
        Some(run) => {
            let folder = run.open(py)?;
            let place = run.place(&folder)?;
            let fitted = ready(py.detach(|| data.hashed()))
                .and_then(|ready| beside(py, ready, members, &place, callback.as_ref()));
            fitted.inspect_err(|_| folder.remove_if_new_and_empty())?
        }
    };
    let summary = json(py, &fitted.summary)?;
    let ensemble = Ensemble {
        ensemble: Arc::new(fitted.ensemble),
        provenance: fitted.provenance,
    };
    Ok((ensemble, summary))
}

/// Fits a model in a run folder, and an ensemble of models like it; both are on its page.
fn beside(
    py: Python<'_>,
    ready: PreparedFit,
    members: usize,
    place: &RunTarget,
    callback: Option<&Array<'_>>,
) -> PyResult<SavedEnsemble> {
    let fit = |observer: &mut dyn Observer| -> lagrangian_run::Result<FitReport> {
        let kept = ready.fit(Some(place), observer)?;
        let ensemble = match kept.selection.fit.ending {
            Ending::Interrupted => None,
            _ => Some(kept.fit_ensemble(members, observer)?),
        };
        Ok(kept.ended(ensemble))
    };
    let fitted = watched(py, callback, fit)?.or_raise(py)?;
    assessed(py, &fitted, Some(place))?;
    fitted.ensemble.ok_or_else(|| {
        let message = "the fit was interrupted before the ensemble began: resume=True continues it";
        invalid(py, message)
    })
}
