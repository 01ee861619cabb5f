//! The threads that fits and many rollouts run on.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{invalid, raise};

/// The pool, the process that it was made in, and the number of its threads.
struct Threads {
    count: usize,
    pool: Option<(u32, Arc<ThreadPool>)>,
}

static THREADS: Mutex<Threads> = Mutex::new(Threads {
    count: 0,
    pool: None,
});

/// More threads than this are a mistake.
const MOST: usize = 4096;

/// Sets the number of threads of later fits and rollouts; 0 for one on each core.
#[pyfunction]
pub(crate) fn set_threads(py: Python<'_>, count: usize) -> PyResult<()> {
    if count > MOST {
        let message =
            format!("count is {count}: it must be at most {MOST}, or 0 for one on each core");
        return Err(invalid(py, message));
    }
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    *threads = Threads { count, pool: None };
    Ok(())
}

/// The pool of this process. A process that was forked has none of the threads of its parent, and gets its own.
pub(crate) fn pool(py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    let own = std::process::id();
    if let Some((process, pool)) = &threads.pool {
        if *process == own {
            return Ok(Arc::clone(pool));
        }
        // Its threads are not there, so that nobody could end them.
        std::mem::forget(threads.pool.take());
    }
    let built = ThreadPoolBuilder::new()
        .num_threads(threads.count)
        .thread_name(|k| format!("lagrangian-{k}"))
        .build();
    let pool = Arc::new(built.map_err(|error| {
        let message =
            format!("threads cannot be started ({error}): take fewer, lagrangian.set_threads(1)");
        raise(py, "LagrangianError", message)
    })?);
    threads.pool = Some((own, Arc::clone(&pool)));
    Ok(pool)
}
