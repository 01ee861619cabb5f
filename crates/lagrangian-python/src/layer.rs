//! Models as differentiable layers.

use lagrangian::layer::{Inputs, Layer as Core, Map, Slopes};
use lagrangian::train::DataFacts;
use pyo3::prelude::*;

use crate::arrays::{Rows, array};
use crate::error::{OrRaise, invalid, raise};
use crate::fit::spec;
use crate::model::{Model, ModelSource};
use crate::recording::coordinates;
use crate::threads::pool;

/// A model as a differentiable layer: it never changes, and every call may have its own parameters.
#[pyclass(frozen, module = "lagrangian._lagrangian")]
pub(crate) struct Layer {
    core: Core,
}

type Array<'py> = Bound<'py, PyAny>;

/// The arguments of a call: a map with its step, states, and parameters where they differ from those of the layer.
#[derive(FromPyObject)]
struct Call<'py>(String, f64, [Array<'py>; 3], Option<Array<'py>>);

#[pymethods]
impl Layer {
    /// The layer of a fitted model.
    #[staticmethod]
    fn of(py: Python<'_>, model: &Bound<'_, Model>) -> PyResult<Self> {
        match &**model.get().body() {
            ModelSource::Learned(model, _) => {
                Core::of(model).or_raise(py).map(|core| Self { core })
            }
            _ => {
                let message = "a known system has no weights: give a fitted model, or a family to Layer.fresh";
                Err(raise(py, "NotSupported", message))
            }
        }
    }

    /// The layer of a fresh model with random weights.
    #[staticmethod]
    fn fresh(
        py: Python<'_>,
        named: Vec<(String, String, String)>,
        request: &str,
    ) -> PyResult<Self> {
        let chosen = spec(request)?.choose(&DataFacts::default()).or_raise(py)?;
        let core = Core::new(coordinates(py, named)?, &chosen.config).or_raise(py)?;
        Ok(Self { core })
    }

    /// The number of coordinates.
    #[getter]
    fn n(&self) -> usize {
        self.core.coordinates().dof()
    }

    /// The family of the model.
    #[getter]
    fn family(&self) -> &'static str {
        self.core.model().family()
    }

    /// Whether v are momenta.
    #[getter]
    fn moves_in_momenta(&self) -> bool {
        self.core.moves_in_momenta()
    }

    /// All parameters, `(p,)`.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let values = self.core.parameters().to_vec();
        let size = values.len();
        Ok(array(py, values, &[size])?.into_any())
    }

    /// Random parameters.
    fn initialise<'py>(&self, py: Python<'py>, seed: u64) -> PyResult<Array<'py>> {
        let values = self.core.initialise(seed);
        let size = values.len();
        Ok(array(py, values, &[size])?.into_any())
    }

    /// The nearest parameters in their domain.
    fn project<'py>(&self, py: Python<'py>, parameters: Array<'py>) -> PyResult<Array<'py>> {
        let mut values = Rows::of_any_width(&parameters, "parameters")?
            .values()
            .to_vec();
        self.core.project(&mut values).or_raise(py)?;
        let size = values.len();
        Ok(array(py, values, &[size])?.into_any())
    }

    /// The model with these parameters.
    fn model(&self, py: Python<'_>, parameters: Option<Array<'_>>) -> PyResult<Model> {
        let own = self.with(py, parameters.as_ref())?;
        let learned = own.as_ref().unwrap_or(&self.core).model().clone();
        Ok(Model::new(ModelSource::Learned(
            learned,
            Default::default(),
        )))
    }

    /// The value of a map.
    fn evaluate<'py>(&self, py: Python<'py>, call: Call<'py>) -> PyResult<Array<'py>> {
        let Ready { layer, map, rows } = self.ready(py, &call)?;
        let inputs = inputs(&rows);
        let layer = layer.as_ref().unwrap_or(&self.core);
        let values = py.detach(|| layer.evaluate(map, &inputs)).or_raise(py)?;
        let mut shape = rows[0].shape().to_vec();
        shape.pop();
        match map {
            Map::Scalar => {}
            Map::Acceleration | Map::Force => shape.push(self.n()),
            Map::Rates | Map::Step(_) => shape.push(2 * self.n()),
        }
        Ok(array(py, values, &shape)?.into_any())
    }

    /// The sensitivities to q, v, u and the parameters.
    fn pull_back<'py>(
        &self,
        py: Python<'py>,
        call: Call<'py>,
        g: Array<'py>,
    ) -> PyResult<[Array<'py>; 4]> {
        let Ready { layer, map, rows } = self.ready(py, &call)?;
        let g = Rows::of_any_width(&g, "g")?;
        let (inputs, weights) = (inputs(&rows), g.values());
        let layer = layer.as_ref().unwrap_or(&self.core);
        let pull = || layer.pull_back(map, &inputs, weights);
        let slopes = match weights.len() {
            0..=ALONE => py.detach(pull),
            _ => {
                let pool = pool(py)?;
                py.detach(|| pool.install(pull))
            }
        };
        let Slopes {
            q,
            v,
            u,
            parameters,
        } = slopes.or_raise(py)?;
        let (states, size) = (rows[0].shape(), [parameters.len()]);
        let given = [(q, states), (v, states), (u, states), (parameters, &size)];
        let [q, v, u, parameters] = given.map(|(values, shape)| array(py, values, shape));
        Ok([q?, v?, u?, parameters?].map(Bound::into_any))
    }
}

/// The largest number of sensitivities that the calling thread computes alone: few blocks are not worth a pool.
const ALONE: usize = 32;

/// The layer of a call; `None` for the layer itself where no other parameters are given.
struct Ready<'py> {
    layer: Option<Core>,
    map: Map,
    rows: [Rows<'py>; 3],
}

impl Layer {
    fn ready<'py>(&self, py: Python<'py>, call: &Call<'py>) -> PyResult<Ready<'py>> {
        let Call(name, h, [q, v, u], parameters) = call;
        let rows = [
            Rows::new(q, "q", self.n())?,
            Rows::new(v, "v", self.n())?,
            Rows::new(u, "u", self.n())?,
        ];
        Ok(Ready {
            layer: self.with(py, parameters.as_ref())?,
            map: map(py, name, *h)?,
            rows,
        })
    }

    /// The layer with these parameters, where they differ from its own.
    fn with(&self, py: Python<'_>, parameters: Option<&Array<'_>>) -> PyResult<Option<Core>> {
        let Some(parameters) = parameters else {
            return Ok(None);
        };
        let parameters = Rows::of_any_width(parameters, "parameters")?;
        if parameters.values() == self.core.parameters() {
            return Ok(None);
        }
        self.core
            .with_parameters(parameters.values())
            .or_raise(py)
            .map(Some)
    }
}

fn inputs<'a>(rows: &'a [Rows<'_>; 3]) -> Inputs<'a> {
    let [q, v, u] = rows;
    Inputs {
        q: q.values(),
        v: v.values(),
        u: u.values(),
    }
}

fn map(py: Python<'_>, name: &str, h: f64) -> PyResult<Map> {
    Ok(match name {
        "acceleration" => Map::Acceleration,
        "rates" => Map::Rates,
        "force" => Map::Force,
        "step" => Map::Step(h),
        "scalar" => Map::Scalar,
        _ => {
            let message = format!(
                "there is no map '{name}': choose one of acceleration, rates, force, step, scalar"
            );
            return Err(invalid(py, message));
        }
    })
}
