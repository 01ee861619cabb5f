//! Known systems: by name, as robots, or as a function of Python; their simulation.

use std::sync::Arc;
use std::time::Duration;

use lagrangian::analytic::by_name;
use lagrangian::integrate::Method;
use lagrangian::rigid::{self, RigidBodies, RobotConfig};
use lagrangian::rollout::Simulation;
use lagrangian::{RolloutOptions, State};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::error::{OrRaise, invalid};
use crate::files::value;
use crate::model::{Model, ModelSource};
use crate::number::OwnSystem;
use crate::recording::{coordinates, list};
use crate::threads::interruptible;

/// A system with a known Lagrangian, by its name.
#[pyfunction]
pub(crate) fn system(
    py: Python<'_>,
    name: &str,
    parameters: Vec<(String, f64)>,
) -> PyResult<Model> {
    let given: Vec<(&str, f64)> = parameters.iter().map(|(n, x)| (n.as_str(), *x)).collect();
    Ok(Model::new(ModelSource::Known(
        by_name(name, &given).or_raise(py)?,
    )))
}

/// A system whose Lagrangian is a function of (q, qd).
#[pyfunction]
pub(crate) fn own_system(
    py: Python<'_>,
    name: String,
    function: Py<PyAny>,
    named: Vec<(String, String, String)>,
) -> PyResult<Model> {
    let coordinates = coordinates(py, named)?;
    Ok(Model::new(ModelSource::Own(OwnSystem::new(
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
    let robot = bodies.with_friction().or_raise(py)?;
    Ok(Model::new(ModelSource::Known(Box::new(robot))))
}

/// The URDF text of an example.
#[pyfunction]
pub(crate) fn example_urdf(name: &str) -> Option<&'static str> {
    rigid::example(name)
}

/// The integration of a motion.
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
        Ok(RolloutOptions {
            method: self.method.parse::<Method>().or_raise(py)?,
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            max_steps: self.max_steps,
            ..RolloutOptions::default()
        })
    }
}

/// The request of a simulation.
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

/// Recordings of a known system: the parts of each, and the outcome of each.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    asking: Asking,
    integration: Integration,
) -> PyResult<(Bound<'py, PyList>, Bound<'py, PyAny>)> {
    let body = Arc::clone(model.get().body());
    let Some(system) = body.system() else {
        return Err(invalid(
            py,
            "the model is not a known system: roll a fitted one out (its method rollout), record a plant (lagrangian.plant.record)",
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
        lagrangian::Result::Ok((simulation.recorded(system, rollouts), outcomes))
    };
    let simulated = interruptible(py, Duration::MAX, run)?;
    body.raised()?;
    let (motions, outcomes) = simulated.or_raise(py)?;
    let outcomes = value(py, &outcomes)?;
    Ok((list(py, system.coordinates(), motions)?, outcomes))
}
