//! A slot that passes the newest value to a non-blocking reader.
//!
//! A counter indicates a new value; only then the reader tries the lock. If the writer holds the lock at
//! that instant, the reader keeps its old value and tries again at its next tick.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};

struct Shared<X> {
    version: AtomicU64,
    value: Mutex<Option<Arc<X>>>,
}

/// Writing end, for the learner.
pub struct Publisher<X> {
    shared: Arc<Shared<X>>,
}

/// Reading end, for the control loop.
pub struct Subscriber<X> {
    shared: Arc<Shared<X>>,
    seen: u64,
}

/// An empty slot.
#[must_use]
pub fn slot<X>() -> (Publisher<X>, Subscriber<X>) {
    let shared = Arc::new(Shared {
        version: AtomicU64::new(0),
        value: Mutex::new(None),
    });
    let subscriber = Subscriber {
        shared: shared.clone(),
        seen: 0,
    };
    (Publisher { shared }, subscriber)
}

impl<X> Publisher<X> {
    /// Replaces the last value.
    pub fn publish(&mut self, value: Arc<X>) {
        let old = {
            let lock = self.shared.value.lock();
            lock.unwrap_or_else(PoisonError::into_inner).replace(value)
        };
        self.shared.version.fetch_add(1, Ordering::Release);
        // Freed here, outside the lock, unless the loop still uses it.
        drop(old);
    }
}

impl<X> Subscriber<X> {
    /// Whether a value was published since the last [`Subscriber::take`]: one load.
    #[must_use]
    pub fn has_new(&self) -> bool {
        self.shared.version.load(Ordering::Acquire) != self.seen
    }

    /// The newest value, unless it was taken before; never blocks.
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
        let (mut publisher, mut subscriber) = slot();
        assert!(subscriber.take().is_none() && !subscriber.has_new());
        publisher.publish(Arc::new(1));
        publisher.publish(Arc::new(2));
        assert!(subscriber.has_new());
        assert_eq!(subscriber.take().as_deref(), Some(&2));
        assert!(subscriber.take().is_none());
    }
}
