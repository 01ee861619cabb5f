//! The duration of a training, without the time for which the process was stopped.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use nets::Instant;

/// The interval at which the time is taken.
const TICK: Duration = Duration::from_millis(100);

/// A longer interval between two ticks is one in which the process was stopped (SIGSTOP, a laptop asleep): it counts as this.
const LONGEST: Duration = Duration::from_secs(1);

/// A clock that runs while the process does.
pub(super) struct Clock {
    time: Arc<Mutex<Time>>,
    /// Ends the thread of the ticks when it is dropped; `None` without threads, as in a browser, where the time is taken only at
    /// readings.
    _running: Option<Sender<()>>,
}

struct Time {
    last: Instant,
    total: Duration,
}

impl Time {
    /// Takes the time until `now`.
    fn advance(&mut self, now: Instant) -> Duration {
        self.total += now.saturating_duration_since(self.last).min(LONGEST);
        self.last = now;
        self.total
    }
}

impl Clock {
    /// A clock that begins now.
    pub(super) fn start() -> Self {
        let time = Arc::new(Mutex::new(Time {
            last: Instant::now(),
            total: Duration::ZERO,
        }));
        let (running, ended) = channel::<()>();
        let ticking = Arc::clone(&time);
        let ticks = thread::Builder::new().spawn(move || {
            while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                advance(&ticking);
            }
        });
        Self {
            time,
            _running: ticks.is_ok().then_some(running),
        }
    }

    /// The time that it has run, s.
    pub(super) fn seconds(&self) -> f64 {
        advance(&self.time).as_secs_f64()
    }
}

fn advance(time: &Mutex<Time>) -> Duration {
    // OK because the time is whole after every call.
    let mut time = time.lock().unwrap_or_else(PoisonError::into_inner);
    time.advance(Instant::now())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_for_which_the_process_was_stopped_is_no_training_time() {
        let last = Instant::now();
        let mut time = Time {
            last,
            total: Duration::ZERO,
        };
        let after = |milliseconds| last + Duration::from_millis(milliseconds);
        assert_eq!(time.advance(after(100)), Duration::from_millis(100));
        assert_eq!(time.advance(after(200)), Duration::from_millis(200));
        assert_eq!(time.advance(after(3_600_200)), Duration::from_millis(1200));
        assert_eq!(time.advance(after(3_600_300)), Duration::from_millis(1300));
    }
}
