//! Models: what they answer at states, their motion, their files.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::rollout::Simulation;
use lagrangian::saved::Preparation;
use lagrangian::{
    Evaluation, Evaluator, Learned, Method, Provenance, RobotConfig, RolloutOptions, SavedModel,
    State,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};
use self_cell::self_cell;

use crate::arrays::{Rows, array, shown, writable};
use crate::error::{OrRaise, invalid, raise};
use crate::files::json;
use crate::number::OwnSystem;
use crate::recording::{described, list};
use crate::threads::interruptible;

/// What stands behind a model of Python.
pub(crate) enum Body {
    /// A fitted model, and where it comes from.
    Learned(Learned, Provenance),
    /// A system whose Lagrangian is known.
    Known(Box<dyn AnalyticModel>),
    /// A system whose Lagrangian is a function of Python.
    Own(OwnSystem),
}

impl Body {
    pub(crate) fn model(&self) -> &dyn lagrangian::Model {
        match self {
            Self::Learned(model, _) => model,
            Self::Known(system) => &**system,
            Self::Own(system) => system,
        }
    }

    /// The system, where it was not fitted.
    fn system(&self) -> Option<&dyn AnalyticModel> {
        match self {
            Self::Learned(..) => None,
            Self::Known(system) => Some(&**system),
            Self::Own(system) => Some(system),
        }
    }

    /// What a function of Python has raised on the way to a result.
    pub(crate) fn raised(&self) -> PyResult<()> {
        match self {
            Self::Own(system) => system.failure().map_or(Ok(()), Err),
            _ => Ok(()),
        }
    }
}

type BoxedEvaluator<'a> = Box<dyn Evaluator + 'a>;

self_cell!(
    /// An evaluator with the model that it belongs to, kept from one call to the next.
    struct Ready {
        owner: Arc<Body>,
        #[not_covariant]
        dependent: BoxedEvaluator,
    }
);

/// A model of a system: fitted, read from a file, or known.
#[pyclass(frozen, subclass, module = "lagrangian._lagrangian")]
pub(crate) struct Model {
    body: Arc<Body>,
    n: usize,
    /// Evaluators that wait for the next call; concurrent calls make their own.
    ready: Mutex<Vec<Ready>>,
}

/// A quantity that is asked for: its name and the values of a row of it.
struct Asked {
    name: &'static str,
    shape: &'static [Axis],
}

/// An axis of a quantity beside those of the states.
#[derive(Clone, Copy)]
enum Axis {
    /// One entry for each coordinate.
    Dof,
}

const SCALAR: &[Axis] = &[];
const VECTOR: &[Axis] = &[Axis::Dof];
const MATRIX: &[Axis] = &[Axis::Dof, Axis::Dof];

