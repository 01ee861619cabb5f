//! Motions that a model predicts.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use lagrangian::mechanics::Outcome;
use lagrangian::rollout::{Hold, free, rollout, rollout_recorded};
use lagrangian::{Rollout, RolloutOptions, Signals, Trajectory};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Rows, array};
use crate::error::{OrRaise, invalid};
use crate::model::Model;
use crate::recording::{parts, recording};
use crate::systems::Integration;
use crate::threads::interruptible;

/// A motion as the parts of a trajectory of Python, its outcome, and its cost.
fn motion<'py>(
    py: Python<'py>,
    model: &Model,
    rollout: Rollout,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    model.body().raised()?;
    let Rollout {
        trajectory,
        outcome,
        steps,
        rejected,
        evaluations,
        singular,
    } = rollout;
    let coordinates = model.body().model().coordinates();
    let (t, signals) = (trajectory.t, trajectory.signals);
    let parts = parts(py, &trajectory.name, coordinates, t, signals)?;
    let end = PyDict::new(py);
    let (kind, time, reason) = match outcome {
        Outcome::Finished => ("finished", None, None),
        Outcome::Diverged { t, reason } => ("diverged", Some(t), Some(reason.to_string())),
        Outcome::StepLimit { t } => ("step-limit", Some(t), None),
        Outcome::Stopped { t } => ("stopped", Some(t), None),
    };
    end.set_item("outcome", kind)?;
    end.set_item("t", time)?;
    end.set_item("reason", reason)?;
    end.set_item("steps", steps)?;
    end.set_item("rejected", rejected)?;
    end.set_item("evaluations", evaluations)?;
    end.set_item("singular", singular)?;
    Ok((parts, end))
}

/// The times from 0 to a duration, s.
#[pyfunction]
pub(crate) fn times(py: Python<'_>, duration: f64, step: f64) -> PyResult<Bound<'_, PyAny>> {
    let times = lagrangian::rollout::times(duration, step).or_raise(py)?;
    let count = times.len();
    Ok(array(py, times, &[count])?.into_any())
}

/// The motion from (q0, qd0) at these times, under forces at these times, under a function of (t, q, qd), or free.
#[pyfunction]
#[pyo3(signature = (model, start, times, tau, hold, integration))]
pub(crate) fn roll_out<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    start: (Bound<'py, PyAny>, Bound<'py, PyAny>),
    times: &Bound<'py, PyAny>,
    tau: Option<Bound<'py, PyAny>>,
    hold: &str,
    integration: Integration,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let own = model.get();
    let model = own.body().model();
    let n = model.coordinates().dof();
    let options = integration.options(py)?;
    let (q0, qd0) = (
        Rows::new(&start.0, "q0", n)?,
        Rows::new(&start.1, "qd0", n)?,
    );
    let times = Rows::of_any_width(times, "times")?;
    let start = (q0.values(), qd0.values(), times.values());
    let (q0, qd0, t) = start;
    let Some(tau) = tau else {
        let run = |options: &RolloutOptions| rollout(model, q0, qd0, t, &free, options);
        return motion(py, own, ended(py, &options, run)?);
    };
    if tau.is_callable() {
        return motion(py, own, under(py, model, start, tau, &options)?);
    }
    let tau = Rows::new(&tau, "tau", n)?;
    if tau.values().len() != t.len() * n {
        let (rows, times) = (tau.values().len() / n.max(1), t.len());
        let message = format!(
            "tau has {rows} rows where there are {times} times: give forces at each of the times, or a function of (t, q, qd)"
        );
        return Err(invalid(py, message));
    }
    let hold = hold_of(py, hold)?;
    let first = |state: &[f64]| {
        let mut rows = vec![0.0; t.len() * n];
        rows.iter_mut()
            .zip(state)
            .for_each(|(x, first)| *x = *first);
        rows
    };
    let forces = Signals {
        q: first(q0),
        qd: first(qd0),
        tau: tau.values().to_vec(),
        ..Signals::default()
    };
    let recording = Trajectory::new("forces", t.to_vec(), forces);
    let run = |options: &RolloutOptions| rollout_recorded(model, &recording, hold, options);
    motion(py, own, ended(py, &options, run)?)
}

/// A prediction of a recorded motion: from its first state, under its forces, at its times.
#[pyfunction]
pub(crate) fn follow<'py>(
    py: Python<'py>,
    model: &Bound<'py, Model>,
    trajectory: &Bound<'py, PyAny>,
    hold: &str,
    integration: Integration,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let own = model.get();
    let recording = recording(trajectory)?;
    recording.validate().or_raise(py)?;
    if recording.qd.is_empty() {
        let message =
            "the trajectory has no velocities: give qd, or take those of lagrangian.prepare";
        return Err(invalid(py, message));
    }
    let (hold, options) = (hold_of(py, hold)?, integration.options(py)?);
    let recording = Trajectory::new(recording.name, recording.t, recording.signals);
    let model = own.body().model();
    let run = |options: &RolloutOptions| rollout_recorded(model, &recording, hold, options);
    motion(py, own, ended(py, &options, run)?)
}

/// A rollout that Ctrl-C ends.
fn ended(
    py: Python<'_>,
    options: &RolloutOptions,
    run: impl FnOnce(&RolloutOptions) -> lagrangian::Result<Rollout> + Send,
) -> PyResult<Rollout> {
    let options = *options;
    let rollout = interruptible(py, Duration::MAX, |stop| {
        run(&RolloutOptions { stop, ..options })
    })?;
    rollout.or_raise(py)
}

fn hold_of(py: Python<'_>, hold: &str) -> PyResult<Hold> {
    match hold {
        "previous" => Ok(Hold::Previous),
        "linear" => Ok(Hold::Linear),
        _ => Err(invalid(
            py,
            format!("hold is '{hold}': choose 'previous' (a digital controller) or 'linear'"),
        )),
    }
}

/// The initial positions and velocities, and the times.
type Start<'a> = (&'a [f64], &'a [f64], &'a [f64]);

/// The motion under the forces that a function of Python returns.
fn under(
    py: Python<'_>,
    model: &dyn lagrangian::Model,
    (q0, qd0, t): Start<'_>,
    tau: Bound<'_, PyAny>,
    options: &RolloutOptions,
) -> PyResult<Rollout> {
    let (n, function) = (q0.len(), tau.unbind());
    // The first exception of the function; the motion then ends, as a force of NaN is not finite.
    let failure: Mutex<Option<PyErr>> = Mutex::new(None);
    let force = |t: f64, q: &[f64], qd: &[f64], out: &mut [f64]| {
        let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
        if failure.is_some() {
            return out.fill(f64::NAN);
        }
        let called = Python::attach(|py| -> PyResult<()> {
            py.check_signals()?;
            let (q, qd) = (array(py, q.to_vec(), &[n])?, array(py, qd.to_vec(), &[n])?);
            let value = function.bind(py).call1((t, q, qd))?;
            let value = Rows::new(&value, "the value of tau", n)?;
            if value.values().len() != n {
                return Err(invalid(
                    py,
                    format!(
                        "the value of tau has {} numbers: return {n}, one for each coordinate",
                        value.values().len()
                    ),
                ));
            }
            out.copy_from_slice(value.values());
            Ok(())
        });
        if let Err(error) = called {
            *failure = Some(error);
            out.fill(f64::NAN);
        }
    };
    let result = py.detach(|| rollout(model, q0, qd0, t, &force, options));
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => result.or_raise(py),
    }
}
