//! The answers of a model at the states of some arrays.

use std::sync::{Arc, PoisonError};

use lagrangian::Evaluator;
use lagrangian::mechanics::Evaluation;
use pyo3::prelude::*;

use crate::arrays::{Rows, array, shown, writable};
use crate::error::{invalid, raise};
use crate::model::{Model, Ready};

/// A requested quantity: its name, and its number of axes of n entries beside those of the states.
#[derive(Clone, Copy)]
pub(crate) struct Asked(pub(crate) &'static str, pub(crate) usize);

pub(crate) const SCALAR: usize = 0;
pub(crate) const VECTOR: usize = 1;
pub(crate) const MATRIX: usize = 2;

/// Arguments of a question: their names and values, the first of which is q; an absent one is 0.
type Given<'a, 'py> = (&'static str, Option<&'a Bound<'py, PyAny>>);

/// Writes an answer for q and q̇.
type Answer = fn(&mut dyn Evaluator, [&[f64]; 2], &mut [f64]) -> Evaluation;

/// A quantity of a state (q, q̇): its name, its axes as in [`Asked`], and its evaluation at states.
pub(crate) struct OfState(pub(crate) &'static str, pub(crate) usize, pub(crate) Answer);

impl Model {
    /// A quantity at states, which are at rest where `qd` is absent.
    pub(crate) fn of_state<'py>(
        &self,
        OfState(name, axes, ask): OfState,
        q: &Bound<'py, PyAny>,
        qd: Option<&Bound<'py, PyAny>>,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [("q", Some(q)), ("qd", qd)];
        self.answer(q.py(), Asked(name, axes), given, out, ask)
    }

    /// The answer at the states of the arguments, written to `out` or to a new array.
    pub(crate) fn answer<'py, const G: usize>(
        &self,
        py: Python<'py>,
        asked: Asked,
        given: [Given<'_, 'py>; G],
        out: Option<Bound<'py, PyAny>>,
        ask: impl Fn(&mut dyn Evaluator, [&[f64]; G], &mut [f64]) -> Evaluation + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let States { rows, batch } = States::of(py, given, self.n)?;
        let states: usize = batch.iter().product();
        let mut shape = batch;
        shape.extend(std::iter::repeat_n(self.n, asked.1));
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
        let mut target = writable(&out, &shape)?;
        let values = target
            .as_slice_mut()
            .map_err(|_| invalid(py, "out is not contiguous: give a contiguous array"))?;
        let outcome = self.evaluate(py, states, &ask, arguments, values);
        drop(target);
        self.check(py, asked, outcome, &rows)?;
        Ok(out)
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
            // Releasing the lock for a microsecond costs more than it gains.
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

    /// Turns a missing answer into an exception, which names the states with a singular mass matrix.
    fn check(
        &self,
        py: Python<'_>,
        asked: Asked,
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
                        asked.0
                    ),
                };
                Err(invalid(py, message))
            }
            Evaluation::Unsupported => {
                let message = format!(
                    "the model has no {}: take a model with a Lagrangian, such as Lnn, Delan or Rigid",
                    asked.0
                );
                Err(raise(py, "NotSupported", message))
            }
        }
    }
}

/// The largest number of states for which the interpreter's lock is kept.
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

/// One state, repeated to the number of states; `None` where no repetition is needed.
fn repeated(rows: &Rows<'_>, states: usize, n: usize) -> Option<Vec<f64>> {
    (rows.values().len() != states * n).then(|| rows.values().repeat(states))
}