/// Arguments of a question: their names and values, the first of which is q; an absent one is 0.
type Given<'a, 'py> = (&'static str, Option<&'a Bound<'py, PyAny>>);

impl Model {
    pub(crate) fn new(body: Body) -> Self {
        Self {
            n: body.model().coordinates().dof(),
            body: Arc::new(body),
            ready: Mutex::new(Vec::new()),
        }
    }

    pub(crate) fn body(&self) -> &Arc<Body> {
        &self.body
    }

    /// The answer at the states of the arguments, written to `out` or to a new array.
    fn answer<'py, const G: usize>(
        &self,
        py: Python<'py>,
        asked: &Asked,
        given: [Given<'_, 'py>; G],
        out: Option<&Bound<'py, PyAny>>,
        ask: impl Fn(&mut dyn Evaluator, [&[f64]; G], &mut [f64]) -> Evaluation + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let States { rows, batch } = States::of(py, given, self.n)?;
        let states: usize = batch.iter().product();
        let mut shape = batch;
        shape.extend(asked.shape.iter().map(|Axis::Dof| self.n));
        let size: usize = shape.iter().product();
        let zeros = match rows.iter().any(Option::is_none) {
            true => vec![0.0; states * self.n],
            false => Vec::new(),
        };
        let repeated: Vec<Option<Vec<f64>>> = rows
            .iter()
            .map(|r| r.as_ref().and_then(|r| repeated(r, states, self.n)))
            .collect();
        let mut arguments = [&zeros[..]; G];
        for ((argument, rows), repeated) in arguments.iter_mut().zip(&rows).zip(&repeated) {
            if let Some(rows) = rows {
                *argument = repeated.as_deref().unwrap_or_else(|| rows.values());
            }
        }
        let Some(out) = out else {
            let mut values = vec![0.0; size];
            let outcome = self.evaluate(py, states, &ask, arguments, &mut values);
            self.check(py, asked, outcome, &rows)?;
            return Ok(array(py, values, &shape)?.into_any());
        };
        let mut target = writable(out, &shape)?;
        let values = target
            .as_slice_mut()
            .map_err(|_| invalid(py, "out is not contiguous: give a contiguous array"))?;
        let outcome = self.evaluate(py, states, &ask, arguments, values);
        drop(target);
        self.check(py, asked, outcome, &rows)?;
        Ok(out.clone())
    }

    fn evaluate<const G: usize>(
        &self,
        py: Python<'_>,
        states: usize,
        ask: &(impl Fn(&mut dyn Evaluator, [&[f64]; G], &mut [f64]) -> Evaluation + Sync),
        arguments: [&[f64]; G],
        values: &mut [f64],
    ) -> Evaluation {
        if states == 0 {
            return Evaluation::Regular;
        }
        let waiting = || self.ready.lock().unwrap_or_else(PoisonError::into_inner);
        let ready = waiting().pop();
        let mut ready = ready
            .unwrap_or_else(|| Ready::new(Arc::clone(&self.body), |body| body.model().evaluator()));
        let outcome = match states {
            // Giving the lock up for a microsecond costs more than it frees.
            0..=ALONE => {
                ready.with_dependent_mut(|_, evaluator| ask(&mut **evaluator, arguments, values))
            }
            _ => {
                let ready = &mut ready;
                py.detach(move || {
                    ready
                        .with_dependent_mut(|_, evaluator| ask(&mut **evaluator, arguments, values))
                })
            }
        };
        waiting().push(ready);
        outcome
    }

    /// Turns an answer that does not exist into an exception, and says where a mass matrix was singular.
    fn check(
        &self,
        py: Python<'_>,
        asked: &Asked,
        outcome: Evaluation,
        rows: &[Option<Rows<'_>>],
    ) -> PyResult<()> {
        self.body.raised()?;
        match outcome {
            Evaluation::Regular => Ok(()),
            Evaluation::Singular { states } => {
                let message = format!(
                    "the mass matrix is singular at {states} states: their accelerations are the least-norm ones"
                );
                let category = py
                    .import("lagrangian.errors")?
                    .getattr("SingularMassMatrix")?;
                let message = std::ffi::CString::new(message)?;
                PyErr::warn(py, &category, &message, 2)
            }
            Evaluation::NotFinite { state, .. } => {
                let not_finite = |r: &Option<Rows<'_>>| {
                    r.as_ref()
                        .is_some_and(|r| r.values().iter().any(|x| !x.is_finite()))
                };
                let message = match rows.iter().any(not_finite) {
                    true => format!(
                        "an argument is not finite (NaN or infinite) at state {state}: remove or repair that state"
                    ),
                    false => format!(
                        "the {} of the model is not finite at state {state}: it lies where the model is not defined",
                        asked.name
                    ),
                };
                Err(invalid(py, message))
            }
            Evaluation::Unsupported => {
                let message = format!(
                    "the model has no {}: take a model with a Lagrangian, such as Lnn, Delan or Rigid",
                    asked.name
                );
                Err(raise(py, "NotSupported", message))
            }
        }
    }
}

