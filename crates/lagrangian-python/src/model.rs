//! Models: their sources, their methods, their files.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use lagrangian::analytic::AnalyticModel;
use lagrangian::mechanics::Evaluation;
use lagrangian::saved::Preparation;
use lagrangian::{Evaluator, Learned, Observer, Provenance, SavedModel, distil};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use self_cell::self_cell;

use crate::answers::{Asked, MATRIX, OfState, SCALAR, VECTOR};
use crate::error::{OrRaise, raise};
use crate::files::{json, value};
use crate::fit::watched;
use crate::number::OwnSystem;
use crate::plant::PythonPlant;
use crate::recording::described;

/// The source of a model of Python.
pub(crate) enum ModelSource {
    /// A fitted model, and its origin.
    Learned(Learned, Provenance),
    /// A system whose Lagrangian is known.
    Known(Box<dyn AnalyticModel>),
    /// A system whose Lagrangian is a function of Python.
    Own(OwnSystem),
    /// A machine that a simulator of Python moves.
    Plant(PythonPlant),
}

impl ModelSource {
    pub(crate) fn model(&self) -> &dyn lagrangian::Model {
        match self {
            Self::Learned(model, _) => model,
            Self::Known(system) => &**system,
            Self::Own(system) => system,
            Self::Plant(plant) => plant,
        }
    }

    /// The system, where it was not fitted.
    pub(crate) fn system(&self) -> Option<&dyn AnalyticModel> {
        match self {
            Self::Learned(..) | Self::Plant(_) => None,
            Self::Known(system) => Some(&**system),
            Self::Own(system) => Some(system),
        }
    }

    /// The preparation of the recordings of a fitted model, where it is known.
    pub(crate) fn preparation(&self) -> Option<&Preparation> {
        match self {
            Self::Learned(_, provenance) => provenance.preparation.as_ref(),
            _ => None,
        }
    }

    /// The exception that a function of Python has raised during a computation.
    pub(crate) fn raised(&self) -> PyResult<()> {
        match self {
            Self::Own(system) => system.failure().map_or(Ok(()), Err),
            Self::Plant(plant) => plant.failure().map_or(Ok(()), Err),
            _ => Ok(()),
        }
    }
}

type BoxedEvaluator<'a> = Box<dyn Evaluator + 'a>;

self_cell!(
    /// An evaluator with the model that it belongs to, kept from one call to the next.
    pub(crate) struct Ready {
        owner: Arc<ModelSource>,
        #[not_covariant]
        dependent: BoxedEvaluator,
    }
);

/// A model of a system: fitted, read from a file, or known.
#[pyclass(frozen, subclass, module = "lagrangian._lagrangian")]
pub(crate) struct Model {
    pub(crate) body: Arc<ModelSource>,
    pub(crate) n: usize,
    /// Evaluators for the next call; concurrent calls make their own.
    pub(crate) ready: Mutex<Vec<Ready>>,
}

impl Model {
    pub(crate) fn new(body: ModelSource) -> Self {
        Self {
            n: body.model().coordinates().dof(),
            body: Arc::new(body),
            ready: Mutex::new(Vec::new()),
        }
    }

    pub(crate) fn body(&self) -> &Arc<ModelSource> {
        &self.body
    }
}

type Array<'py> = Bound<'py, PyAny>;

/// An array that may be omitted, such as that which a result is written to.
type Given<'py> = Option<Array<'py>>;

type Answer<'py> = PyResult<Array<'py>>;

const MASS_MATRIX: OfState = OfState("mass matrix", MATRIX, |m, [q, v], x| m.mass_matrix(q, v, x));
const BIAS: OfState = OfState("bias", VECTOR, |m, [q, v], x| m.bias(q, v, x));
/// The bias at rest.
const GRAVITY: OfState = OfState("gravity", VECTOR, |m, [q, rest], x| m.bias(q, rest, x));
const MOMENTUM: OfState = OfState("momentum", VECTOR, |m, [q, v], x| m.momentum(q, v, x));
const ENERGY: OfState = OfState("energy", SCALAR, |m, [q, v], x| m.energy(q, v, x));
const LAGRANGIAN: OfState = OfState("Lagrangian", SCALAR, |m, [q, v], x| m.lagrangian(q, v, x));

