//! Numbers that carry derivatives through a Lagrangian that is written in Python.

use std::sync::{Mutex, PoisonError};

use lagrangian::analytic::{
    AnalyticModel, Dual64, DualJets, DualNum, HyperDual64, OverDuals, Rng, uniform,
};
use lagrangian::mechanics::{EulerLagrange, Jets, Lagrangian};
use lagrangian::{Coordinates, Evaluator, Model, State};
use pyo3::basic::CompareOp;
use pyo3::exceptions::{PyTypeError, PyZeroDivisionError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::objects;

/// A number a + b ε₁ + c ε₂ + d ε₁ε₂, whose last component becomes a second derivative (Fike and Alonso 2011). NumPy's
/// functions of an array of such numbers call the methods of these names.
#[pyclass(frozen, from_py_object, module = "lagrangian._lagrangian")]
#[derive(Clone, Copy)]
pub(crate) struct Number(HyperDual64);

/// An operand: another such number, or a plain one.
fn operand(value: &Bound<'_, PyAny>) -> PyResult<HyperDual64> {
    if let Ok(number) = value.cast::<Number>() {
        return Ok(number.get().0);
    }
    Ok(HyperDual64::from_re(value.extract()?))
}

#[pymethods]
impl Number {
    fn sin(&self) -> Self {
        Self(self.0.sin())
    }

    fn cos(&self) -> Self {
        Self(self.0.cos())
    }

    fn tan(&self) -> Self {
        Self(self.0.tan())
    }

    fn sinh(&self) -> Self {
        Self(self.0.sinh())
    }

    fn cosh(&self) -> Self {
        Self(self.0.cosh())
    }

    fn tanh(&self) -> Self {
        Self(self.0.tanh())
    }

    fn exp(&self) -> Self {
        Self(self.0.exp())
    }

    fn sqrt(&self) -> Self {
        Self(self.0.sqrt())
    }

    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(self.0 + operand(other)?))
    }

    fn __radd__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.__add__(other)
    }

    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(self.0 - operand(other)?))
    }

    fn __rsub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(operand(other)? - self.0))
    }

    fn __mul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(self.0 * operand(other)?))
    }

    fn __rmul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.__mul__(other)
    }

    fn __truediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        divided(self.0, operand(other)?)
    }

    fn __rtruediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        divided(operand(other)?, self.0)
    }

    fn __pow__(
        &self,
        exponent: &Bound<'_, PyAny>,
        _modulo: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        if let Ok(n) = exponent.extract::<i32>() {
            return Ok(Self(self.0.powi(n)));
        }
        if let Ok(x) = exponent.extract::<f64>() {
            return Ok(Self(self.0.powf(x)));
        }
        Ok(Self((self.0.ln() * operand(exponent)?).exp()))
    }

    fn __rpow__(
        &self,
        base: &Bound<'_, PyAny>,
        _modulo: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Ok(Self((operand(base)?.ln() * self.0).exp()))
    }

    fn __neg__(&self) -> Self {
        Self(-self.0)
    }

    fn __pos__(&self) -> Self {
        *self
    }

    fn __abs__(&self) -> Self {
        Self(if self.0.re < 0.0 { -self.0 } else { self.0 })
    }

    fn fabs(&self) -> Self {
        self.__abs__()
    }

    fn square(&self) -> Self {
        Self(self.0 * self.0)
    }

    fn reciprocal(&self) -> PyResult<Self> {
        divided(HyperDual64::from_re(1.0), self.0)
    }

    fn log(&self) -> Self {
        Self(self.0.ln())
    }

    fn arcsin(&self) -> Self {
        Self(self.0.asin())
    }

    fn arccos(&self) -> Self {
        Self(self.0.acos())
    }

    fn arctan(&self) -> Self {
        Self(self.0.atan())
    }

    fn log1p(&self) -> Self {
        Self(self.0.ln_1p())
    }

    fn expm1(&self) -> Self {
        Self(self.0.exp_m1())
    }

    fn __richcmp__(&self, other: &Bound<'_, PyAny>, by: CompareOp) -> PyResult<bool> {
        let other = operand(other)?.re;
        let order = self.0.re.partial_cmp(&other);
        Ok(order.is_some_and(|order| by.matches(order)))
    }

    fn __float__(&self) -> PyResult<f64> {
        Err(PyTypeError::new_err(
            "a number with derivatives is not a plain float: use functions of numpy (numpy.sin), not of math, and no float()",
        ))
    }

    fn __repr__(&self) -> String {
        format!("Number({})", self.0.re)
    }
}