/// Up to so many states the interpreter's lock is kept.
const ALONE: usize = 8;

/// The arguments of a question, and the axes of the states.
struct States<'py, const G: usize> {
    rows: [Option<Rows<'py>>; G],
    batch: Vec<usize>,
}

impl<'py, const G: usize> States<'py, G> {
    fn of(py: Python<'py>, given: [Given<'_, 'py>; G], n: usize) -> PyResult<Self> {
        let mut rows = [const { None }; G];
        let mut batch: Option<(&str, Vec<usize>)> = None;
        for (rows, (name, value)) in rows.iter_mut().zip(given) {
            let Some(value) = value else { continue };
            let own = Rows::new(value, name, n)?;
            let axes = &own.shape()[..own.shape().len() - 1];
            if !axes.is_empty() {
                match &batch {
                    Some((first, other)) if other != axes => {
                        let message = format!(
                            "{name} has shape {} where {first} has states of shape {}: give as many states in each (numpy.broadcast_to), or one state",
                            shown(own.shape()),
                            shown(other)
                        );
                        return Err(invalid(py, message));
                    }
                    Some(_) => {}
                    None => batch = Some((name, axes.to_vec())),
                }
            }
            *rows = Some(own);
        }
        let batch = batch.map_or_else(Vec::new, |(_, axes)| axes);
        Ok(Self { rows, batch })
    }
}

/// One state as many times as there are states; `None` where nothing has to be repeated.
fn repeated(rows: &Rows<'_>, states: usize, n: usize) -> Option<Vec<f64>> {
    (rows.values().len() != states * n).then(|| rows.values().repeat(states))
}

type Array<'py> = Bound<'py, PyAny>;

#[pymethods]
impl Model {
    /// The same model, for a class that is derived from this one.
    #[new]
    #[pyo3(signature = (core, *_others))]
    fn of(core: &Bound<'_, Self>, _others: &Bound<'_, PyTuple>) -> Self {
        let own = core.get();
        Self {
            body: Arc::clone(&own.body),
            n: own.n,
            ready: Mutex::new(Vec::new()),
        }
    }

    /// The coordinates: name, unit and kind of each.
    #[getter]
    fn coordinates(&self) -> Vec<(String, String, String)> {
        described(self.body.model().coordinates())
    }

    /// The family, or the name of the system.
    #[getter]
    fn family(&self) -> String {
        match &*self.body {
            Body::Learned(model, _) => model.family().into(),
            other => other.system().map_or_else(String::new, |s| s.name().into()),
        }
    }

    /// Whether it has forward dynamics.
    #[getter]
    fn moves(&self) -> bool {
        self.body.model().moves()
    }

