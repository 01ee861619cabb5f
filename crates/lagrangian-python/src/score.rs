//! The figures of models on recordings.

use lagrangian::score::{Assessment, predict_all, score_predictions, score_samples, time_for};
use lagrangian::{Learned, Recording, RolloutOptions, Score, Stop, Trajectory, prepared};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json as object;

use crate::error::{OrRaise, invalid};
use crate::files::json;
use crate::model::{Model, ModelSource};
use crate::recording::recordings;
use crate::threads::interruptible;

/// The score of a model on some motions, and its reliability.
pub(crate) struct Figures {
    pub(crate) score: Score,
    pub(crate) assessment: Assessment,
}

impl Figures {
    /// The figures on motions, whose predictions end when `stop` is raised.
    pub(crate) fn of(
        model: &Learned,
        motions: &[Trajectory],
        stop: Stop,
    ) -> lagrangian::Result<Self> {
        let options = RolloutOptions {
            stop,
            ..RolloutOptions::for_comparison()
        };
        let predictions = predict_all(model, motions, &options)?;
        let score = score_predictions(model, motions, &predictions, &options)?;
        let assessment = Assessment::of_learned(model, motions, &score);
        Ok(Self { score, assessment })
    }

    /// The figures on samples that need not follow each other.
    pub(crate) fn of_samples(model: &Learned, samples: &Trajectory) -> lagrangian::Result<Self> {
        let score = score_samples(model, std::slice::from_ref(samples))?;
        let assessment = Assessment::of_learned(model, std::slice::from_ref(samples), &score);
        Ok(Self { score, assessment })
    }
}

/// The figures of a model on recordings, which are prepared like those that it was fitted to.
#[pyfunction]
pub(crate) fn score<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    trajectories: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let recordings = recordings(trajectories)?;
    let body = model.get().body();
    let ModelSource::Learned(learned, _) = &**body else {
        return Err(invalid(
            py,
            "the model was not fitted: there is nothing to score",
        ));
    };
    let own = body.preparation().cloned().unwrap_or_default();
    let options = own.estimates();
    let limit = time_for(recordings.iter().map(Recording::len).sum());
    let figures = |stop| {
        let recordings = lagrangian_run::delayed(recordings, &own.delay)?;
        let motions = prepared::estimated(recordings, &options)?.0;
        Ok(Figures::of(learned, &motions, stop)?)
    };
    let figures: lagrangian_run::Result<Figures> = interruptible(py, limit, figures)?;
    let Figures { score, assessment } = figures.or_raise(py)?;
    json(
        py,
        &object!({ "score": score, "verdict": assessment.verdict, "assessment": assessment }),
    )
}
