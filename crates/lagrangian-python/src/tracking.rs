//! Control loops: a robot that follows a reference through a model, or a function of Python.

use lagrangian::{Error, State};
use lagrangian_control::{
    ControlLaw, Driven, Gains, LoopConfig, LoopOutcome, Quantiles, Reference, RobotChange, Sensors,
    Simulation, follow, inertia_along,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Rows, array};
use crate::error::{OrRaise, invalid};
use crate::files::value;
use crate::model::Model;
use crate::online::Online;
use crate::recording::{parts, recording};

/// The loop between sensors, controller and drives.
#[derive(Debug, FromPyObject)]
pub(crate) struct Loop {
    #[pyo3(item)]
    rate: f64,
    #[pyo3(item)]
    limit: Vec<f64>,
    #[pyo3(item)]
    noise: (f64, f64),
    #[pyo3(item)]
    quantisation: f64,
    #[pyo3(item)]
    drive_noise: f64,
    #[pyo3(item)]
    delay: usize,
    #[pyo3(item)]
    sensor_delay: usize,
    #[pyo3(item)]
    seed: u64,
}

impl Loop {
    fn config(&self) -> LoopConfig {
        LoopConfig {
            rate: self.rate,
            limit: self.limit.clone(),
            sensors: Sensors {
                position_noise: self.noise.0,
                velocity_noise: self.noise.1,
                quantisation: self.quantisation,
                ..Sensors::default()
            },
            drive_noise: self.drive_noise,
            actuation_delay: self.delay,
            sensor_delay: self.sensor_delay,
            seed: self.seed,
            ..LoopConfig::default()
        }
    }
}

/// What the sensors and the drives of a loop saw, what was true, and how it ended.
fn driven<'py>(py: Python<'py>, robot: &Model, driven: Driven) -> PyResult<Bound<'py, PyDict>> {
    robot.body().raised()?;
    let coordinates = robot.body().model().coordinates();
    let found = PyDict::new(py);
    for (key, motion) in [("motion", driven.trajectory), ("measured", driven.measured)] {
        let own = parts(py, &motion.name, coordinates, motion.t, motion.signals)?;
        found.set_item(key, own)?;
    }
    let diverged = match driven.outcome {
        LoopOutcome::Finished => None,
        LoopOutcome::Diverged { t } => Some(t),
    };
    found.set_item("diverged", diverged)?;
    found.set_item("saturated", driven.saturated)?;
    found.set_item("not_finite", driven.not_finite)?;
    let Quantiles { p50, p99, max, .. } = driven.latency.quantiles();
    found.set_item("latency", (p50, p99, max))?;
    Ok(found)
}

/// The gains for a reference: those that are given, else the usual ones of the robot. Each is one for all joints, or one for each.
fn gains(
    robot: &dyn lagrangian::Model,
    reference: &Reference,
    [kp, kd]: [Vec<f64>; 2],
    linear: bool,
) -> lagrangian::Result<Gains> {
    let inertia = match linear {
        true => vec![1.0; reference.dof()],
        false => inertia_along(robot, reference)?,
    };
    Gains::usual(&inertia).replaced(&kp, &kd)
}

/// Lets a robot, until another takes its place, follow a trajectory, `speed` times as fast, through a model or a learner, or by feedback alone.
#[pyfunction]
pub(crate) fn follow_reference<'py>(
    py: Python<'py>,
    model: Option<&Bound<'py, Model>>,
    learner: Option<&Bound<'py, Online>>,
    robots: (Bound<'py, Model>, Option<(f64, Bound<'py, Model>)>),
    reference: &Bound<'py, PyAny>,
    law: (String, f64, Vec<f64>, Vec<f64>),
    control: Loop,
) -> PyResult<Bound<'py, PyDict>> {
    let (controller, speed, kp, kd) = law;
    let desired = recording(reference)?;
    if desired.signals.qd.is_empty() {
        let message =
            "the reference has no velocities: give qd, or take those of lagrangian.prepare";
        return Err(invalid(py, message));
    }
    let (robot, change) = (robots.0.get(), &robots.1);
    let machine = robot.body().model();
    let with = model.map(|model| model.get().body().model());
    let linear = controller == "computed-torque";
    let learns = learner.map(|learner| learner.get().config());
    let other = change.as_ref().map(|(_, other)| other.get());
    let change = change.as_ref().map(|(at, other)| RobotChange {
        at: *at,
        robot: other.get().body().model(),
    });
    let run = || -> lagrangian::Result<_> {
        let trajectory = lagrangian::Trajectory::new(desired.name, desired.t, desired.signals);
        let reference = Reference::new(trajectory)?.faster(speed)?;
        Error::check_shape(
            "reference",
            reference.dof(),
            machine.coordinates().dof(),
            "give a column of q for each joint of the robot",
        )?;
        let gains = gains(machine, &reference, [kp, kd], linear && with.is_some())?;
        let law = match (with, learns) {
            (_, Some((coordinates, online))) => ControlLaw::Online(coordinates, online, &gains),
            (None, _) => ControlLaw::Feedback(&gains),
            (Some(model), _) if linear => ControlLaw::ComputedTorque(model, &gains),
            (Some(model), _) => ControlLaw::FeedForward(model, &gains),
        };
        follow(machine, change, &reference, law, &control.config())
    };
    let followed = py.detach(run);
    for robot in [robot].into_iter().chain(other) {
        robot.body().raised()?;
    }
    let followed = followed.or_raise(py)?;
    let (rows, n) = (
        followed.driven.trajectory.len(),
        machine.coordinates().dof(),
    );
    let found = driven(py, robot, followed.driven)?;
    found.set_item("error", array(py, followed.error, &[rows, n])?)?;
    found.set_item("following", value(py, &followed.following)?)?;
    found.set_item("without_model", followed.without_model)?;
    found.set_item("record", value(py, &followed.record)?)?;
    Ok(found)
}

/// Drives a robot from a state by a function of (t, q, qd) for some seconds.
#[pyfunction]
pub(crate) fn drive<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Model>,
    policy: Py<PyAny>,
    start: (Vec<f64>, Vec<f64>),
    seconds: f64,
    control: Loop,
) -> PyResult<Bound<'py, PyDict>> {
    let robot = robot.get();
    let machine = robot.body().model();
    let n = machine.coordinates().dof();
    let mut failure = None;
    let mut act = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
        tau.fill(f64::NAN);
        if failure.is_some() {
            return;
        }
        let called = Python::attach(|py| -> PyResult<()> {
            py.check_signals()?;
            let (q, qd) = (array(py, q.to_vec(), &[n])?, array(py, qd.to_vec(), &[n])?);
            let answer = policy.bind(py).call1((t, q, qd))?;
            let answer = Rows::new(&answer, "the value of policy", n)?;
            let [found, ..] = answer.values().chunks_exact(n).collect::<Vec<_>>()[..] else {
                return Err(invalid(py, "the value of policy is empty"));
            };
            tau.copy_from_slice(found);
            Ok(())
        });
        failure = called.err();
    };
    let run = || -> lagrangian::Result<Driven> {
        let mut simulation =
            Simulation::new(machine, &State::new(start.0, start.1), control.config())?;
        simulation.run(&mut act, seconds);
        Ok(simulation.finish())
    };
    let finished = py.detach(run);
    if let Some(error) = failure {
        return Err(error);
    }
    driven(py, robot, finished.or_raise(py)?)
}
