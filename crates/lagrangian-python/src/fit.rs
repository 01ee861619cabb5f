//! Fits.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use lagrangian::models::Entry;
use lagrangian::saved::Preparation;
use lagrangian::score::time_for;
use lagrangian::settings::Values;
use lagrangian::train::{Request, Samples, Selection, select};
use lagrangian::{
    Budget, CheckReport, Coordinates, Dataset, FitConfig, Observer, PrepareOptions, Prepared,
    Progress, Provenance, RobotConfig, Signals, Trajectory, rigid,
};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json as object};

use crate::arrays::Rows;
use crate::error::{OrRaise, of_json};
use crate::files::json;
use crate::model::{Body, Model};
use crate::recording::{delayed, recordings};
use crate::score::Figures;
use crate::threads::{attended, interruptible, pool};

/// What is fitted, as the estimators of Python say it.
#[derive(Debug, FromPyObject)]
pub(crate) struct Asked {
    #[pyo3(item)]
    family: Option<String>,
    /// Settings of the family, of the training and of the rollout loss, as JSON.
    #[pyo3(item)]
    settings: [String; 3],
    #[pyo3(item)]
    steps: Option<usize>,
    #[pyo3(item)]
    seconds: Option<f64>,
    #[pyo3(item)]
    seed: u64,
    #[pyo3(item)]
    urdf: Option<String>,
    #[pyo3(item)]
    nominal: Option<String>,
    #[pyo3(item)]
    joints: Vec<String>,
}

/// What is done with the recordings before.
#[derive(Debug, FromPyObject)]
pub(crate) struct Preparing {
    #[pyo3(item)]
    smooth: bool,
    #[pyo3(item)]
    low_pass: Option<f64>,
    #[pyo3(item)]
    baseline: usize,
    #[pyo3(item)]
    validate_fraction: f64,
    #[pyo3(item)]
    delay: Vec<f64>,
    #[pyo3(item)]
    layout: Option<String>,
}

impl Asked {
    pub(crate) fn request(&self, py: Python<'_>) -> PyResult<Request> {
        let read = |text: &String| of_json(serde_json::from_str::<Values>(text));
        let [settings, training, rollout] = &self.settings;
        let seconds = self.seconds.map(Budget::Seconds);
        let mut request = Request {
            family: self.family.clone(),
            settings: read(settings)?,
            training: read(training)?,
            rollout: read(rollout)?,
            budget: self.steps.map(Budget::Steps).or(seconds),
            seed: self.seed,
            nominal: None,
        };
        let robot = |text: &String| {
            let text = rigid::example(text).unwrap_or(text);
            RobotConfig::new(text, self.joints.clone()).or_raise(py)
        };
        request.nominal = self.nominal.as_ref().map(robot).transpose()?;
        if let Some(urdf) = &self.urdf {
            let entry = Entry::taking_a_robot(request.family.as_deref()).or_raise(py)?;
            let config = of_json(serde_json::to_value(robot(urdf)?))?;
            request.settings.insert(entry.name.into(), config);
        }
        Ok(request)
    }
}

impl Preparing {
    fn options(&self) -> PrepareOptions {
        PrepareOptions {
            smooth: self.smooth,
            low_pass: self.low_pass,
            baseline: self.baseline,
            validate_fraction: self.validate_fraction,
            delayed: !self.delay.is_empty(),
        }
    }
}

/// What a fit says while it runs.
enum Event {
    Progress(Progress),
    Stage(String, f64),
}

/// The time between two events that nobody waits for.
const EVENT_EVERY: Duration = Duration::from_millis(50);

/// Sends what it sees to the thread that called.
struct Reporter<'a> {
    events: Sender<Event>,
    stop: &'a AtomicBool,
    last: Instant,
}

