//! Fits.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use lagrangian::fit::select;
use lagrangian::score::time_for;
use lagrangian::trajectory::Samples;
use lagrangian::{
    CheckReport, Coordinates, Dataset, FitConfig, FitSpec, Observer, Progress, Provenance,
    RolloutOptions, Signals, Trajectory,
};
use lagrangian_run::{Data, Evaluation, FitReport, PreparedFit, RunFolder, RunTarget, SampleFacts};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json as object;

use crate::arrays::Rows;
use crate::check::findings;
use crate::error::{OrRaise, of_json};
use crate::files::json;
use crate::model::{Model, ModelSource};
use crate::recording::recordings;
use crate::run::Run;
use crate::score::Figures;
use crate::threads::{attended, interruptible, pool};

/// The request of a fit, from its JSON.
pub(crate) fn spec(text: &str) -> PyResult<FitSpec> {
    of_json(serde_json::from_str(text))
}

/// An event of a fit that runs.
enum Event {
    Progress(Progress),
    Stage(String, f64),
}

/// The smallest time between two events, except for those that are always sent.
const EVENT_EVERY: Duration = Duration::from_millis(50);

/// Sends its events to the calling thread.
struct Reporter<'a> {
    events: Sender<Event>,
    stop: &'a AtomicBool,
    last: Instant,
}

impl Reporter<'_> {
    fn send(&mut self, event: Event, always: bool) -> ControlFlow<()> {
        if always || self.last.elapsed() >= EVENT_EVERY {
            self.last = Instant::now();
            // OK to ignore: the receiver is gone.
            let _ = self.events.send(event);
        }
        match self.stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Observer for Reporter<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let looked = progress.validation.is_some();
        self.send(Event::Progress(*progress), looked)
    }

    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        self.send(Event::Stage(what.into(), share), false)
    }
}

/// Runs `work` while this thread calls `callback` with the events of the fit, and checks for Ctrl-C; an exception of the callback
/// ends the fit and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut dyn Observer) -> T + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let mut failure = None;
    let work = |events| {
        work(&mut Reporter {
            events,
            stop: &stop,
            last: Instant::now(),
        })
    };
    let value = attended(py, work, |event| {
        let told = match (callback, event) {
            (Some(callback), Some(event)) => report(callback, &event),
            _ => Ok(()),
        };
        // Ctrl-C ends the fit, which keeps its present result.
        if told.is_err() || py.check_signals().is_err() {
            stop.store(true, Ordering::Relaxed);
        }
        if let Err(error) = told {
            // Ctrl-C may come while a callback runs.
            if !error.is_instance_of::<PyKeyboardInterrupt>(py) {
                failure.get_or_insert(error);
            }
        }
    })?;
    failure.map_or(Ok(value), Err)
}

fn report(callback: &Bound<'_, PyAny>, event: &Event) -> PyResult<()> {
    let told = match event {
        Event::Progress(progress) => object!(progress),
        Event::Stage(what, share) => object!({ "stage": what, "share": share }),
    };
    callback.call1((json(callback.py(), &told)?,)).map(|_| ())
}

/// A fitted model with all figures about it.
type Fitted<'py> = (Model, Bound<'py, PyDict>);

/// Fits the best of the requested models to recordings, in a run folder where one is named.
#[pyfunction]
#[pyo3(signature = (training, validation, request, layout, run=None, callback=None))]
pub(crate) fn fit<'py>(
    py: Python<'py>,
    training: &Bound<'py, PyAny>,
    validation: &Bound<'py, PyAny>,
    request: &str,
    layout: String,
    run: Option<Run>,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<Fitted<'py>> {
    let (spec, data) = (spec(request)?, data(training, validation, layout)?);
    let folder = run.as_ref().map(|run| run.open(py)).transpose()?;
    let place = match (&folder, &run) {
        (Some(folder), Some(run)) => Some(run.place(folder)?),
        _ => None,
    };
    fit_in(py, spec, data, place.as_ref(), callback.as_ref())
        .inspect_err(|_| folder.iter().for_each(RunFolder::remove_if_new_and_empty))
}

/// The recordings of a fit.
pub(crate) fn data(
    training: &Bound<'_, PyAny>,
    validation: &Bound<'_, PyAny>,
    layout: String,
) -> PyResult<Data> {
    Ok(Data {
        training: recordings(training)?,
        validation: recordings(validation)?,
        layout,
        ..Data::default()
    })
}

fn fit_in<'py>(
    py: Python<'py>,
    spec: FitSpec,
    data: Data,
    place: Option<&RunTarget>,
    callback: Option<&Bound<'py, PyAny>>,
) -> PyResult<Fitted<'py>> {
    let pool = pool(py)?;
    let prepare = || {
        let data = match place {
            Some(_) => data.hashed(),
            None => data,
        };
        PreparedFit::new(spec, data)
    };
    let ready = py.detach(|| pool.install(prepare)).or_raise(py)?;
    let kept = watched(py, callback, |observer| ready.fit(place, observer))?.or_raise(py)?;
    let fitted = kept.ended(None);
    let figures = assessed(py, &fitted, place)?;
    summary(py, fitted, &figures)
}

