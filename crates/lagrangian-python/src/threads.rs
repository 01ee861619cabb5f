//! The threads of fits and of many rollouts.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
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

/// The largest accepted number of threads.
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

/// The time between two checks for Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Runs `work` on the pool, while this thread calls `look` with each event that it sends, and regularly without one.
pub(crate) fn attended<E: Send, T: Send>(
    py: Python<'_>,
    work: impl FnOnce(Sender<E>) -> T + Send,
    mut look: impl FnMut(Option<E>),
) -> PyResult<T> {
    let pool = pool(py)?;
    let (events, mut seen) = channel();
    let result = std::thread::scope(|scope| {
        let worker = scope.spawn(move || pool.install(|| work(events)));
        loop {
            let next = &mut seen;
            match py.detach(move || next.recv_timeout(LOOK_EVERY)) {
                Ok(event) => look(Some(event)),
                Err(RecvTimeoutError::Timeout) => look(None),
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        py.detach(|| worker.join())
    });
    result.or_else(|panic| std::panic::resume_unwind(panic))
}

thread_local! {
    /// The request to end the work that this thread waits for; it outlives all that read it.
    static ENDED: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
}

/// Runs `work` on the pool while this thread checks for Ctrl-C and the clock. When the time is up the work is asked to end with its
/// present result; at Ctrl-C its result is dropped, and the exception raised.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    limit: Duration,
    work: impl FnOnce(Stop) -> T + Send,
) -> PyResult<T> {
    let flag = ENDED.with(|flag| *flag);
    flag.store(false, Ordering::Relaxed);
    let start = Instant::now();
    let mut pressed = None;
    let work = |events: Sender<()>| {
        // The work sends no events; the end of the channel is its end.
        let _events = events;
        work(Stop::when(flag))
    };
    let value = attended(py, work, |_| {
        if let Err(interrupt) = py.check_signals() {
            pressed.get_or_insert(interrupt);
        }
        if pressed.is_some() || start.elapsed() >= limit {
            flag.store(true, Ordering::Relaxed);
        }
    })?;
    pressed.map_or(Ok(value), Err)
}

/// The pool of this process. A forked process has none of the threads of its parent, and gets a pool of its own.
pub(crate) fn pool(py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    let own = std::process::id();
    if let Some((process, pool)) = &threads.pool {
        if *process == own {
            return Ok(Arc::clone(pool));
        }
        // Its threads do not exist in this process, so they cannot be ended.
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