impl Reporter<'_> {
    fn send(&mut self, event: Event, always: bool) -> ControlFlow<()> {
        if always || self.last.elapsed() >= EVENT_EVERY {
            self.last = Instant::now();
            // OK to ignore: nobody listens any more.
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

/// Runs `work` while this thread calls `callback` with what the fit says, and looks for Ctrl-C; an exception of the callback
/// ends the fit and is raised.
fn watched<T: Send>(
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
            (Some(callback), Some(event)) => tell(callback, &event),
            _ => Ok(()),
        };
        // Ctrl-C ends the fit, which keeps what it has.
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

fn tell(callback: &Bound<'_, PyAny>, event: &Event) -> PyResult<()> {
    let told = match event {
        Event::Progress(progress) => object!(progress),
        Event::Stage(what, share) => object!({ "stage": what, "share": share }),
    };
    callback.call1((json(callback.py(), &told)?,)).map(|_| ())
}

/// A fitted model with everything that is said about it.
type Fitted<'py> = (Model, Bound<'py, PyDict>);

/// Fits the best of the models that are asked for to recordings.
#[pyfunction]
#[pyo3(signature = (training, validation, asked, preparing, callback=None))]
pub(crate) fn fit<'py>(
    py: Python<'py>,
    training: &Bound<'py, PyAny>,
    validation: &Bound<'py, PyAny>,
    asked: Asked,
    preparing: Preparing,
    callback: Option<Bound<'py, PyAny>>,
) -> PyResult<Fitted<'py>> {
    let (training, validation) = (recordings(training)?, recordings(validation)?);
    let (request, options) = (asked.request(py)?, preparing.options());
    let held_back = validation.is_empty();
    let pool = pool(py)?;
    let delay = &preparing.delay[..];
    let prepare = || {
        let (training, validation) = (delayed(training, delay)?, delayed(validation, delay)?);
        Prepared::new(training, validation, &request, &options)
    };
    let data = py.detach(|| pool.install(prepare)).or_raise(py)?;
    let candidates =
        FitConfig::candidates(&data.dataset, &data.estimates, &request).or_raise(py)?;
    if let [only] = &candidates[..] {
        only.config.validate(&data.dataset).or_raise(py)?;
    }
    let dataset = &data.dataset;
    let selection = watched(py, callback.as_ref(), |observer| {
        select(dataset, candidates, None, observer)
    })?
    .or_raise(py)?;
    let (model, motions) = (&selection.fit.model, &data.motions);
    let limit = time_for(motions.iter().map(Trajectory::len).sum());
    let figures =
        interruptible(py, limit, |stop| Figures::of(model, motions, stop))?.or_raise(py)?;
    let preparation = Preparation {
        layout: preparing.layout.unwrap_or_default(),
        smooth: data.options.smooth,
        low_pass: data.options.low_pass,
        delay: preparing.delay,
    };
    let provenance = Provenance {
        preparation: Some(preparation),
        ..Provenance::of_seed(request.seed)
    };
    summary(py, selection, held_back, provenance, figures, Some(&data))
}

fn summary<'py>(
    py: Python<'py>,
    selection: Selection,
    held_back: bool,
    provenance: Provenance,
    figures: Figures,
    data: Option<&Prepared>,
) -> PyResult<Fitted<'py>> {
    let Selection {
        fit,
        chosen,
        contestants,
    } = selection;
    let empty = CheckReport { items: Vec::new() };
    let check = data.map_or(&empty, |data| &data.check);
    let assessment = figures
        .assessment
        .of_selected(&contestants)
        .of_checked(check);
    let low_pass = data.and_then(|data| data.low_pass.clone());
    let choices: Vec<_> = low_pass.into_iter().chain(chosen.choices).collect();
    let summary = object!({
        "family": fit.model.family(),
        "ending": fit.ending,
        "improved": fit.improved(&chosen.config, held_back),
        "loss": finite(fit.best),
        "best_step": fit.best_step,
        "steps": fit.steps,
        "seconds": fit.seconds,
        "held_out": data.is_some_and(|data| data.held_out),
        "choices": choices,
        "tried": contestants,
        "settings": chosen.config,
        "check": { "verdict": check.verdict(), "items": check.items },
        "score": figures.score,
        "verdict": assessment.verdict,
        "assessment": assessment,
    });
    let model = Model::new(Body::Learned(fit.model, provenance));
    Ok((model, json(py, &summary)?))
}

/// JSON has no infinity.
fn finite(x: f64) -> Value {
    object!(x.is_finite().then_some(x))
}

/// Fits a model to samples that belong to no motion: states, forces and accelerations, `(m, n)` each.
#[pyfunction]
#[pyo3(signature = (samples, validation, names, asked, callback=None))]
pub(crate) fn fit_samples<'py>(
    py: Python<'py>,
    samples: [Option<Bound<'py, PyAny>>; 4],
    validation: Vec<usize>,
    names: Vec<(String, String, String)>,
    asked: Asked,
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
    let request = asked.request(py)?;
    let dataset = divided(coordinates, columns, &validation).or_raise(py)?;
    let chosen = FitConfig::for_data(&dataset, &[], &request).or_raise(py)?;
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
    let provenance = Provenance::of_seed(request.seed);
    summary(py, selection, true, provenance, figures, None)
}

/// The samples whose numbers are listed are for validation, the others are fitted.
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