#[pymethods]
impl Model {
    /// The model, for a class that is derived from this one.
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
            ModelSource::Learned(model, _) => model.family().into(),
            ModelSource::Plant(_) => "plant".into(),
            other => other.system().map_or_else(String::new, |s| s.name().into()),
        }
    }

    /// Whether the model has forward dynamics.
    #[getter]
    fn moves(&self) -> bool {
        self.body.model().moves()
    }

    /// The preparation of its recordings, as a dictionary; None where it is unknown.
    #[getter]
    fn preparation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let own = self.body.preparation();
        own.map(|own| json(py, own)).transpose()
    }

    /// The parameters that have a name and a unit, as dictionaries.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let parameters = match &*self.body {
            ModelSource::Learned(model, _) => model.parameters(),
            _ => Vec::new(),
        };
        value(py, &parameters)
    }

    /// The law as it is written, as a dictionary; None for a model that is no formula.
    #[getter]
    fn law<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let written = match &*self.body {
            ModelSource::Learned(model, _) => model.written(),
            _ => None,
        };
        value(py, &written)
    }

    /// The law of a chain of equal sites on another number of sites.
    fn with_sites(&self, py: Python<'_>, sites: usize) -> PyResult<Self> {
        match &*self.body {
            ModelSource::Learned(model, provenance) => {
                let model = model.with_sites(sites).or_raise(py)?;
                Ok(Self::new(ModelSource::Learned(model, provenance.clone())))
            }
            _ => {
                let message = "only a fitted lattice has sites";
                Err(raise(py, "NotSupported", message))
            }
        }
    }

    /// The law that its motions obey, and the noise that hides what it says differently.
    fn distil(&self, py: Python<'_>, seed: u64) -> PyResult<(Self, f64)> {
        let ModelSource::Learned(model, provenance) = &*self.body else {
            let message = "only a fitted model has motions of its own to search for its law";
            return Err(raise(py, "NotSupported", message));
        };
        let own = |observer: &mut dyn Observer| distil(model, seed, observer);
        let found = watched(py, None, own)?.or_raise(py)?;
        let model = ModelSource::Learned(found.model, provenance.clone());
        Ok((Self::new(model), found.noise))
    }

    #[pyo3(signature = (q, qd, tau=None, *, out=None))]
    fn forward_dynamics<'py>(
        &self,
        q: Array<'py>,
        qd: Array<'py>,
        tau: Option<Array<'py>>,
        out: Given<'py>,
    ) -> Answer<'py> {
        let given = [("q", Some(&q)), ("qd", Some(&qd)), ("tau", tau.as_ref())];
        let asked = Asked("forward dynamics", VECTOR);
        self.answer(q.py(), asked, given, out, |model, [q, qd, tau], qdd| {
            model.forward_dynamics(q, qd, tau, qdd)
        })
    }

    #[pyo3(signature = (q, qd, qdd, *, out=None))]
    fn inverse_dynamics<'py>(
        &self,
        q: Array<'py>,
        qd: Array<'py>,
        qdd: Array<'py>,
        out: Given<'py>,
    ) -> Answer<'py> {
        let given = [("q", Some(&q)), ("qd", Some(&qd)), ("qdd", Some(&qdd))];
        let asked = Asked("inverse dynamics", VECTOR);
        self.answer(q.py(), asked, given, out, |model, [q, qd, qdd], tau| {
            model.inverse_dynamics(q, qd, qdd, tau)
        })
    }

    #[pyo3(signature = (q, qd=None, *, out=None))]
    fn mass_matrix<'py>(&self, q: Array<'py>, qd: Given<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(MASS_MATRIX, &q, qd.as_ref(), out)
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn bias<'py>(&self, q: Array<'py>, qd: Array<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(BIAS, &q, Some(&qd), out)
    }

    #[pyo3(signature = (q, *, out=None))]
    fn gravity<'py>(&self, q: Array<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(GRAVITY, &q, None, out)
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn momentum<'py>(&self, q: Array<'py>, qd: Array<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(MOMENTUM, &q, Some(&qd), out)
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn energy<'py>(&self, q: Array<'py>, qd: Array<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(ENERGY, &q, Some(&qd), out)
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn lagrangian<'py>(&self, q: Array<'py>, qd: Array<'py>, out: Given<'py>) -> Answer<'py> {
        self.of_state(LAGRANGIAN, &q, Some(&qd), out)
    }

    #[pyo3(signature = (q, qd, *, out=None))]
    fn distance_from_data<'py>(
        &self,
        q: Array<'py>,
        qd: Array<'py>,
        out: Given<'py>,
    ) -> Answer<'py> {
        let (py, model) = (q.py(), self.body.model());
        let Some(visited) = model.visited() else {
            let message = "the model does not know the states that it was fitted to: fit it again with this version";
            return Err(raise(py, "NotSupported", message));
        };
        let given = [("q", Some(&q)), ("qd", Some(&qd))];
        let asked = Asked("distance from the data", SCALAR);
        self.answer(py, asked, given, out, |_, [q, qd], distances| {
            visited.distances(model.coordinates(), q, qd, distances);
            Evaluation::of(distances, 1, 0)
        })
    }

    /// The bytes of the file of the model.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes(py)?))
    }

    /// Writes the file of the model, as a whole or not at all.
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
            ModelSource::Learned(model, provenance) => {
                let saved = model.save(provenance.clone()).or_raise(py)?;
                saved.to_bytes().or_raise(py)
            }
            _ => {
                let message = "only a fitted model has a file: save the name and parameters of a system, the file of a plant";
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
    Ok(Model::new(ModelSource::Learned(
        model,
        saved.header.provenance,
    )))
}
