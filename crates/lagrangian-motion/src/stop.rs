//! Requests to end computations early.

use std::sync::atomic::{AtomicBool, Ordering};

/// A request to end, raised by another thread: at Ctrl-C, or when the time is up. The results so far are kept.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stop(Option<&'static AtomicBool>);

impl Stop {
    /// A request that is raised by setting `flag`; without a flag ([`Stop::default`]) nothing ends early.
    #[must_use]
    pub const fn when(flag: &'static AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether the computation is to end now.
    #[must_use]
    pub fn is_asked(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

impl PartialEq for Stop {
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (Some(own), Some(other)) => std::ptr::eq(own, other),
            (own, other) => own.is_none() && other.is_none(),
        }
    }
}