    /// How its recordings were prepared, as a dictionary; None where that is not known.
    #[getter]
    fn preparation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        match &*self.body {
            Body::Learned(
                _,
                Provenance {
                    preparation: Some(own),
                    ..
                },
            ) => Ok(Some(json(py, own)?)),
            _ => Ok(None),
        }
    }

    /// The parameters that have a name and a unit, as dictionaries.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let parameters = match &*self.body {
            Body::Learned(model, _) => model.parameters(),
            _ => Vec::new(),
        };
        json(py, &serde_json::json!({ "all": parameters }))?
            .as_any()
            .get_item("all")
    }

    #[pyo3(signature = (q, qd, tau=None, *, out=None))]
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        tau: Option<Array<'py>>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "forward dynamics",
            shape: VECTOR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd)), ("tau", tau.as_ref())];
        self.answer(
            py,
            &asked,
            given,
            out.as_ref(),
            |model, [q, qd, tau], qdd| model.forward_dynamics(q, qd, tau, qdd),
        )
    }

    #[pyo3(signature = (q, qd, qdd, *, out=None))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        qdd: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "inverse dynamics",
            shape: VECTOR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd)), ("qdd", Some(&qdd))];
        self.answer(
            py,
            &asked,
            given,
            out.as_ref(),
            |model, [q, qd, qdd], tau| model.inverse_dynamics(q, qd, qdd, tau),
        )
    }

    #[pyo3(signature = (q, qd=None, *, out=None))]
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Option<Array<'py>>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "mass matrix",
            shape: MATRIX,
        };
        let given = [("q", Some(&q)), ("qd", qd.as_ref())];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, qd], mass| {
            model.mass_matrix(q, qd, mass)
        })
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn bias<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "bias",
            shape: VECTOR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd))];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, qd], bias| {
            model.bias(q, qd, bias)
        })
    }

    #[pyo3(signature = (q, *, out=None))]
    fn gravity<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "gravity",
            shape: VECTOR,
        };
        let given = [("q", Some(&q)), ("qd", None)];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, rest], g| {
            model.bias(q, rest, g)
        })
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn momentum<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "momentum",
            shape: VECTOR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd))];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, qd], p| {
            model.momentum(q, qd, p)
        })
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn energy<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "energy",
            shape: SCALAR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd))];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, qd], h| {
            model.energy(q, qd, h)
        })
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn lagrangian<'py>(
        &self,
        py: Python<'py>,
        q: Array<'py>,
        qd: Array<'py>,
        out: Option<Array<'py>>,
    ) -> PyResult<Array<'py>> {
        let asked = Asked {
            name: "Lagrangian",
            shape: SCALAR,
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd))];
        self.answer(py, &asked, given, out.as_ref(), |model, [q, qd], l| {
            model.lagrangian(q, qd, l)
        })
    }

    /// The bytes of the file of the model.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes(py)?))
    }

    /// Writes the file of the model: a whole one or none.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let bytes = self.bytes(py)?;
        py.detach(|| -> std::io::Result<()> {
            let beside = path.with_extension("part");
            let mut file = fs::File::create(&beside)?;
            file.write_all(&bytes)?;
            file.sync_all()?;
            fs::rename(&beside, &path)
        })?;
        Ok(())
    }
}

impl Model {
    fn bytes(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        match &*self.body {
            Body::Learned(model, provenance) => {
                let saved = model.save(provenance.clone()).or_raise(py)?;
                saved.to_bytes().or_raise(py)
            }
            _ => {
                let message = "a known system was not fitted: save its name and parameters instead";
                Err(raise(py, "NotSupported", message))
            }
        }
    }
}

/// The model of a file, or of the bytes of one.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, source: &Bound<'_, PyAny>) -> PyResult<Model> {
    let saved = match source.cast::<PyBytes>() {
        Ok(bytes) => SavedModel::from_bytes(bytes.as_bytes()),
        Err(_) => {
            let path: PathBuf = source.extract()?;
            let file = fs::File::open(&path)?;
            py.detach(|| SavedModel::read(file))
        }
    };
    let saved = saved.or_raise(py)?;
    let model = Learned::load(&saved).or_raise(py)?;
    Ok(Model::new(Body::Learned(model, saved.header.provenance)))
}

/// A system whose Lagrangian is known, by its name.
#[pyfunction]
pub(crate) fn system(
    py: Python<'_>,
    name: &str,
    parameters: Vec<(String, f64)>,
) -> PyResult<Model> {
    let given: Vec<(&str, f64)> = parameters.iter().map(|(n, x)| (n.as_str(), *x)).collect();
    Ok(Model::new(Body::Known(by_name(name, &given).or_raise(py)?)))
}

/// A system whose Lagrangian is a function of (q, qd).
#[pyfunction]
pub(crate) fn own_system(
    py: Python<'_>,
    name: String,
    function: Py<PyAny>,
    coordinates: Vec<(String, String, String)>,
) -> PyResult<Model> {
    let coordinates = crate::recording::coordinates(py, coordinates)?;
    Ok(Model::new(Body::Own(OwnSystem::new(
        name,
        function,
        coordinates,
    ))))
}