/// The assessment of a fitted model; writes the page of its run.
pub(crate) fn assessed(
    py: Python<'_>,
    fitted: &FitReport,
    place: Option<&RunTarget>,
) -> PyResult<Figures> {
    let samples = fitted.evaluation.motions.iter().map(Trajectory::len);
    let limit = time_for(samples.sum());
    let assess = |stop| {
        let options = RolloutOptions {
            stop,
            ..RolloutOptions::for_comparison()
        };
        fitted.assessed(place, &options)
    };
    let (score, assessment) = interruptible(py, limit, assess)?.or_raise(py)?;
    Ok(Figures { score, assessment })
}

fn summary<'py>(
    py: Python<'py>,
    fitted: FitReport,
    Figures { score, assessment }: &Figures,
) -> PyResult<Fitted<'py>> {
    let mut summary = fitted.summary(score, assessment);
    summary["check"] = object!(findings(&fitted.evaluation.check));
    let model = Model::new(ModelSource::Learned(fitted.fit.model, fitted.provenance));
    Ok((model, json(py, &summary)?))
}

/// Fits a model to samples that belong to no motion: states, forces and accelerations, `(m, n)` each.
#[pyfunction]
#[pyo3(signature = (samples, validation, names, request, callback=None))]
pub(crate) fn fit_samples<'py>(
    py: Python<'py>,
    samples: [Option<Bound<'py, PyAny>>; 4],
    validation: Vec<usize>,
    names: Vec<(String, String, String)>,
    request: &str,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<Fitted<'py>> {
    let coordinates = crate::recording::coordinates(py, names)?;
    let n = coordinates.dof();
    let mut columns: [Vec<f64>; 4] = Default::default();
    let named = ["q", "qd", "qdd", "tau"];
    for ((column, given), name) in columns.iter_mut().zip(&samples).zip(named) {
        if let Some(given) = given {
            *column = Rows::new(given, name, n)?.values().to_vec();
        }
    }
    let spec = spec(request)?;
    let dataset = divided(coordinates, columns, &validation).or_raise(py)?;
    let chosen = FitConfig::for_data(&dataset, &[], &spec).or_raise(py)?;
    chosen.config.validate(&dataset).or_raise(py)?;
    let held_out = &dataset;
    let selection = watched(py, callback.as_ref(), |observer| {
        select(held_out, vec![chosen], None, observer)
    })?
    .or_raise(py)?;
    let part = match dataset.validation.is_empty() {
        true => &dataset.train,
        false => &dataset.validation,
    };
    // Samples in any order: their times only number them.
    let times = (0..part.len()).map(|k| k as f64).collect();
    let mut samples = Trajectory::new("samples", times, part.signals.clone());
    if !dataset.forced {
        samples.tau.clear();
    }
    let figures = py
        .detach(|| Figures::of_samples(&selection.fit.model, &samples))
        .or_raise(py)?;
    let provenance = Provenance::of_seed(spec.seed);
    let assessment = figures.assessment.of_selected(&selection.tried);
    let evaluation = Evaluation {
        motions: Vec::new(),
        held_out: false,
        check: CheckReport { items: Vec::new() },
    };
    let figures = Figures {
        assessment: assessment.of_checked(&evaluation.check),
        ..figures
    };
    let facts = SampleFacts::of(&dataset, &[]);
    let fitted = FitReport::of(selection, evaluation, provenance, facts);
    summary(py, fitted, &figures)
}

/// The samples whose numbers are listed are for validation, the others for training.
fn divided(
    coordinates: Coordinates,
    [q, qd, qdd, tau]: [Vec<f64>; 4],
    validation: &[usize],
) -> lagrangian::Result<Dataset> {
    let n = coordinates.dof();
    let rows = q.len() / n.max(1);
    let mut held = vec![false; rows];
    for &row in validation {
        if let Some(held) = held.get_mut(row) {
            *held = true;
        }
    }
    let part = |wanted: bool| {
        let of = |signal: &[f64]| -> Vec<f64> {
            let rows = signal.chunks_exact(n.max(1)).zip(&held);
            let rows = rows.filter(|(_, held)| **held == wanted);
            rows.flat_map(|(row, _)| row).copied().collect()
        };
        let tau = match tau.is_empty() {
            true => vec![0.0; q.len()],
            false => tau.clone(),
        };
        let signals = Signals {
            q: of(&q),
            qd: of(&qd),
            qdd: of(&qdd),
            tau: of(&tau),
            ..Signals::default()
        };
        Samples::new(n, signals)
    };
    Dataset::from_samples(coordinates, part(false), part(true))
}
