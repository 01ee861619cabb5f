//! Hands the newest value to a reader that never waits.
//!
//! A counter says that there is something new; only then the reader tries the lock, and if the writer holds it at that
//! instant, the reader goes on with what it has and looks again at its next tick.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};

struct Shared<X> {
    version: AtomicU64,
    value: Mutex<Option<Arc<X>>>,
}

/// The end of the learner.
pub struct Giver<X> {
    shared: Arc<Shared<X>>,
}

/// The end of the control loop.
pub struct Taker<X> {
    shared: Arc<Shared<X>>,
    seen: u64,
}

/// An empty slot.
#[must_use]
pub fn slot<X>() -> (Giver<X>, Taker<X>) {
    let shared = Arc::new(Shared {
        version: AtomicU64::new(0),
        value: Mutex::new(None),
    });
    let taker = Taker {
        shared: shared.clone(),
        seen: 0,
    };
    (Giver { shared }, taker)
}

impl<X> Giver<X> {
    /// Puts a value in the place of the last.
    pub fn give(&mut self, value: Arc<X>) {
        let old = {
            let lock = self.shared.value.lock();
            lock.unwrap_or_else(PoisonError::into_inner).replace(value)
        };
        self.shared.version.fetch_add(1, Ordering::Release);
        // Freed here, outside the lock, unless the loop still uses it.
        drop(old);
    }
}

impl<X> Taker<X> {
    /// Whether something was given since the last [`Taker::take`]: one load.
    #[must_use]
    pub fn news(&self) -> bool {
        self.shared.version.load(Ordering::Acquire) != self.seen
    }

    /// The newest value, if there is one that was not taken before; never waits.
    pub fn take(&mut self) -> Option<Arc<X>> {
        let version = self.shared.version.load(Ordering::Acquire);
        if version == self.seen {
            return None;
        }
        let value = match self.shared.value.try_lock() {
            Ok(value) => value.clone(),
            Err(TryLockError::Poisoned(value)) => value.into_inner().clone(),
            Err(TryLockError::WouldBlock) => return None,
        };
        self.seen = version;
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_taken_once_and_the_newest_wins() {
        let (mut giver, mut taker) = slot();
        assert!(taker.take().is_none() && !taker.news());
        giver.give(Arc::new(1));
        giver.give(Arc::new(2));
        assert!(taker.news());
        assert_eq!(taker.take().as_deref(), Some(&2));
        assert!(taker.take().is_none());
    }
}