/// The robot of a URDF text, or of an example's name.
#[pyfunction]
pub(crate) fn robot(py: Python<'_>, urdf: &str, joints: Vec<String>) -> PyResult<Model> {
    let text = rigid::example(urdf).unwrap_or(urdf);
    let config = RobotConfig::new(text, joints).or_raise(py)?;
    let bodies = RigidBodies::with_joints(&config.urdf, &config.joints).or_raise(py)?;
    Ok(Model::new(Body::Known(Box::new(bodies))))
}

/// How a motion is integrated.
#[derive(Debug, FromPyObject)]
pub(crate) struct Integration {
    #[pyo3(item)]
    method: String,
    #[pyo3(item)]
    step: f64,
    #[pyo3(item)]
    rtol: f64,
    #[pyo3(item)]
    atol: f64,
    #[pyo3(item)]
    max_steps: u64,
}

impl Integration {
    pub(crate) fn options(&self, py: Python<'_>) -> PyResult<RolloutOptions> {
        let known = Method::TABLE
            .iter()
            .find(|(_, named)| named.name == self.method);
        let Some((method, _)) = known else {
            let names: Vec<&str> = Method::TABLE.iter().map(|(_, named)| named.name).collect();
            let message = format!(
                "method is '{}': choose one of {}",
                self.method,
                names.join(", ")
            );
            return Err(invalid(py, message));
        };
        Ok(RolloutOptions {
            method: *method,
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            max_steps: self.max_steps,
            ..RolloutOptions::default()
        })
    }
}

/// What is simulated.
#[derive(Debug, FromPyObject)]
pub(crate) struct Asking {
    #[pyo3(item)]
    starts: Vec<(Vec<f64>, Vec<f64>)>,
    #[pyo3(item)]
    test_starts: bool,
    #[pyo3(item)]
    trajectories: usize,
    #[pyo3(item)]
    duration: f64,
    #[pyo3(item)]
    step: f64,
    #[pyo3(item)]
    drive: f64,
    #[pyo3(item)]
    friction: f64,
    #[pyo3(item)]
    momenta: bool,
    #[pyo3(item)]
    noise: Option<f64>,
    #[pyo3(item)]
    seed: u64,
}

/// Recordings of a known system: the parts of each, and how each ended.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    asking: Asking,
    integration: Integration,
) -> PyResult<(Bound<'py, PyList>, Bound<'py, PyDict>)> {
    let body = Arc::clone(model.get().body());
    let Some(system) = body.system() else {
        return Err(invalid(
            py,
            "the model is a fitted one: use its method rollout",
        ));
    };
    let simulation = Simulation {
        starts: asking
            .starts
            .into_iter()
            .map(|(q, qd)| State::new(q, qd))
            .collect(),
        test_starts: asking.test_starts,
        trajectories: asking.trajectories,
        duration: asking.duration,
        step: asking.step,
        drive: asking.drive,
        friction: asking.friction,
        momenta: asking.momenta,
        noise: asking.noise,
        seed: asking.seed,
    };
    let options = integration.options(py)?;
    let run = |stop| {
        let options = RolloutOptions { stop, ..options };
        let rollouts = simulation.run(system, &options)?;
        let outcomes: Vec<_> = rollouts.iter().map(|r| r.outcome).collect();
        Ok((simulation.recorded(system, rollouts), outcomes))
    };
    let simulated = interruptible(py, Duration::MAX, run)?;
    body.raised()?;
    let (motions, outcomes) = simulated.or_raise(py)?;
    let outcomes = json(py, &serde_json::json!({ "all": outcomes }))?;
    Ok((list(py, system.coordinates(), motions)?, outcomes))
}

/// How the recordings of a model were prepared.
pub(crate) fn preparation_of(body: &Body) -> Preparation {
    match body {
        Body::Learned(_, provenance) => provenance.preparation.clone().unwrap_or_default(),
        _ => Preparation::default(),
    }
}
