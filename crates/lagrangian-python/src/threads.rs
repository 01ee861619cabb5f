//! The threads that fits and many rollouts run on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lagrangian::Stop;
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

/// The time between two looks for Ctrl-C.
pub(crate) const LOOK_EVERY: Duration = Duration::from_millis(50);

thread_local! {
    /// The request to end what this thread waits for; it outlives all that looks at it.
    static ENDED: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
}

/// Runs `work` on the pool while this thread looks for Ctrl-C and at the clock. When the time is up the work is asked to end with
/// what it has; at Ctrl-C its result is dropped, and the exception raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    limit: Duration,
    work: impl FnOnce(Stop) -> T + Send,
) -> PyResult<T> {
    let pool = pool(py)?;
    let flag = ENDED.with(|flag| *flag);
    flag.store(false, Ordering::Relaxed);
    let (done, mut ended) = channel::<()>();
    let start = Instant::now();
    let mut pressed = None;
    let result = std::thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let _done = done;
            pool.install(|| work(Stop::when(flag)))
        });
        loop {
            let ended = &mut ended;
            let waited = py.detach(move || ended.recv_timeout(LOOK_EVERY));
            if waited != Err(RecvTimeoutError::Timeout) {
                break;
            }
            if let Err(interrupt) = py.check_signals() {
                pressed.get_or_insert(interrupt);
            }
            if pressed.is_some() || start.elapsed() >= limit {
                flag.store(true, Ordering::Relaxed);
            }
        }
        py.detach(|| worker.join())
    });
    match (pressed, result) {
        (Some(interrupt), _) => Err(interrupt),
        (None, Ok(value)) => Ok(value),
        (None, Err(panic)) => std::panic::resume_unwind(panic),
    }
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
