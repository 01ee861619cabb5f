//! A monotonic clock, on every target.

#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
pub use std::time::Instant;

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
pub use page::Instant;

/// Clock of the page that runs the module, where the standard library has no clock.
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
mod page {
    #![allow(unsafe_code, reason = "the declaration of a function of the page")]

    use std::time::Duration;

    #[link(wasm_import_module = "page")]
    unsafe extern "C" {
        /// Milliseconds since an arbitrary moment, never decreasing: `performance.now`.
        safe fn now() -> f64;
    }

    /// A moment, as `std::time::Instant` is on other targets.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub struct Instant(Duration);

    impl Instant {
        /// Current moment.
        #[must_use]
        pub fn now() -> Self {
            Self(Duration::try_from_secs_f64(now() / 1e3).unwrap_or_default())
        }

        /// Time since this moment.
        #[must_use]
        pub fn elapsed(&self) -> Duration {
            Self::now().saturating_duration_since(*self)
        }

        /// Time from an earlier moment to this one; zero where it is not earlier.
        #[must_use]
        pub fn saturating_duration_since(&self, earlier: Self) -> Duration {
            self.0.saturating_sub(earlier.0)
        }
    }
}