fn divided(a: HyperDual64, b: HyperDual64) -> PyResult<Number> {
    match b.re == 0.0 {
        true => Err(PyZeroDivisionError::new_err("division by zero")),
        false => Ok(Number(a / b)),
    }
}

/// A system whose Lagrangian is a function of Python.
pub(crate) struct OwnSystem {
    name: String,
    function: Py<PyAny>,
    coordinates: Coordinates,
    /// The first exception that the function has raised since the last check.
    failure: Mutex<Option<PyErr>>,
}

impl OwnSystem {
    pub(crate) fn new(name: String, function: Py<PyAny>, coordinates: Coordinates) -> Self {
        Self {
            name,
            function,
            coordinates,
            failure: Mutex::new(None),
        }
    }

    /// The first exception of the function since the last check.
    pub(crate) fn failure(&self) -> Option<PyErr> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.take()
    }

    fn call(&self, py: Python<'_>, q: &[HyperDual64], qd: &[HyperDual64]) -> PyResult<HyperDual64> {
        py.check_signals()?;
        let array = |values: &[HyperDual64]| -> PyResult<Bound<'_, PyAny>> {
            let numbers: Vec<Number> = values.iter().map(|x| Number(*x)).collect();
            objects(py, PyTuple::new(py, numbers)?)
        };
        let value = self.function.bind(py).call1((array(q)?, array(qd)?))?;
        operand(&value).map_err(|_| {
            let class = value.get_type();
            PyTypeError::new_err(format!(
                "the Lagrangian has returned a {class}: it must return one number, made of q and qd by arithmetic and functions of numpy"
            ))
        })
    }
}

/// A number without a second direction.
fn widened(x: &Dual64) -> HyperDual64 {
    HyperDual64::new(x.re, x.eps, 0.0, 0.0)
}

impl OverDuals for OwnSystem {
    fn with_slope(&self, q: &[Dual64], qd: &[Dual64]) -> Dual64 {
        let (q, qd): (Vec<_>, Vec<_>) = (
            q.iter().map(widened).collect(),
            qd.iter().map(widened).collect(),
        );
        let value = self.with_curvature(&q, &qd);
        Dual64::new(value.re, value.eps1)
    }

    fn with_curvature(&self, q: &[HyperDual64], qd: &[HyperDual64]) -> HyperDual64 {
        let nothing = HyperDual64::from_re(f64::NAN);
        // No lock is held while the interpreter works: a thread that holds the interpreter may wait for this lock.
        let failure = || self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        if failure().is_some() {
            return nothing;
        }
        Python::attach(|py| self.call(py, q, qd)).unwrap_or_else(|error| {
            failure().get_or_insert(error);
            nothing
        })
    }
}

impl Lagrangian for OwnSystem {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DualJets::new(self, self.coordinates.dof()))
    }
}

impl Model for OwnSystem {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(EulerLagrange::new(self, None))
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        Some(EulerLagrange::new(self, None))
    }
}

impl AnalyticModel for OwnSystem {
    fn name(&self) -> &str {
        &self.name
    }

    fn lagrangian(&self) -> &dyn Lagrangian {
        self
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let n = self.coordinates.dof();
        State::new(uniform(rng, n, -1.0, 1.0), uniform(rng, n, -1.0, 1.0))
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        self.sample_state(rng)
    }
}
