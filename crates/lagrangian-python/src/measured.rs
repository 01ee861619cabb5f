//! The library's own time, from which `python/tools/figures.py` computes the cost of a call from Python.

use std::hint::black_box;
use std::time::Instant;

use pyo3::prelude::*;

use crate::arrays::Rows;
use crate::model::Model;

/// The time of one `inverse_dynamics` of the library at some states, s: the shortest mean of ten rounds of `calls` calls.
#[pyfunction]
pub(crate) fn library_seconds(
    py: Python<'_>,
    model: &Bound<'_, Model>,
    motion: [Bound<'_, PyAny>; 3],
    calls: usize,
) -> PyResult<f64> {
    let model = model.get().body().model();
    let n = model.coordinates().dof();
    let [q, qd, qdd] = &motion;
    let rows = [(q, "q"), (qd, "qd"), (qdd, "qdd")];
    let [q, qd, qdd] = rows.map(|(values, name)| Rows::new(values, name, n));
    let (q, qd, qdd) = (q?, qd?, qdd?);
    let (q, qd, qdd) = (q.values(), qd.values(), qdd.values());
    Ok(py.detach(|| {
        let mut evaluator = model.evaluator();
        let mut tau = vec![0.0; q.len()];
        let mut round = || {
            let start = Instant::now();
            for _ in 0..calls.max(1) {
                let _ = black_box(evaluator.inverse_dynamics(black_box(q), qd, qdd, &mut tau));
            }
            start.elapsed().as_secs_f64() / calls.max(1) as f64
        };
        (0..10).map(|_| round()).fold(f64::INFINITY, f64::min)
    }))
}
